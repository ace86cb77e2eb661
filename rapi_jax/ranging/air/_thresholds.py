"""How far the formulas for the index of air are to be trusted."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class AirThresholds:
    """Standard errors of the formulas themselves, and the wavelengths they hold for."""

    ciddor_stderr: float = threshold(
        1e-8,
        unit="1",
        origin="of the phase index; Ciddor (1996) estimates 2e-8 for 95 % in laboratory air",
    )
    edlen_stderr: float = threshold(
        1.5e-8,
        unit="1",
        origin="of the phase index; Birch and Downs (1993) estimate 3e-8 for 95 %",
    )
    group_factor: float = threshold(
        2.0,
        unit="phase index errors",
        origin="the dispersion adds its own: Ciddor and Hill (1999) estimate up to twice the error",
    )
    shortest_m: float = threshold(
        300e-9, unit="m", origin="range of the dispersion formulas (Ciddor 1996, Section 2)"
    )
    longest_m: float = threshold(
        1700e-9, unit="m", origin="range of the dispersion formulas (Ciddor 1996, Section 2)"
    )


THRESHOLDS = AirThresholds()
