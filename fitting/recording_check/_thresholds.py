"""Numbers that decide what a recording is said to allow, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class RecordingCheckThresholds:
    """Numbers that decide about what may be asked of a recording."""

    enough_periods: int = threshold(
        3, unit="periods", origin="two repeat; three also tell a first period from rest and a drift"
    )
    drive_noise_share: float = threshold(
        0.5,
        unit="of the response's noise",
        origin="what a fit leaves is then 12 % larger (root of 1.25); 0.25: 3 %, which no one "
        "would mend, 1: 41 %",
    )
    rates_apart: float = threshold(
        0.01,
        unit="of the rate",
        origin="convention: 0.9987 and 0.9988 Hz, each read off the length of a record, are one; "
        "halved and doubled, nothing changes but for rates so near",
    )
    swings_apart: float = threshold(
        1.2, unit="factor", origin="as for scan rates; swings within it do not show their law"
    )
    commanded: float = threshold(
        0.01,
        unit="of the span, rms",
        origin="as `commanded` of an import: a response of the paper's device departs from a "
        "triangle by 4 %; 0.005: noise of 0.5 % hides a swap, 0.02: nearly straight devices too",
    )
    follows_level: float = threshold(
        0.01,
        unit="recordings",
        origin="convention: of wrong columns one in 100 is taken for a response; halved and "
        "doubled, so is that share, while a good recording lies below by orders of magnitude",
    )
    follows_harmonics: int = threshold(
        8,
        unit="harmonics of the scan rate",
        origin="a response to a triangle or sine is in the first; 4: a folded one may be missed, "
        "16: each counts for less",
    )
    follows_bins: int = threshold(
        64, unit="bins a period", origin="eight to the highest harmonic; halved, it is four"
    )
    follows_beside: int = threshold(
        8,
        unit="frequencies on either side of a harmonic",
        origin="spectrum taken to be level over so many; 4: less power, 16: a spectrum may slope",
    )
    follows_trend: int = threshold(
        3,
        unit="order of a polynomial in time",
        origin="a slow drift repeats in each period; 1: a bent one does, 6: it takes periods along",
    )
    follows_share: float = threshold(
        0.9,
        unit="of the power that is not a trend",
        origin="derivation: half of white noise repeats in two periods by chance, and a third in "
        "three; 0.8: two periods of slow noise pass, 0.95: two of a response that drifts do not",
    )
    follows_parts: int = threshold(
        16, unit="parts of a run", origin="Student's t has 15 degrees of freedom"
    )
    follows_explained: float = threshold(
        0.2,
        unit="of the variance",
        origin="set by trial: slow columns that have nothing in common stay below it mostly, and "
        "each response of a device is above 0.9",
    )


THRESHOLDS = RecordingCheckThresholds()
