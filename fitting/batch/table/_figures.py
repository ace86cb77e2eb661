"""The figures of one result file: what the columns of a table are called, and where they stand."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

Figure = str | float | int | bool | None


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A parameter; NaN for what is not known. `held`: not fitted."""

    value: float
    stderr: float
    unit: str
    held: bool = False
    at_bound: bool = False


@dataclasses.dataclass(frozen=True)
class Row:
    """Estimates and figures of one recording, by name.

    - `correlation`: names and matrix of the estimates' correlation, where the file gives it.
    - `kind`: what was estimated, such as operator and effects; rows of one kind can be compared.
    """

    estimates: Mapping[str, Estimate] = dataclasses.field(default_factory=dict)
    figures: Mapping[str, Figure] = dataclasses.field(default_factory=dict)
    correlation: tuple[list[str], np.ndarray] | None = None
    kind: tuple[str, ...] = ()

    def __or__(self, other: "Row") -> "Row":
        return Row(
            estimates={**self.estimates, **other.estimates},
            figures={**self.figures, **other.figures},
            correlation=self.correlation or other.correlation,
            kind=self.kind + other.kind,
        )


def read_model(content: dict[str, Any]) -> Row:
    """Of `model.json`."""
    verdict, claim = content.get("verdict") or {}, content.get("claim") or {}
    estimates = _estimates(content.get("parameters") or {})
    effects = [str(name) for name in content.get("effects") or []]
    figures: dict[str, Figure] = {
        "trusted": _truth(verdict.get("trusted")),
        "rmse": _number(content.get("rmse")),
        "rmse_held_out": _number(content.get("rmse_held_out")),
        "unit": _text(content.get("unit")),
        "drive_unit": _text(content.get("drive_unit")),
        "operator": _text(content.get("operator")),
        "effects": _joined(effects),
        "at_bound": _joined(name for name, one in estimates.items() if one.at_bound),
        "reasons": _joined(verdict.get("reasons") or []),
        "faults": _joined(_fault(one) for one in content.get("faults") or []),
        "with_gap": _truth(verdict.get("with_gap")),
        "data_sha256": _text(content.get("data_sha256")),
    }
    for name in ("rms", "low", "high", "noise"):
        figures[f"claim_{name}"] = _number(claim.get(name))
    return Row(
        estimates=estimates,
        figures=figures,
        correlation=_correlation(content.get("correlation") or {}),
        kind=("fit", str(content.get("operator")), *effects),
    )


def read_diagnosis(content: dict[str, Any]) -> Row:
    """Of `diagnosis.json`: the effect named, its parameters, and how far the gap closes.

    `rmse` is the gap of the model as it was, `rmse_held_out` that of the model with the effect on
    data left out of the refit; none where nothing was left out, or refitted.
    """
    verdict, gap = content.get("verdict") or {}, content.get("gap") or {}
    shrinkage, model = content.get("shrinkage") or {}, content.get("model") or {}
    if not shrinkage.get("held_out"):
        shrinkage = {}
    name = _text(verdict.get("name"))
    own = [h for h in content.get("hypotheses") or [] if h.get("name") == name]
    hypothesis = own[0] if own else {}
    probability = _number(verdict.get("probability"))
    if probability is None:
        probability = _number(hypothesis.get("probability"))
    found = {
        key if "." in key else f"{name}.{key}": entry
        for key, entry in (hypothesis.get("parameters") or {}).items()
    }
    figures: dict[str, Figure] = {
        "trusted": _truth(model.get("trusted")),
        "rmse": _number(gap.get("total")),
        "rmse_held_out": _number(shrinkage.get("after")),
        "verdict": name,
        "probability": probability,
        "set": _joined(verdict.get("set") or []),
        "unit": _text(content.get("unit")),
        "operator": _text(model.get("operator")),
        "faults": _joined(_fault(one) for one in content.get("faults") or []),
        "data_sha256": _text(content.get("data_sha256")),
    }
    for key in ("noise_floor", "parametric", "structural"):
        figures[f"gap_{key}"] = _number(gap.get(key))
    figures["gap_before"] = _number(shrinkage.get("before"))
    closed = shrinkage.get("closed_fraction") or {}
    for key in ("value", "low", "high"):
        figures["closed_fraction" + ("" if key == "value" else f"_{key}")] = _number(
            closed.get(key)
        )
    return Row(_estimates(found), figures, kind=("diagnose", str(name)))


