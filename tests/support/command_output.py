"""What commands print and write, held against the contract."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest


def assert_one_line(text: str, *words: str) -> None:
    """One line, safe on a terminal, with all words and no traceback."""
    assert text.endswith("\n") and text.count("\n") == 1, text
    assert text[:-1].isprintable() and "Traceback" not in text and "internal error" not in text
    assert [word for word in words if word not in text] == [], text


def without_progress(text: str) -> str:
    """Standard error without what is said of the work before and while it is done."""
    time = r"\d+ (s|minutes?)"
    about = rf"; about {time}( with the default options)?(, up to {time} where no model fits)?"
    said = rf"(fitting|diagnosing)[^:]*: .*({about}| \(\d+ s\))"
    return "".join(
        line for line in text.splitlines(keepends=True) if not re.fullmatch(said, line.strip())
    )


def split_known_faults(text: str) -> tuple[list[str], str]:
    """Kinds of the faults that a fit tells before it begins, and standard error without them."""
    known = re.findall(r"^known before the fit: ([^:\n]+): .*\n", text, re.MULTILINE)
    return known, re.sub(r"^known before the fit: .*\n", "", text, flags=re.MULTILINE)


def assert_failure(text: str, code: int) -> None:
    """The object on standard output of a command that failed under `--json`."""
    found = json.loads(text, parse_constant=pytest.fail)
    assert found.keys() == {"schema", "exit_code", "kind", "message"}
    assert (found["schema"], found["exit_code"]) == ("rapi.error/1", code)


KEYS = {
    "schema",
    "operator",
    "parameters",
    "runs",
    "rmse",
    "rmse_held_out",
    "held_out",
    "verdict",
    "seconds",
    "versions",
    "data_sha256",
}


def assert_model(folder: Path, printed: str) -> dict:
    """`model.json` as the contract has it, the same as printed, beside the loadable model."""
    model = json.loads((folder / "model.json").read_text(), parse_constant=pytest.fail)
    assert json.loads(printed) == model
    assert KEYS <= model.keys() and model["schema"] == "rapi.model/1"
    for parameter in model["parameters"].values():
        assert {"value", "stderr", "unit", "at_bound"} <= parameter.keys()
    for one in model["runs"]:
        assert {"excitation_hz", "rmse", "unit", "span", "rmse_fraction"} <= one.keys()
    assert model["verdict"]["trusted"] == (not model["verdict"]["reasons"])
    assert (folder / "model.rapi").stat().st_size > 0
    assert not list(folder.glob(".tmp-*"))
    return model


def process(*arguments: object, **options) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "fitting.cli", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL}
    return subprocess.Popen(command, text=True, **pipes, **options)
