"""Headline numbers, cautions and provenance of a diagnosis."""

from typing import Any

from . import _text as words
from ._numbers import (
    SPACE,
    Scale,
    finite_or_none,
    format_interval,
    format_percent,
    format_setting,
    unit_text,
)

_THIN = "\N{NARROW NO-BREAK SPACE}"


def list_facts(diagnosis: dict, scale: Scale, labels: words.Labels) -> list[tuple[str, str]]:
    """The headline numbers: probability, residual, closed fraction, noise floor."""
    gap, shrinkage = diagnosis.get("gap") or {}, diagnosis.get("shrinkage") or {}
    among = words.credible_names(diagnosis["verdict"])
    lines = [("Probability", format_percent(words.verdict_probability(diagnosis)))]
    if len(among) > 1:
        lines.append(
            ("95 % credible set", words.capitalise(words.list_alternatives(among, labels)))
        )
    before, after = finite_or_none(shrinkage.get("before")), finite_or_none(shrinkage.get("after"))
    if not shrinkage.get("held_out"):
        before = after = None  # no more is known than the gap as recorded
    richer = (diagnosis.get("base") or {}).get("richer")
    if before is not None and among[0] == "unlisted":
        lines.append(("Residual", f"{scale(before)} rms, on held-out data"))
    elif before is not None and after is not None:
        lines.append(("Residual", f"{scale.bare(before)} → {scale(after)} rms, on held-out data"))
    elif isinstance(richer, dict) and finite_or_none(gap.get("total")) is not None:
        lines.append(("Residual", f"{scale.bare(gap['total'])} → {scale(richer.get('rms'))} rms"))
    elif finite_or_none(gap.get("total")) is not None:
        lines.append(("Residual", f"{scale(gap['total'])} rms"))
    floor = finite_or_none(shrinkage.get("floor", gap.get("noise_floor")))
    lines.append(("Gap closed", describe_closed(diagnosis, floor)))
    if nonlinearity := words.describe_nonlinearity(diagnosis, scale):
        lines.append(("Nonlinearity after compensation", nonlinearity))
    lines.append(("Noise floor", "not known" if floor is None else f"{scale(floor)} rms"))
    return lines


def describe_closed(diagnosis: dict, floor: float | None) -> str:
    """The closed fraction of the gap, or why there is none."""
    closed = (diagnosis.get("shrinkage") or {}).get("closed_fraction")
    named = words.credible_names(diagnosis["verdict"])[0]
    known = isinstance(closed, dict)
    if not diagnosis["verdict"].get("judged", True):
        return "not judged"
    if named == "unlisted":
        closed = closed if known else _closed_by_likeliest(diagnosis)
        some = isinstance(closed, dict) and (finite_or_none(closed.get("value")) or 0.0) > 0.0
        if some:
            return f"{format_interval(closed)} by the likeliest known effect, which is not added"
        return "not by any known effect"
    if known:
        return format_interval(closed)
    richer = (diagnosis.get("base") or {}).get("richer")
    if named == "none" and isinstance(richer, dict):
        return "by no effect: it is hysteresis of another shape"
    # Without a floor nobody can say whether there was a gap.
    if floor is None:
        return "not known"
    held_out = (diagnosis.get("shrinkage") or {}).get("held_out")
    if named != "none" and held_out:
        return "not seen on held-out data, predicted to noise without it"
    return "no gap above the noise"


def _closed_by_likeliest(diagnosis: dict) -> Any:
    """The closed fraction of the likeliest hypothesis in the credible set that has an effect."""
    among = words.credible_names(diagnosis["verdict"])
    rated = [h for h in diagnosis.get("hypotheses") or [] if h.get("effects")]
    likely = [h for h in rated if h.get("name") in among]
    first = max(likely, key=lambda h: finite_or_none(h.get("probability")) or 0.0, default={})
    return first.get("closed_fraction")