def read_certificate(content: dict[str, Any]) -> Row:
    """Of `certificate.json`: the worst of its drives."""
    drives = content.get("drives") or []
    expected = content.get("expected") or {}
    certificates = [one.get("certificate") or {} for one in drives]
    nonlinearity = [
        abs(x)
        for one in drives
        for x in map(_number, (one.get("nonlinearity") or {}).values())
        if x is not None
    ]
    figures: dict[str, Figure] = {
        "unit": _text(content.get("unit")),
        "drive_unit": _text(content.get("drive_unit")),
        "drives": len(drives),
        "span": _most(max, (one.get("span") for one in drives)),
        "drive_min": _most(min, (one.get("drive_min") for one in drives)),
        "drive_max": _most(max, (one.get("drive_max") for one in drives)),
        "slew_max": _most(max, (one.get("slew_max") for one in drives)),
        "slope_min": _most(min, (one.get("slope_min") for one in certificates)),
        "invertible": all(one.get("invertible") is True for one in certificates),
        "nonlinearity_max": max(nonlinearity, default=None),
        "expected_high": _number(expected.get("high")),
        "inverse": _joined(dict.fromkeys(str(one.get("inverse")) for one in drives)),
        "notes": _joined(content.get("notes") or []),
        "data_sha256": _text(content.get("data_sha256")),
    }
    return Row(figures=figures, kind=("compensate",))


def read_range(content: dict[str, Any]) -> Row:
    """Of `range.json`: distance in m, velocity in m/s."""
    summary = content.get("summary") or {}
    estimates = {}
    for name, key, unit in (("distance", "stderr", "m"), ("velocity", "velocity_stderr", "m/s")):
        value, stderr = _number(summary.get(name)), _number(summary.get(key))
        if value is not None:
            estimates[name] = Estimate(value, np.nan if stderr is None else stderr, unit)
    figures: dict[str, Figure] = {
        "unit": _text(content.get("unit")),
        "faults": _joined(content.get("faults") or []),
        "scatter": _number(summary.get("scatter")),
        "scans": _count(summary.get("scans")),
        "scans_counted": _count(summary.get("counted")),
        "method": _text(content.get("method")),
        "air_index": _number(content.get("air_index")),
    }
    return Row(estimates, figures, kind=("range",))


def _estimates(entries: Mapping[str, Any]) -> dict[str, Estimate]:
    found = {}
    for name, entry in entries.items():
        value, stderr = _number(entry.get("value")), _number(entry.get("stderr"))
        found[str(name)] = Estimate(
            np.nan if value is None else value,
            np.nan if stderr is None else stderr,
            str(entry.get("unit") or ""),
            held=entry.get("held") is True,
            at_bound=entry.get("at_bound") is True,
        )
    return found


def _correlation(entry: Mapping[str, Any]) -> tuple[list[str], np.ndarray] | None:
    names = [str(name) for name in entry.get("names") or []]
    matrix = np.array(entry.get("matrix") or [], dtype=float)
    good = matrix.shape == (len(names), len(names)) and len(names) > 0
    if not good or not np.isfinite(matrix).all():
        return None
    return names, matrix


def _fault(entry: Any) -> str:
    """A fault's text, whichever of its fields holds it."""
    if isinstance(entry, Mapping):
        texts = (entry.get(key) for key in ("message", "text", "reason", "kind", "name"))
        return next((str(text) for text in texts if text), "")
    return str(entry)


def _joined(items: Iterable[Any]) -> str:
    return "; ".join(str(item) for item in items)


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        return None
    return float(value)


def _count(value: Any) -> int | None:
    return value if type(value) is int else None


def _most(choose: Any, values: Iterable[Any]) -> float | None:
    known = [x for x in map(_number, values) if x is not None]
    return choose(known) if known else None


def _truth(value: Any) -> bool | None:
    return value if isinstance(value, bool) else None


def _text(value: Any) -> str | None:
    return None if value is None else str(value)
