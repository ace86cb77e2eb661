"""Hand-written `diagnosis.json` dictionaries, one for each kind of verdict a page must show."""

import copy
import math
from typing import Any

RATES, AMPLITUDES = (10.0, 20.0, 30.0, 40.0), (2.0, 3.0)
HOSTILE = "</script><script>fetch('http://evil.example/')</script><b onclick=x>%{y}&amp;\"'"


def fraction(value: float, low: float, high: float) -> dict[str, float]:
    return {"value": value, "low": low, "high": high}


def wave(phase: float, rate: float, amplitude: float) -> float:
    """A residual like creep's: it decays after each turning point, more so on slow scans."""
    since = phase % 0.5
    sign = 1.0 if phase < 0.5 else -1.0
    return 0.016 * sign * amplitude / 3.0 * (10.0 / rate) ** 0.3 * (math.exp(-9.0 * since) - 0.22)


def residual_profiles(runs: list[dict[str, Any]]) -> dict[str, Any]:
    phase = [(i + 0.5) / 64 for i in range(64)]
    seconds = [2e-4 * 1.35**i for i in range(16)]
    nu = [-37.0 + 2.0 * i for i in range(38)]
    rows = [
        run
        | {
            "mean": [wave(p, run["excitation_hz"], run["amplitude"]) for p in phase],
            "stderr": [0.0007 + 0.0001 * run["run"]] * 64,
        }
        for run in runs
    ]
    rows[0]["mean"][5] = None
    turns = [
        {
            "turn": turn,
            "excitation_hz": rate,
            "mean": [
                wave(at * rate + half, rate, 3.0) if at * rate < 0.5 else None for at in seconds
            ],
        }
        for turn, half in (("low", 0.0), ("high", 0.5))
        for rate in RATES
    ]
    columns = [
        {
            "run": run["run"],
            "direction": way,
            "mean": [
                wave(0.25 + sign * x / 150 + (0.5 if way == "down" else 0), run["excitation_hz"], 3)
                for x in nu
            ],
        }
        for run in runs
        for way, sign in (("up", 1), ("down", -1))
    ]
    harmonics = [
        {
            "run": run["run"],
            "excitation_hz": run["excitation_hz"],
            "harmonic": list(range(1, 17)),
            "amplitude": [0.02 / n**1.4 * (1.0 if n % 2 else 0.25) for n in range(1, 17)],
            "floor": [0.0006] * 16,
            "significant": [
                0.02 / n**1.4 * (1.0 if n % 2 else 0.25) > 0.0012 for n in range(1, 17)
            ],
        }
        for run in runs
    ]
    time = [0.2 * i for i in range(60)]
    return {
        "phase": {"phase": phase, "rows": rows},
        "since_turn": {"seconds": seconds, "rows": turns},
        "frequency": {"nu": nu, "rows": columns},
        "session": {
            "time_s": time,
            "mean": [0.004 * math.exp(-t / 3.0) - 0.001 for t in time],
            "rms": [0.021 + 0.002 * math.sin(t) for t in time],
        },
        "harmonics": {"rows": harmonics},
        "lines": [
            {"hz": 50.0, "amplitude": 0.0031, "p_value": 2.1e-7, "locked": False},
            {"hz": 100.0, "amplitude": 0.0009, "p_value": 0.012, "locked": True},
        ],
    }


def signature() -> dict[str, Any]:
    """A lag's, beside noise that a script can repeat."""
    seconds = [2e-4 * 1.35**i for i in range(16)]
    rows = []
    for turn, sign in (("low", 1.0), ("high", -1.0)):
        for rate in RATES:
            left = [0.0012 * math.sin(7.0 * i + rate) for i in range(16)]
            lag = [sign * 0.03 * math.exp(-120.0 * s) for s in seconds]
            rows.append(
                {
                    "row": f"{turn} turn, {rate:.0f} Hz",
                    "x": seconds,
                    "without": [a + b for a, b in zip(lag, left, strict=True)],
                    "with": left,
                    "stderr": [0.001] * 16,
                }
            )
    rows[0]["without"][2] = None
    return {
        "effect": "creep",
        "axis": "since_turn",
        "unit": "s",
        "period": None,
        "rows": rows,
        "rms_without": 0.0182,
        "rms_with": 0.0009,
    }


