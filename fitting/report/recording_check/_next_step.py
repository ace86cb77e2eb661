"""The command that comes after a recording was checked."""

import os
import re
import shlex
from typing import TYPE_CHECKING

from rapi_jax.internal import IMPORT_COMMAND

if TYPE_CHECKING:
    from fitting.recording_check._check import RecordingCheck

_MEND = "Next: mend what is marked with x, then check the recording again."


def describe_next(
    check: "RecordingCheck", *, source: str | None, again: str | None, output: str
) -> str:
    """The next step, with its whole command where that is known.

    `source`: where the recording is, `None` where it was not written. `again`: the line that
    imports it, without its output, where an import made it; `output`: where that goes. A file of
    that line that is not in the working folder is named with the step.
    """
    words = _import_words(again)
    changes, why = _changes(check, words)
    if changes and not (words and IMPORT_COMMAND in check.recording.provenance):
        changes = None  # recordings that were joined take no options of tables
    if changes is None and not check.sound:
        return _MEND
    if not changes and source is not None:
        return f"Next: `{shlex.join(['rapi', 'fit', source, '-o', 'result'])}`"
    for option, value in (changes or {}).items():
        words = _set_option(words, option, value)
    if source is not None and not os.path.exists(words[2]):
        why, output = f"where {words[2]} is, {why}", os.path.abspath(output)
    line = f"Next{f', {why}' if why else ''}: `{shlex.join([*words, '-o', output])}`"
    if check.swapped and check.sound and source is not None:
        fit = shlex.join(["rapi", "fit", source])
        line += f"; if not: `{fit} -o result`; if the drive is one that `rapi compensate` made: "
        line += f"`{fit} --check DRIVES`"
    return line


def _import_words(line: str | None) -> list[str]:
    """The words of a line of `rapi import`; none where it is another line, as a file may hold."""
    try:
        words = shlex.split(line or "")
    except ValueError:
        return []
    known = words[:2] == ["rapi", "import"] and len(words) > 2
    return words if known and (line or "").isprintable() else []


_Changes = tuple[dict[str, str] | None, str]


def _changes(check: "RecordingCheck", words: list[str]) -> _Changes:
    """The options of an import that mend a recording, and why; `None` where none does."""
    kinds = {fault.kind for fault in check.faults}
    if not check.sound and not kinds:
        return None, ""
    if check.swapped:  # whatever else was found may come from it
        return _exchange(words)
    if kinds - {"unsettled start", "noisy drive"}:
        return None, ""
    mended, reasons = {}, []
    for needed, mend in (
        (bool(check.unsettled) or "unsettled start" in kinds, _skip_first),
        ("noisy drive" in kinds, _replace_drive),
    ):
        if needed:
            options, why = mend(check, words)
            if options is None:
                return None, ""
            mended |= options
            reasons.append(why)
    return mended, ", and ".join(reasons)


def _exchange(words: list[str]) -> _Changes:
    elsewhere = {"drive-file", "drive-amplitude"}  # a drive that is no column of the same file
    if any(_option(words, one) is not None for one in elsewhere):
        return None, ""
    drive, response = (_option(words, what) or what for what in ("drive", "response"))
    return {"drive": response, "response": drive}, "if drive and response are exchanged"


def _skip_first(check: "RecordingCheck", words: list[str]) -> _Changes:
    said = _option(words, "skip-periods") or "0"
    short = any(run.excitation_hz is None or run.periods < 2 for run in check.runs)
    if short or not check.unsettled or not said.isdecimal():
        return None, ""
    if _option(words, "skip-seconds") is not None:
        return None, ""
    skipped = int(said)
    which = "first period" if skipped == 0 else f"first {skipped + 1} periods"
    return {"skip-periods": str(skipped + 1)}, (
        f"without the {which} of each run, since {_name(check.unsettled)} had not settled"
    )


def _replace_drive(check: "RecordingCheck", words: list[str]) -> _Changes:
    ways = {way for f in check.faults for way in re.findall(r"`--drive-as (\w+)`", f.message)}
    if len(ways) != 1:
        return None, ""
    (way,) = ways
    return {"drive-as": way}, "with a drive that is free of noise"


def _name(runs: tuple[str, ...]) -> str:
    more = f" and {len(runs) - 3} more" if len(runs) > 3 else ""
    return ", ".join(runs[:3]) + more


def _option(words: list[str], name: str) -> str | None:
    """The value of an option in a line; `None` where it is not there."""
    for place, word in enumerate(words):
        if word == f"--{name}":
            return "".join(words[place + 1 : place + 2])
        if word.startswith(f"--{name}="):
            return word.partition("=")[2]
    return None


def _set_option(words: list[str], name: str, value: str) -> list[str]:
    """The line with that value of an option, in the place of another."""
    kept: list[str] = []
    skip = False
    for word in words:
        if skip or word.startswith(f"--{name}="):
            skip = False
        elif word == f"--{name}":
            skip = True
        else:
            kept.append(word)
    return [*kept, *([f"--{name}={value}"] if value.startswith("-") else [f"--{name}", value])]
