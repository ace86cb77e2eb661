"""One sentence on where most of the gap lies."""

from itertools import product
from typing import Any

import numpy as np

from ._thresholds import THRESHOLDS


def describe_localisation(
    entries: list[dict[str, Any]],
    profiles: dict[str, Any] | None = None,
    *,
    repeats: bool = True,
    what: str = "the gap",
    drive_unit: str = "",
) -> str:
    """The sentence of a report; `entries`: see `localise`, `profiles`: see `residual_profiles`.

    Names the part (region, direction, rate, amplitude) of the largest information, `s log(s / d)`
    for a share `s` of the gap in a share `d` of the readings, and nothing where none stands out. A
    tone that does not follow the scan is named too. `repeats`: whether some run holds two periods,
    so that what repeats is known. `what`: the name of what is placed; `drive_unit`: of amplitudes.
    """
    if not any(entry["share"] > 0 for entry in entries):
        if repeats:
            return "No part of the residual exceeds the noise."
        return (
            "Nothing repeats, so the noise is not known: no part of the residual surely exceeds it."
        )
    kind = _describe_kind(entries) if repeats else ""
    tone = _describe_tones(profiles)
    share, data, words = _best_part(entries, drive_unit)
    if share - data < THRESHOLDS.least_excess_share:
        text = f"{what[:1].upper()}{what[1:]} is spread evenly over runs, directions and phases"
    else:
        inside = f"{100 * data:.2g} % of the samples"
        text = f"{100 * share:.0f} % of {what} lies in {inside}: {words}"
    return text + kind + tone + "."


def _describe_kind(entries: list[dict[str, Any]]) -> str:
    squares = [(e["share"], e["rms"] ** 2, e["rms_not_locked"] ** 2) for e in entries]
    synchronous = sum(share * x / max(x + y, 1e-300) for share, x, y in squares)
    nonsynchronous = sum(share * y / max(x + y, 1e-300) for share, x, y in squares)
    if nonsynchronous > THRESHOLDS.dominance * synchronous:
        return "; most of it does not repeat with the scan"
    mostly = synchronous > THRESHOLDS.dominance * nonsynchronous
    return "; most of it repeats with the scan" if mostly else ""


def _describe_tones(profiles: dict[str, Any] | None) -> str:
    tones = [line for line in profiles["lines"] if not line["locked"]] if profiles else []
    if not tones:
        return ""
    hertz = " and ".join(f"{line['hz']:.4g} Hz" for line in tones[:2])
    verb = "stand" if len(tones) > 1 else "stands"
    return f", and {hertz} {verb} out independently of the scan"


def _best_part(entries: list[dict[str, Any]], drive_unit: str) -> tuple[float, float, str]:
    rates = _distinct([e["excitation_hz"] for e in entries if e["excitation_hz"] is not None], 1e-6)
    same = THRESHOLDS.same_amplitude
    sizes = _distinct([e["amplitude"] for e in entries], same)
    some_rates = [None, *(rates if len(rates) > 1 else [])]
    some_sizes = [None, *(sizes if len(sizes) > 1 else [])]
    best, found = 0.0, (0.0, 0.0, "")
    for part in product(("edge", "middle", None), ("up", "down", None), some_rates, some_sizes):
        inside = [e for e in entries if _inside(e, *part)]
        share = sum(e["share"] for e in inside)
        data = sum(e["of_readings"] for e in inside)
        if share < THRESHOLDS.least_named_share:
            continue
        score = share * np.log(share / data) - THRESHOLDS.word_information * sum(
            x is not None for x in part
        )
        if score > best:
            best, found = score, (share, data, _describe_part(*part, drive_unit))
    return found


def _inside(
    e: dict[str, Any],
    region: str | None,
    direction: str | None,
    rate: float | None,
    size: float | None,
) -> bool:
    return (
        region in (None, e["region"])
        and direction in (None, e["direction"])
        and (rate is None or e["excitation_hz"] == rate)
        and (size is None or abs(e["amplitude"] - size) <= THRESHOLDS.same_amplitude * size)
    )


def _distinct(values: list[float], tolerance: float) -> list[float]:
    out: list[float] = []
    for value in sorted(values):
        if not out or value > out[-1] * (1.0 + tolerance):
            out.append(value)
    return out


def _describe_part(
    region: str | None,
    direction: str | None,
    rate: float | None,
    size: float | None,
    drive_unit: str,
) -> str:
    near = {
        None: "",
        "edge": "within 10 % of a turning point",
        "middle": "away from the turning points",
    }
    branch = {None: "", "up": "on rising branches", "down": "on falling branches"}
    parts = [near[region], branch[direction]]
    parts.append("" if rate is None else f"at {rate:.4g} Hz")
    parts.append("" if size is None else f"with a swing of {size:.3g} {drive_unit}".rstrip())
    return " ".join(part for part in parts if part)
