"""Commands that are called wrongly, and outputs that cannot be written."""

import subprocess
import sys
from pathlib import Path

import pytest
from bad_input import FAST, data, entry
from command_output import assert_one_line

USAGE = {
    "unknown command": (("fti", "x"), ("fti", "Did you mean", "fit")),
    "misspelt option": (
        ("fit", "x", "-o", "y", "--strats", "2"),
        ("--strats", "Did you mean --starts?"),
    ),
    "no recording": (("fit",), ("RECORDING is missing", "rapi fit --help")),
    "no output": (("fit", "x"), ("--output is missing", "rapi fit --help")),
    "option without its value": (("fit", "x", "-o"), ("-o requires an argument",)),
    "too many arguments": (("predict", "x", "y", "w", "-o", "z"), ("too many arguments: w",)),
    "not a number": (("fit", "x", "-o", "y", "--plays", "ten"), ("--plays", "ten", "int")),
    "number out of range": (("fit", "x", "-o", "y", "--plays", "0"), ("--plays", ">= 1")),
    "far too many plays": (("fit", "x", "-o", "y", "--plays", "1000000"), ("--plays", "<= 200")),
    "unknown choice": (("fit", "x", "-o", "y", "--each", "mu"), ("--each", "mu", "lam,eta")),
    "no such policy": (("fit", "x", "-o", "y", "--nan", "interpolate"), ("interpolate", "mask")),
    "escape sequence": (("fit", "x", "-o", "y", "--st\x1b[2J", "1"), ("\\x1b[2J",)),
}


@pytest.mark.fault(name="wrong options", promise="exit 2, one line")
@pytest.mark.parametrize("name", USAGE)
def test_usage(name, rapi):
    arguments, words = USAGE[name]
    code, out, err = rapi(*arguments)
    assert (code, out) == (2, "")
    assert_one_line(err, "usage:", "--help", *words)


def a_file(path: Path) -> Path:
    path.write_text("mine")
    return path


def read_only(path: Path) -> Path:
    """A folder that nobody may write to, root included where the system has one."""
    if Path("/proc/self").is_dir():
        return Path("/proc/self")
    path.mkdir(mode=0o500)
    return path


OUTPUTS = {
    "a file in the way": (a_file, "is not a folder"),
    "below a file": (lambda path: a_file(path) / "output", "cannot write"),
    "not writable": (read_only, "cannot write"),
}


@pytest.mark.fault(name="an output that is in the way", promise="exit 2 or 3, one line")
@pytest.mark.parametrize("name", OUTPUTS)
def test_output(name, rapi, tmp_path):
    inject, words = OUTPUTS[name]
    raw_folder = tmp_path / "recording"
    data(lambda recording: None)(raw_folder)
    place = inject(tmp_path / "output")
    code, out, err = rapi("fit", raw_folder, "-o", place, *FAST)
    assert (code, out) == (3, "")
    assert_one_line(err, str(place), words, "Choose another with `-o`")


def test_paths_with_escape_sequences_and_markup_are_shown_as_text(rapi, tmp_path):
    code, _, err = rapi("fit", tmp_path / "no\x1b[2J\n[red]such", "-o", tmp_path / "y")
    assert code == 3
    assert_one_line(err, "no\\x1b[2J\\n[red]such: no such file")


def test_markup_in_a_run_name_is_text(rapi, tmp_path):
    data(entry(name="[red]x[-red]"))(tmp_path / "r")
    code, out, err = rapi("fit", tmp_path / "r", "-o", tmp_path / "o", *FAST)
    assert code == 0 and "[red]x" in out and "\x1b" not in out + err
    assert_one_line(err, "fitting: ", "; about ")


HELP = """
import sys
from fitting.commands.run import run
from fitting.cli import app
assert run(app, []) == 0
for name in (None, "fit", "predict", "demo", "check", "import"):
    arguments = ["--help"] if name is None else [name, "--help"]
    assert run(app, arguments) == 0
    assert "jax" not in sys.modules and "numpy" not in sys.modules, arguments
assert run(app, ["fit", "--strats"]) == 2
assert "jax" not in sys.modules
"""


def test_help_and_usage_load_nothing_heavy():
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "RECORDING" in done.stdout
