"""Numbers that decide how a streaming step is computed."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class StreamingThresholds:
    """Numbers that decide how a streaming step is computed."""

    newton_steps: int = threshold(
        10,
        unit="steps",
        origin="a scan of 1000 samples a period needs 3, and 4 at its turns; targets that jump "
        "anywhere need at most 9 in 720 000 samples of 240 random certified models. A fixed number "
        "since a loop inside the step costs 0.6 us, each of these 0.03",
    )
    rounding: float = threshold(
        2.0,
        unit="of the bound on rounding of one response",
        origin="N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 3: a sum "
        "of n terms is off by at most n eps times their magnitudes",
    )
    least_bits: int = threshold(
        8, unit="bits", origin="with fewer a step of the drive is as wide as a threshold"
    )
    most_bits: int = threshold(
        32, unit="bits", origin="the product of two words must fit an integer of 64 bits"
    )
    given_up_bits: int = threshold(
        2,
        unit="bits",
        origin="of the response, at most, where products would be too long; only the longest words "
        "come to it, whose drive is then still finer than any converter's",
    )


THRESHOLDS = StreamingThresholds()
