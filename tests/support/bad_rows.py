"""Rows of faults that recordings may have, and how a command is held against one."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

from bad_input import FAST, Injector
from command_output import (
    assert_failure,
    assert_model,
    assert_one_line,
    split_known_faults,
    without_progress,
)

FOUND = {"unrelated columns": "nothing explained"}  # what a fit calls what is told before it
MASK = (*FAST, "--nan", "mask")


@dataclasses.dataclass(frozen=True)
class Row:
    """A fault: what is done to a good recording, the exit code, and words that must be said.

    The words are looked for in the one line on standard error, or, with code 4, in the verdict's
    reasons. `samples`: what the fault in `model.json` must list for the first run.
    """

    name: str
    inject: Injector
    code: int
    words: tuple[str, ...] = ()
    options: tuple[str, ...] = FAST
    samples: tuple[tuple[int, int], ...] | None = None


def check_row(row: Row, rapi: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """Fit a recording with the fault, and hold exit code, line and verdict against the row."""
    folder, output = tmp_path / "recording", tmp_path / "output"
    path = row.inject(folder) or folder
    code, out, err = rapi("fit", path, "-o", output, "--json", *row.options)
    assert code == row.code, err
    if code in (0, 4):
        known, more = split_known_faults(without_progress(err))
        assert more == ""
        model = assert_model(output, out)
        reasons = " | ".join(model["verdict"]["reasons"])
        assert [kind for kind in known if f"{FOUND.get(kind, kind)}: " not in reasons] == [], (
            reasons
        )
        assert [word for word in row.words if word not in reasons] == [], reasons
        assert "nan" not in reasons.lower().split()
        if row.samples is not None:
            listed = [f["samples"] for f in model["faults"] if f["run"] == "run00"]
            assert len(listed) == 1 and listed[0]
            assert listed[0] == [list(place) for place in row.samples] or not row.samples
    else:
        assert_failure(out, code)
        assert not (output / "model.json").exists()
        assert_one_line(without_progress(err), *row.words)
