"""The first screen of a diagnosis, and where it comes from."""

from typing import Any

from . import _text as words
from ._numbers import SPACE, Scale, finite, interval, percent, setting, unit_text

_THIN = "\N{NARROW NO-BREAK SPACE}"


def facts(diagnosis: dict, scale: Scale, labels: words.Labels) -> list[tuple[str, str]]:
    """The few numbers of the first screen."""
    gap, shrinkage = diagnosis.get("gap") or {}, diagnosis.get("shrinkage") or {}
    among = words.names(diagnosis["verdict"])
    lines = [("Verdict", words.title(words.describe_hypothesis(among[0], labels)))]
    lines.append(("Probability", percent(words.probability(diagnosis))))
    if len(among) > 1:
        lines.append(("95 % set", words.title(words.either(among, labels))))
    before, after = finite(shrinkage.get("before")), finite(shrinkage.get("after"))
    if before is not None and after is not None:
        lines.append(("Residual", f"{scale.bare(before)} → {scale(after)} rms, on data left out"))
    elif finite(gap.get("total")) is not None:
        lines.append(("Residual", f"{scale(gap['total'])} rms"))
    floor = finite(shrinkage.get("floor", gap.get("noise_floor")))
    # Without a floor nobody can say whether there was a gap.
    none = "not known" if floor is None else "no gap to close"
    closed = shrinkage.get("closed_fraction")
    lines.append(("Gap closed", interval(closed) if closed else none))
    if straighter := words.straighter(diagnosis):
        lines.append(("Scan straighter", f"{straighter}, once compensated with the effect"))
    lines.append(("Noise floor", "not known" if floor is None else f"{scale(floor)} rms"))
    return lines


def cautions(diagnosis: dict) -> list[str]:
    """What must be known before the verdict is acted upon."""
    said = []
    gap = diagnosis.get("gap") or {}
    if (diagnosis.get("model") or {}).get("trusted") is False:
        said.append("The fit of the model is not to be trusted, and so neither is this diagnosis.")
    if gap and finite(gap.get("noise_floor")) is None:
        said.append(
            "The noise floor is not known: without periods that repeat, noise cannot be told "
            "from model error."
        )
    elif gap.get("significant") is False and diagnosis["verdict"].get("name") != "none":
        said.append("The gap is not significantly larger than the noise.")
    return said


def subtitle(diagnosis: dict, drive_unit: str) -> str:
    """What was diagnosed, in one line; empty where the file does not say."""
    recording = diagnosis.get("recording") or {}
    runs = finite(recording.get("runs"))
    parts = [
        str(recording.get("name") or ""),
        "" if runs is None else f"{runs:.0f}{SPACE}run{'' if runs == 1 else 's'}",
        _settings(recording.get("rates_hz"), "Hz"),
        _settings(recording.get("amplitudes"), drive_unit),
    ]
    return " · ".join(filter(None, parts))


def provenance(diagnosis: dict, drive_unit: str) -> list[tuple[str, str]]:
    """What was diagnosed, with what, and how the probabilities were calibrated."""
    recording, model = diagnosis.get("recording") or {}, diagnosis.get("model") or {}
    versions = diagnosis.get("versions") or {}
    lines = [
        ("Recording", str(recording.get("name") or "")),
        ("Runs", _count(recording.get("runs"))),
        ("Samples", _count(recording.get("samples"))),
        ("Scan rates", _settings(recording.get("rates_hz"), "Hz")),
        ("Amplitudes", _settings(recording.get("amplitudes"), drive_unit)),
        ("Periods a run", _range(recording.get("periods"))),
        ("Model", _model(model)),
        ("Model file", str(model.get("file") or "")),
        ("Calibration", calibration(diagnosis)),
        ("Time taken", setting(diagnosis.get("seconds"), "s") if diagnosis.get("seconds") else ""),
        ("Versions", ", ".join(f"{name} {number}" for name, number in versions.items() if number)),
        ("Format", str(diagnosis.get("schema") or "")),
        ("Data, SHA-256", str(diagnosis.get("data_sha256") or "")),
    ]
    return [(name, text) for name, text in lines if text]


def calibration(diagnosis: dict) -> str:
    """The bank of worlds behind the probabilities; empty where the file names none."""
    found = diagnosis.get("calibration") or {}
    worlds = _count(found.get("worlds"))
    parts = [str(found.get("bank") or ""), f"{worlds} devices" if worlds else ""]
    return ", ".join(filter(None, [*parts, str(found.get("date") or "")]))


def _model(model: dict) -> str:
    effects = words.listed([str(name) for name in model.get("effects") or []])
    parts = [" with ".join(filter(None, [str(model.get("operator") or ""), effects]))]
    for key, yes, no in (
        ("trusted", "trusted", "not to be trusted"),
        ("invertible", "can be inverted", "cannot be inverted"),
    ):
        if key in model and isinstance(model[key], bool):
            parts.append(yes if model[key] else no)
    return ", ".join(filter(None, parts))


def _count(value: Any) -> str:
    x = finite(value)
    return "" if x is None else f"{x:,.0f}".replace(",", _THIN)


def _settings(values: Any, unit: str) -> str:
    known = [setting(v, "") for v in values or [] if finite(v) is not None]
    return f"{', '.join(known)}{SPACE}{unit_text(unit)}".strip() if known else ""


def _range(counts: Any) -> str:
    known = sorted(c for c in counts or [] if finite(c) is not None)
    if not known:
        return ""
    low, high = f"{known[0]:g}", f"{known[-1]:g}"
    return low if low == high else f"{low} to {high}"
