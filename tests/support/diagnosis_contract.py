"""`diagnosis.json` as the contract has it: keys and types, and a check of both."""

import json
import math
from typing import Any

import pytest

from fitting.diagnosis._diagnosis import Diagnosis

NUMBER, FRACTION = (float, int), {"value": float, "low": float, "high": float}
GAP = {"total": float, "noise_floor": (float, None), "parametric": float, "structural": float}
WHERE = {
    "run": int,
    "excitation_hz": (float, None),  # None: the drive is not periodic
    "direction": str,
    "region": str,
    "rms": float,
    "share": float,
}
SCAN = {
    "waveform": str,
    "excitation_hz": float,
    "amplitude": float,
    "bias": float,
    "separates": [str],
}
WHOLE = {
    "schema": str,
    "unit": str,
    "gap": GAP,
    "where": [WHERE],
    "hypotheses": [{"effects": [str], "name": str, "probability": float}],
    "verdict": {"name": str, "effects": [str], "set": [str], "reason": str},
    "shrinkage": {
        "before": float,
        "after": float,
        "floor": (float, None),
        "closed_fraction": (FRACTION, None),
        "held_out": [str],
    },
    "next_scan": (SCAN, None),
    "seconds": float,
    "versions": dict,
    "data_sha256": str,
    "notes": [str],
    "faults": [{"kind": str, "run": str, "message": str}],
}
NAMED = {
    "survival": float,
    "parameters": dict,
    "closed_fraction": (FRACTION, None),
}


def fits(value: Any, kind: Any, at: str = "") -> None:
    """Assert that `value` is of `kind`: a type, a dict of kinds, a list of one, or any of some."""
    if isinstance(kind, tuple):
        if value is None:
            assert None in kind, at
            return
        (kind,) = [k for k in kind if k is not None]
    if isinstance(kind, dict):
        assert isinstance(value, dict), at
        assert kind.keys() <= value.keys(), f"{at}: {kind.keys() - value.keys()} missing"
        for key, own in kind.items():
            fits(value[key], own, f"{at}.{key}")
    elif isinstance(kind, list):
        assert isinstance(value, list), at
        for i, one in enumerate(value):
            fits(one, kind[0], f"{at}[{i}]")
    else:
        assert type(value) is kind, f"{at}: {value!r} is no {kind.__name__}"


def closed(fraction: dict[str, float] | None) -> None:
    if fraction is not None:
        assert fraction["low"] <= fraction["value"] <= fraction["high"]
        assert fraction["value"] <= 1.0 + 0.01


def check(diagnosis: Diagnosis) -> dict[str, Any]:
    """What holds of every diagnosis; the dictionary as a strict reader of the file sees it."""
    out = json.loads(json.dumps(diagnosis.to_dict(), allow_nan=False), parse_constant=pytest.fail)
    assert out == diagnosis.to_dict()
    fits(out, WHOLE)
    assert out["schema"] == "rapi.diagnosis/1"
    gap = out["gap"]
    parts = gap["parametric"] ** 2 + gap["structural"] ** 2 + (gap["noise_floor"] or 0.0) ** 2
    assert gap["total"] ** 2 == pytest.approx(parts, rel=1e-9)
    hypotheses, verdict = out["hypotheses"], out["verdict"]
    chance = [h["probability"] for h in hypotheses]
    assert math.fsum(chance) == pytest.approx(1.0, abs=1e-9)
    assert all(0.0 <= p <= 1.0 for p in chance) and chance == sorted(chance, reverse=True)
    names = [h["name"] for h in hypotheses]
    assert len(set(names)) == len(names) and {"none", "unlisted"} <= set(names)
    for h in hypotheses:
        assert h["effects"] == sorted(h["effects"])
        assert h["name"] == ("+".join(h["effects"]) or h["name"])
        if h["effects"]:
            fits(h, NAMED, h["name"])
            for name, p in h["parameters"].items():
                fits(p, {"value": float, "stderr": (float, None), "unit": str}, name)
            for d in h["derived"]:
                fits(
                    d,
                    {"name": str, "value": float, "stderr": (float, None), "unit": str},
                    "derived",
                )
            assert 0.0 <= h["survival"] <= 1.0 + 1e-9
            closed(h["closed_fraction"])
    assert verdict["name"] == names[0] and verdict["effects"] == hypotheses[0]["effects"]
    # Smallest: the likeliest, with the last of them just enough.
    count = len(verdict["set"])
    assert verdict["set"] == names[:count]
    assert math.fsum(chance[:count]) >= 0.95 > math.fsum(chance[: count - 1])
    closed(out["shrinkage"]["closed_fraction"])
    shares = [entry["share"] for entry in out["where"]]
    assert shares == sorted(shares, reverse=True)
    assert {e["direction"] for e in out["where"]} <= {"up", "down"}
    assert {e["region"] for e in out["where"]} <= {"edge", "middle"}
    assert out["data_sha256"] == diagnosis.recording.sha256()
    return out
