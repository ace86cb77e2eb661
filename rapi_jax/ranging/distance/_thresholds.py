"""Numbers that decide how distance is estimated."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class DistanceThresholds:
    """Numbers that decide how distance is estimated."""

    tail: float = threshold(
        0.005,
        unit="of the power",
        origin="on either side of the measurement arm's band; with `beyond` it holds all of a beat",
    )
    beyond: float = threshold(
        1.6, unit="times", origin="how far filters pass beyond the band that holds the power"
    )
    fewest_fringes: float = threshold(
        4.0, unit="fringes", origin="in a scan; with fewer the two sides of the spectrum overlap"
    )
    detection: float = threshold(
        12.0,
        unit="times the mean noise",
        origin="power of a peak that noise of 30 000 bins exceeds with a probability of 2e-1 "
        "exp(-12) each: 1 in 6",
    )
    lost_light: float = threshold(
        0.25, unit="of the usual", origin="visibility below which fringes count as lost; trial"
    )
    smooth: int = threshold(
        7,
        unit="degree",
        origin="of the polynomial that holds motion and a crooked scan's part of it; what is left "
        "is noise. Its eight terms take 8 of some 10 000 values",
    )
    one_tone: float = threshold(
        0.5,
        unit="of the power",
        origin="in the one tone that the peak stands for; of a chirp of two bins it is 0.6",
    )
    jitter: float = threshold(
        0.15, unit="cycles", origin="rms of counted extrema about a line; twice that miscounts"
    )


THRESHOLDS = DistanceThresholds()
