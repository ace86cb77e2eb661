"""Numbers that decide whether a record is accepted, and how long one is waited for."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class DigitizerThresholds:
    """Numbers that decide whether a record is accepted, and how long one is waited for."""

    rate_tolerance: float = threshold(1e-9, unit="of the rate", origin="rounding of floats")
    oscilloscope_reply_s: float = threshold(
        10.0, unit="s", origin="an oscilloscope answers slowly while it works on a long record"
    )
    poll_s: float = threshold(
        0.01, unit="s", origin="between two queries whether a record is there; set by trial"
    )
    trigger_level_v: float = threshold(
        1.5,
        unit="V",
        origin="the generator's trigger output has TTL levels; between low and high",
    )
    bytes_per_s: float = threshold(
        2e5, unit="bytes/s", origin="a slow line: what a record may take beyond the usual time"
    )
    most_samples: int = threshold(
        1 << 23,
        unit="samples",
        origin="a description of a record with more is refused; set by trial",
    )
    setting_tolerance: float = threshold(
        0.01,
        unit="of a setting",
        origin="what an instrument may round a setting by; set by trial",
    )
    setting_floor: float = threshold(
        1e-6,
        unit="V or s",
        origin="a setting below this is compared as if it were this large; set by trial",
    )
    span_reserve: float = threshold(
        1.02,
        unit="times the span",
        origin="recorded at least, for what the time base rounds; set by trial",
    )
    before_reserve: float = threshold(
        1.01, unit="times the time before the trigger", origin="its share of `span_reserve`"
    )
    column_bytes: int = threshold(
        1 << 30, unit="bytes", origin="largest column read from a file; set by trial"
    )
    head_bytes: int = threshold(
        1 << 16, unit="bytes", origin="largest description read from a file; set by trial"
    )


THRESHOLDS = DigitizerThresholds()
