"""The content of `model.json`: plain numbers, lists and names, key by key."""

import dataclasses
from typing import TYPE_CHECKING, Any

from fitting._json import replace_nonfinite
from fitting._versions import package_versions
from rapi_jax import Recording

if TYPE_CHECKING:
    from ._result import FitResult

SCHEMA = "rapi.model/1"


def model_content(result: "FitResult") -> dict[str, Any]:
    """The result as in `model.json` (schema `rapi.model/1`); not finite becomes `None`."""
    unit = result.recording.response_unit
    return replace_nonfinite(
        {
            "schema": SCHEMA,
            "operator": type(result.ecdl.operator).__name__,
            "effects": [type(effect).__name__ for effect in result.ecdl.effects],
            "plays": result.ecdl.operator.count,
            "order": int(result.ecdl.operator.coefficients.size),
            "parameters": {
                p.name: {
                    "value": p.value,
                    "stderr": p.stderr,
                    "unit": p.unit,
                    "at_bound": p.at_bound,
                    "bounds": [p.low, p.high],
                    "held": p.held,
                }
                for p in result.parameters
            },
            "correlation": {"names": list(result.names), "matrix": result.correlation.tolist()},
            "runs": [run.to_dict() | {"unit": unit, "run": i} for i, run in enumerate(result.runs)],
            "unit": unit,
            "drive_unit": result.recording.drive_unit,
            "response_origin": result.recording.response_origin,
            "loss": result.loss,
            "rmse": result.rmse,
            "rmse_held_out": result.rmse_held_out,
            "held_out": {
                h.scheme: {k: v for k, v in dataclasses.asdict(h).items() if k != "scheme"}
                for h in result.held_out
            },
            "starts": [
                {k: v for k, v in dataclasses.asdict(s).items() if k != "trace"}
                for s in result.starts
            ],
            "effective_samples": result.effective,
            "verdict": {
                "trusted": result.verdict.trusted,
                "reasons": list(result.verdict.reasons),
                "notes": list(result.verdict.notes),
                "unidentifiable": list(result.verdict.unidentifiable),
                "with_gap": result.verdict.with_gap,
            },
            "claim": None
            if result.claim is None
            else dataclasses.asdict(result.claim) | {"unit": unit},
            "faults": [dataclasses.asdict(fault) for fault in result.faults],
            "seconds": result.seconds,
            "versions": package_versions(),
            "recorded_at": _instant(result.recording),
            "temperature_c": result.recording.temperature_c,
            "data_sha256": result.data_sha256 or result.recording.sha256(),
        }
    )


def _instant(recording: Recording) -> str | None:
    """When it was recorded, in UTC as ISO 8601 has it."""
    time = recording.recorded_at
    return None if time is None else time.isoformat().replace("+00:00", "Z")
