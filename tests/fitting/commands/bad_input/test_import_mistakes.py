"""Natural mistakes at `rapi import`: each is said in one line, with what to do."""

from pathlib import Path

import numpy as np
import pytest
from command_output import assert_one_line
from scope_files import SCOPE, T, U, Y, put, rows, scanned, scope

# Natural mistakes: what is typed, the exit code, and what the one line must say.


def wrong_column(folder):
    return (scope(folder), "--drive", "CH1", "--response", "CH", *SCOPE[4:]), 3, (
        "no column 'CH' for --response", "Did you mean 'CH2'?", "0 'TIME' (s), 1 'CH1' (V)",
    )  # fmt: skip


def two_wrong_columns(folder):
    return (scope(folder), "--drive", "CH7", "--response", "volts", *SCOPE[4:]), 3, (
        "no column 'volts' for --response, and none 'CH7' for --drive", "0 'TIME' (s)",
    )  # fmt: skip


def wrong_unit(folder):
    return (scope(folder), *SCOPE[:-1], "Gigaherz"), 3, (
        "--response-unit must be one of GHz", "not 'Gigaherz'", "--response-scale",
    )  # fmt: skip


def unit_that_is_off(folder):
    """Readings in MHz that are called GHz."""
    return (scope(folder, y=1e3 * Y), *SCOPE), 3, ("spans", "GHz", 'response_unit = "MHz"')


def no_columns_named(folder):
    return (scope(folder),), 3, (
        "which columns are the response and the drive?", "--response and --drive", "2 'CH2' (V)",
    )  # fmt: skip


def columns_that_units_tell(folder):
    """The line to copy is said; a unit that is written out counts."""
    heads = "Zeit (ms),Spannung (V),Frequenz (Gigahertz)\n"
    return (put(folder / "a.csv", heads + rows(T, U, Y)),), 3, (
        "by their units `--response Frequenz --drive Spannung`",
    )  # fmt: skip


def another_name(folder):
    scope(folder)
    return (folder / "skope.csv", *SCOPE), 3, ("no such file", "Did you mean scope.csv?")


def no_units(folder):
    """All that is missing is asked for at once."""
    return (put(folder / "a.csv", "t,u,y\n" + rows(T, U, Y)), "--response", "y"), 3, (
        "which column is the drive? Name it by --drive.", "units of the response and the drive",
        "Give --response-unit and --drive-unit", "1 'u', 2 'y'",
    )  # fmt: skip


def a_unit_in_small_letters(folder):
    return (scope(folder), *SCOPE[:-1], "ghz"), 3, ("not 'ghz'. Did you mean GHz?",)


def missing_reading(folder):
    y = Y.copy()
    y[500:503] = np.nan
    return (scope(folder, y=y), *SCOPE), 3, (
        "3 reading(s) that are missing", "the first at sample 500", "--nan mask",
    )  # fmt: skip


def wrong_rate(folder):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=8000.0)
    return (scope(folder, t, u, y), *SCOPE, "--rate", 12), 3, (
        "the drive repeats at 10 Hz, not at 12 Hz as said", "Correct --rate (of several one each",
    )  # fmt: skip


def folder_of_another_program(folder):
    (folder / "export").mkdir()
    scope(folder / "export")
    return (folder / "export", *SCOPE), 3, ("a folder, and no file", "/*.csv")


def unknown_option(folder):
    return (scope(folder), *SCOPE, "--respons-unit", "V"), 2, ("--respons-unit", "Did you mean")


def no_permission(folder):
    return (scope(folder), *SCOPE, "-o", "/proc/self/r"), 3, (
        "cannot write", "Choose another with `-o`",
    )  # fmt: skip


def output_exists(folder):
    (folder / "mine").mkdir()
    (folder / "mine" / "thesis.txt").write_text("mine")
    return (scope(folder), *SCOPE, "-o", folder / "mine"), 3, (
        "is there and is no recording", "Choose another with `-o`",
    )  # fmt: skip


def no_clock(folder):
    path = put(folder / "a.csv", "drive,response\n" + rows(U, Y))
    return (path, "--drive-unit", "V", "--response-unit", "GHz"), 3, (
        "no column is a time", "--sample-rate",
    )  # fmt: skip


def a_letter_in_a_number(folder):
    path = scope(folder)
    lines = path.read_text().splitlines()
    lines[100] = lines[100].replace("e", "o")
    path.write_text("\n".join(lines))
    return (path, *SCOPE), 3, ("line 101: column 2 must be a number", "Correct that line")


MISTAKES = (
    wrong_column, two_wrong_columns, wrong_unit, unit_that_is_off, no_columns_named,
    columns_that_units_tell, another_name, missing_reading, wrong_rate,
    folder_of_another_program, unknown_option, no_permission, output_exists, no_clock,
    a_letter_in_a_number, no_units, a_unit_in_small_letters,
)  # fmt: skip


@pytest.mark.fault(name="mistakes about a foreign file", promise="one line that says how to go on")
@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_said_in_one_line(rapi, tmp_path, mistake):
    if mistake is no_permission and not Path("/proc/self").is_dir():
        pytest.skip("no folder here that nobody may write to")
    arguments, expected, words = mistake(tmp_path)
    output = () if "-o" in arguments else ("-o", tmp_path / "out")
    code, out, err = rapi("import", *arguments, *output)
    assert (code, out) == (expected, "")
    assert_one_line(err, *words)
    assert not (tmp_path / "out").exists()
    assert sorted(p.name for p in (tmp_path / "mine").glob("*")) in ([], ["thesis.txt"])
