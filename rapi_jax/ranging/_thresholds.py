"""Numbers that decide what is said of a ranging result."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class RangingThresholds:
    """Numbers that decide what is said of a ranging result."""

    path_off: float = threshold(
        0.005,
        unit="1",
        origin="a fibre is known to some mm of 5 m; a wrong index or length is 1 % or more",
    )
    other_reflector: float = threshold(
        0.045,
        unit="of the strongest amplitude",
        origin="5 % less what a spectrum of four values a bin may miss (2 %) and noise",
    )
    one_sided: float = threshold(
        2.0,
        unit="of the power",
        origin="beside its mirror image about the peak: lines of vibration are alike",
    )
    wide_peak: float = threshold(
        0.06,
        unit="of the power",
        origin="a bin and a half from the peak; a Hann window has 0.03 there, a moving target more",
    )
    scans_for_reflectors: int = threshold(
        16, unit="scans", origin="whose spectra are averaged: noise is then known to 25 %"
    )
    fewest_for_scatter: int = threshold(
        7,
        unit="scans",
        origin="of one direction: four third differences, whose median is good to a factor of two",
    )
    sides_apart: float = threshold(
        8.0,
        unit="standard errors",
        origin="between up- and down-scans; of two scans each, t of two degrees of freedom is "
        "above that by chance in 1.5 %",
    )
    fewest_scans: int = threshold(
        4, unit="scans", origin="two of each direction: two unknowns, and two to judge them by"
    )


THRESHOLDS = RangingThresholds()