def creep() -> dict[str, Any]:
    """Creep found, with every optional key."""
    runs = [
        {"run": i, "name": f"run{i:02d}", "excitation_hz": rate, "amplitude": amplitude}
        for i, (amplitude, rate) in enumerate((a, r) for a in AMPLITUDES for r in RATES)
    ]
    where = [
        run
        | {
            "direction": way,
            "region": region,
            "rms": 0.009 + 0.004 * (region == "edge") + 0.001 * run["run"],
            "share": (0.03 + 0.004 * run["run"]) * (1.4 if region == "edge" else 0.4) / 1.6,
        }
        for run in runs
        for way in ("up", "down")
        for region in ("edge", "middle")
    ]
    closed = fraction(0.943, 0.902, 0.961)
    parts = [
        ("rate 10 Hz", 0.026, 0.0098, fraction(0.95, 0.92, 0.97)),
        ("rate 40 Hz", 0.021, 0.0096, fraction(0.91, 0.84, 0.95)),
        ("swing 3 V", 0.027, 0.0101, fraction(0.93, 0.88, 0.96)),
        ("last periods", 0.023, 0.0095, fraction(0.96, 0.93, 0.98)),
    ]
    small = ["drift", "resonance", "etalon", "delay", "pickup", "gain_drift", "mode_hop"]
    return {
        "schema": "rapi.diagnosis/1",
        "unit": "GHz",
        "recording": {
            "name": "session1",
            "runs": 8,
            "samples": 31000,
            "rates_hz": list(RATES),
            "amplitudes": list(AMPLITUDES),
            "periods": [5] * 8,
            "drive_unit": "V",
        },
        "gap": {
            "total": 0.0247,
            "noise_floor": 0.0092,
            "parametric": 0.0061,
            "structural": 0.0221,
            "locked": 0.0213,
            "not_locked": 0.0058,
            "significant": True,
        },
        "where": where,
        "maps": residual_profiles(runs),
        "signature": [signature()],
        "hypotheses": [
            {"effects": [], "name": "none", "probability": 0.0, "delta_chi2": 0.0, "sentence": ""},
            {
                "effects": ["creep"],
                "name": "creep",
                "probability": 0.971,
                "survival": 0.62,
                "delta_chi2": -18412.0,
                "sentence": "Adding creep removes the slow return after each turning point at "
                "every rate, with one gain for all runs.",
                "parameters": {
                    "gain": {"value": 0.02104, "stderr": 0.00061, "unit": "1/decade"},
                    "rest": {"value": -3.1, "stderr": 1.4, "unit": "GHz"},
                },
                "closed_fraction": closed,
            },
            {
                "effects": ["creep", "drift"],
                "name": "creep+drift",
                "probability": 0.019,
                "survival": 0.31,
                "delta_chi2": -18431.0,
                "parameters": {"gain": {"value": 0.0207, "stderr": 0.0012, "unit": "1/decade"}},
                "closed_fraction": fraction(0.941, 0.897, 0.962),
            },
            *(
                {
                    "effects": [name],
                    "name": name,
                    "probability": 0.0008,
                    "survival": 0.4,
                    "delta_chi2": -120.0,
                    "parameters": {},
                    "closed_fraction": fraction(0.05, -0.02, 0.11),
                }
                for name in small
            ),
            {"effects": [], "name": "unlisted", "probability": 0.0044},
        ],
        "verdict": {
            "name": "creep",
            "effects": ["creep"],
            "set": ["creep"],
            "reason": "creep alone brings the held-out residual to the noise floor; no second "
            "effect adds to that",
            "sentence": "Creep of the piezo causes the gap, with 97 % probability; a model with "
            "creep closes 94 % of it on data it has not seen.",
            "advice": "Use the model with creep, model.rapi, for prediction and compensation.",
            "probability": 0.971,
        },
        "shrinkage": {
            "before": 0.0247,
            "after": 0.0108,
            "floor": 0.0092,
            "closed_fraction": closed,
            "held_out": ["rate 10 Hz", "rate 40 Hz", "swing 3 V", "last periods"],
            "by_part": [
                {"part": part, "before": before, "after": after, "closed_fraction": closed_part}
                for part, before, after, closed_part in parts
            ],
            "remainder": "scan-locked, at the edges of the fastest scan, 3 MHz",
        },
        "next_scan": None,
        "model": {
            "operator": "RAPI",
            "effects": ["Creep"],
            "file": "model.rapi",
            "trusted": True,
            "invertible": True,
        },
        "notes": [
            "Creep slower than the session cannot be told from drift",
            "Two amplitudes only: how creep grows with amplitude rests on them",
        ],
        "calibration": {"bank": "open tier 3", "worlds": 1200, "date": "2026-11-20"},
        "seconds": 41.7,
        "versions": {"rapi-jax": "0.1.0", "jax": "0.10.2", "numpy": "2.4.1"},
        "data_sha256": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    }


