"""Distances and velocities as people write them."""

import re
from collections.abc import Sequence
from typing import Any

from fitting.report._alike import group_alike, wording
from fitting.report.diagnosis._numbers import (
    SPACE,
    finite_or_none,
    format_number,
    format_quantity,
    format_with_error,
)
from fitting.report.fit._table import round_with_error

_LENGTHS = ((10.0, "m", 1.0), (1e-3, "mm", 1e3), (1e-6, "um", 1e6), (0.0, "nm", 1e9))
BEST_IN_NOISE = "resample-phase"
_ORDINARY_AIR = 2.7e-4  # group index less 1, at 20 deg C and 1013 hPa (Ciddor 1996)
_UNKNOWN = ("air", "cavity")  # lines of no size where nothing tells it, as the note says
_OF_SCAN = re.compile(r"scan at (?P<at>\S+) s: (?P<what>.*)")


def length(value: Any, *, digits: int = 3) -> str:
    """A length in the unit that reads best: 12.1 m, 0.45 mm, 3.2 um."""
    x = finite_or_none(value)
    if x is None:
        return format_quantity(None, "m")
    unit, factor = next((unit, f) for least, unit, f in _LENGTHS if abs(x) >= least)
    return format_quantity(x * factor, unit, digits=digits)


def budget_size(line: dict[str, Any]) -> str:
    """The standard error of a budget's line; no nought where it is not known at all."""
    unknown = line["source"] in _UNKNOWN and line["stderr"] == 0 and line.get("note")
    return "not known" if unknown else length(line["stderr"])


def distance(value: Any, stderr: Any) -> str:
    """A distance with its standard error, in mm below 10 m: 699.9958 ± 0.0023 mm."""
    x, error = finite_or_none(value), finite_or_none(stderr)
    unit, factor = ("m", 1.0) if x is not None and abs(x) >= 10.0 else ("mm", 1e3)
    return format_with_error(_times(x, factor), _times(error, factor), unit)


def speed(value: Any, stderr: Any) -> str:
    """A velocity with its standard error, in mm/s or um/s."""
    x, error = finite_or_none(value), finite_or_none(stderr)
    size = max(abs(x or 0.0), error or 0.0)
    units = ((1e-3, "mm/s", 1e3), (1e-7, "\N{GREEK SMALL LETTER MU}m/s", 1e6), (0.0, "nm/s", 1e9))
    unit, factor = next((unit, f) for least, unit, f in units if size >= least)
    return format_with_error(_times(x, factor), _times(error, factor), unit)


def _times(x: float | None, factor: float) -> float | None:
    return None if x is None else x * factor


def fold(faults: Sequence[str]) -> list[str]:
    """Faults as lines: what is said of several scans in the same words, but for numbers, once."""

    def kind(line: str) -> str:
        found = _OF_SCAN.fullmatch(line)
        return line if found is None else wording(found["what"])

    return [_fold_alike(lines) for lines in group_alike(faults, kind)]


def _fold_alike(lines: list[str]) -> str:
    scans = [found for found in map(_OF_SCAN.fullmatch, lines) if found]
    if len(scans) < 2:
        return lines[0]
    first, others = scans[0], len(scans) - 1
    more = f"another up to {scans[-1]['at']} s" if others == 1 else ""
    more = more or f"{others} others up to {scans[-1]['at']} s"
    return f"scan at {first['at']} s, and alike {more}: {first['what']}"


def facts(content: dict[str, Any]) -> list[tuple[str, str]]:
    """What ranging found, as pairs of a name and a text."""
    summary = content["summary"]
    counted, scans = summary["counted"], summary["scans"]
    of = f"{scans} scans" if counted == scans else f"{counted} of {scans} scans"
    found: list[tuple[str, str]] = []
    if summary["distance"] is None:
        found.append(("distance", "none: no scan could be read"))
    else:
        value = distance(summary["distance"], summary["stderr"])
        found.append(("distance", f"{value} (mean of {of}{_less_in_air(content)})"))
        found += _course(content)
    if summary["scatter"] is not None:
        about = "about the track" if content["track"] else "from scan to scan"
        found.append(("scatter", f"{length(summary['scatter'])} rms {about}"))
    if summary["velocity"] is not None:
        found.append(("velocity", _velocity(content)))
    elif summary["distance"] is not None:
        found.append(("velocity", "not estimated: every scan is taken as of a target at rest"))
    best = ", the least sensitive to noise" if content["method"] == BEST_IN_NOISE else ""
    found.append(("method", f"{content['method']}{best}"))
    found.append(("index of air", _index(content)))
    found.append(("scale", _scale(content["scale"])))
    # A line may break before an error, and never within a number.
    return [(name, text.replace(f"{SPACE}±", " ±")) for name, text in found]


def headline(content: dict[str, Any]) -> str:
    """The distance with its error, and how far air that is not known puts it off."""
    summary = content["summary"]
    if summary["distance"] is None:
        return "No distance: no scan could be read"
    less = _less_in_air(content).removeprefix("; ")
    found = distance(summary["distance"], summary["stderr"])
    return f"{found}; {less}" if less else found


def _less_in_air(content: dict[str, Any]) -> str:
    """How much shorter the distance is in ordinary air, where its state is not given."""
    value = finite_or_none(content["summary"]["distance"])
    if value is None or content["air_index_stderr"] is not None:
        return ""
    return f"; in ordinary air {length(value * _ORDINARY_AIR)} less"


def _course(content: dict[str, Any]) -> list[tuple[str, str]]:
    """From where to where, of a target that moved."""
    track = content["track"]
    if not track:
        return []
    first, last = track[0], track[-1]
    if abs(last["distance"] - first["distance"]) < 10 * content["summary"]["stderr"]:
        return []
    ends = [distance(row["distance"], row["distance_stderr"]) for row in (first, last)]
    seconds = last["time_s"] - first["time_s"]
    return [("course", f"from {ends[0]} to {ends[1]} in {seconds:.3g} s")]


def _velocity(content: dict[str, Any]) -> str:
    summary, track = content["summary"], content["track"]
    text = speed(summary["velocity"], summary["velocity_stderr"])
    if abs(summary["velocity"]) < 2 * summary["velocity_stderr"]:
        text += ", so none is seen"
    values = [row["velocity"] for row in track]
    if max(values) - min(values) > 4 * summary["velocity_stderr"]:
        error = summary["velocity_stderr"]
        text += f"; from {speed(min(values), error)} to {speed(max(values), error)}"
    return text


def _index(content: dict[str, Any]) -> str:
    if content["air_index_stderr"] is None:
        return "taken as 1, for the state of the air is not given"
    index, error = content["air_index"], content["air_index_stderr"]
    return f"{round_with_error(index, error)[0]} ±{SPACE}{format_number(error, 2)} (group)"


def _scale(scale: dict[str, Any]) -> str:
    path = scale["path_m"]
    if scale["told_by"] != "cavity":
        return f"`interferometer_path_m` = {path:.6g} m; no cavity tells it"
    error = path * scale["stderr"] / scale["delay_s"]
    value = f"{round_with_error(path, error)[0]}{SPACE}m ±{SPACE}{length(error, digits=2)}"
    return f"by the cavity: interferometer path {value}"