def list_cautions(diagnosis: dict) -> list[str]:
    """Reasons to doubt the verdict: an untrusted model, an unknown floor, no significant gap."""
    found = []
    gap = diagnosis.get("gap") or {}
    if (diagnosis.get("model") or {}).get("trusted") is False:
        found.append("The fit of the model is not to be trusted, and neither is this diagnosis.")
    if gap and finite_or_none(gap.get("noise_floor")) is None:
        found.append(
            "The noise floor is not known: without repeated periods, noise cannot be told from "
            "model error."
        )
    elif gap.get("significant") is False and diagnosis["verdict"].get("name") != "none":
        found.append("The gap is not significantly larger than the noise.")
    return found


def write_subtitle(diagnosis: dict, drive_unit: str) -> str:
    """What was diagnosed, in one line; empty where the file does not say."""
    recording = diagnosis.get("recording") or {}
    runs = finite_or_none(recording.get("runs"))
    parts = [
        str(recording.get("name") or ""),
        "" if runs is None else f"{runs:.0f}{SPACE}run{'' if runs == 1 else 's'}",
        _format_settings(recording.get("rates_hz"), "Hz"),
        _format_settings(recording.get("amplitudes"), drive_unit),
    ]
    return " · ".join(filter(None, parts))


def list_provenance(diagnosis: dict, drive_unit: str) -> list[tuple[str, str]]:
    """What was diagnosed, with what, and how the probabilities were calibrated."""
    recording, model = diagnosis.get("recording") or {}, diagnosis.get("model") or {}
    versions = diagnosis.get("versions") or {}
    lines = [
        ("Recording", str(recording.get("name") or "")),
        ("Runs", _format_count(recording.get("runs"))),
        ("Samples", _describe_samples(recording)),
        ("Scan rates", _format_settings(recording.get("rates_hz"), "Hz")),
        ("Swings, peak to peak", _format_settings(recording.get("amplitudes"), drive_unit)),
        ("Periods a run", _format_range(recording.get("periods"))),
        ("Model", _describe_model(model)),
        ("Model file", str(model.get("file") or "")),
        ("Calibration", describe_calibration(diagnosis)),
        (
            "Time taken",
            format_setting(diagnosis.get("seconds"), "s") if diagnosis.get("seconds") else "",
        ),
        ("Versions", ", ".join(f"{name} {number}" for name, number in versions.items() if number)),
        ("Format", str(diagnosis.get("schema") or "")),
        ("Data, SHA-256", str(diagnosis.get("data_sha256") or "")),
    ]
    return [(name, text) for name, text in lines if text]


def describe_calibration(diagnosis: dict) -> str:
    """The simulated devices that calibrate the probabilities; empty where none is named."""
    found = diagnosis.get("calibration") or {}
    worlds = _format_count(found.get("worlds"))
    parts = [str(found.get("bank") or ""), f"{worlds} devices" if worlds else ""]
    said = ", ".join(filter(None, [*parts, str(found.get("date") or "")]))
    sets = str(found.get("sets") or "")
    return f"{said}; the sets on {sets}" if said and sets else said


def _describe_model(model: dict) -> str:
    effects = words.join_items([str(name) for name in model.get("effects") or []])
    parts = [" with ".join(filter(None, [str(model.get("operator") or ""), effects]))]
    for key, yes, no in (
        ("trusted", "trusted", "not to be trusted"),
        ("invertible", "can be inverted", "cannot be inverted"),
    ):
        if key in model and isinstance(model[key], bool):
            parts.append(yes if model[key] else no)
    return ", ".join(filter(None, parts))


def _describe_samples(recording: dict) -> str:
    """The samples that were diagnosed, and of how many where they were thinned."""
    used, recorded = (_format_count(recording.get(key)) for key in ("samples", "samples_recorded"))
    return f"{used}, thinned from {recorded}" if recorded and recorded != used else used


def _format_count(value: Any) -> str:
    x = finite_or_none(value)
    return "" if x is None else f"{x:,.0f}".replace(",", _THIN)


def _format_settings(values: Any, unit: str) -> str:
    known = [format_setting(v, "") for v in values or [] if finite_or_none(v) is not None]
    return f"{', '.join(known)}{SPACE}{unit_text(unit)}".strip() if known else ""


def _format_range(counts: Any) -> str:
    known = sorted(c for c in counts or [] if finite_or_none(c) is not None)
    if not known:
        return ""
    low, high = f"{known[0]:g}", f"{known[-1]:g}"
    return low if low == high else f"{low} to {high}"