def bare(name: str, probabilities: dict[str, float], **more: Any) -> dict[str, Any]:
    """The contract's keys alone: no sentence, no map, no recording."""
    known = {"none", "unlisted"}
    return {
        "schema": "rapi.diagnosis/1",
        "unit": "GHz",
        "gap": {"total": 0.021, "noise_floor": 0.0208, "parametric": 0.002, "structural": 0.001},
        "where": [],
        "hypotheses": [
            {"effects": [] if key in known else key.split("+"), "name": key, "probability": p}
            for key, p in probabilities.items()
        ],
        "verdict": {"name": name, "effects": [], "set": [name], "reason": ""},
        "shrinkage": {
            "before": 0.021,
            "after": 0.021,
            "floor": 0.0208,
            "closed_fraction": None,
            "held_out": ["last period"],
        },
        "next_scan": None,
        "seconds": 12.0,
        "versions": {},
        "data_sha256": "",
    } | more


def none() -> dict[str, Any]:
    """No effect, in the contract's keys alone."""
    return bare("none", {"none": 0.962, "creep": 0.02, "unlisted": 0.018})


def unlisted() -> dict[str, Any]:
    """A gap that nothing on the list explains."""
    found = bare("unlisted", {"none": 0.0, "resonance": 0.04, "unlisted": 0.96})
    found["gap"] = {"total": 0.4, "noise_floor": 0.02, "parametric": 0.05, "structural": 0.39}
    found["shrinkage"] |= {"before": 0.4, "after": 0.31, "floor": 0.02}
    found["shrinkage"]["closed_fraction"] = fraction(0.41, -0.2, 0.6)
    found["shrinkage"]["remainder"] = "a ringing at 310 Hz after each turning point"
    return found


def look_alikes() -> dict[str, Any]:
    """Two effects that these data cannot tell apart, and the scan that can."""
    found = creep()
    found["hypotheses"] = [
        {
            "effects": [name],
            "name": name,
            "probability": p,
            "survival": 0.07,
            "delta_chi2": fall,
            "parameters": {"tau": {"value": 1.04e-4, "stderr": 3e-6, "unit": "s"}},
            "closed_fraction": fraction(0.91, 0.86, 0.94),
        }
        for name, p, fall in (("delay", 0.58, -900.0), ("amplifier_lowpass", 0.39, -899.1))
    ] + [{"effects": [], "name": "none", "probability": 0.03}]
    found["signature"][0]["effect"] = "delay"
    found["verdict"] = {
        "name": "delay",
        "effects": ["delay"],
        "set": ["delay", "amplifier_lowpass"],
        "reason": "",
    }
    found["next_scan"] = {
        "waveform": "triangle",
        "excitation_hz": 100.0,
        "amplitude": 1.0,
        "bias": 3.0,
        "separates": ["delay", "amplifier_lowpass"],
        "reason": "it raises the residual of the wrong one from 37 to 91 MHz",
        "candidates": [
            {
                "waveform": "triangle",
                "excitation_hz": 100.0,
                "amplitude": 1.0,
                "bias": 3.0,
                "power": 4.2,
                "left": 0.03,
            },
            {
                "waveform": "sine",
                "excitation_hz": 80.0,
                "amplitude": 2.0,
                "bias": 3.0,
                "power": 1.1,
                "left": 0.31,
            },
        ],
    }
    return found


def one_period() -> dict[str, Any]:
    """One period a run: no noise floor, no interval, a model that is not trusted."""
    found = creep()
    found["gap"] = {"total": 0.0247, "noise_floor": None, "parametric": 0.006, "structural": None}
    found["gap"] |= {"locked": None, "not_locked": None, "significant": False}
    found["shrinkage"] |= {"floor": None, "closed_fraction": None, "by_part": []}
    found["model"]["trusted"] = False
    for row in found["maps"]["phase"]["rows"]:
        row["stderr"] = [None] * 64
    return found


def displacement() -> dict[str, Any]:
    """A recording in micrometres, driven in micrometres, one run without a rate."""
    found = creep()
    found["unit"], found["recording"]["drive_unit"] = "um", "um"
    for entry in (*found["where"], *found["maps"]["phase"]["rows"]):
        if entry["run"] == 3:
            entry["excitation_hz"] = None
            entry.pop("amplitude")
    return found


def hostile() -> dict[str, Any]:
    """Markup, script and template directives in every string."""

    def spoil(node: Any, key: str = "") -> Any:
        if isinstance(node, dict):
            return {k: spoil(v, k) for k, v in node.items()} | (
                {HOSTILE: "1"} if key == "versions" else {}
            )
        if isinstance(node, list):
            return [spoil(item, key) for item in node]
        return f"{node}{HOSTILE}" if isinstance(node, str) and key != "schema" else node

    return spoil(copy.deepcopy(look_alikes()))


ALL = {
    f.__name__: f for f in (creep, none, unlisted, look_alikes, one_period, displacement, hostile)
}
