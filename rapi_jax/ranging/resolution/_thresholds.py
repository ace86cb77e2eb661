"""Numbers that decide how many reflectors are found."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class ResolutionThresholds:
    """Numbers that decide how many reflectors are found."""

    padding: int = threshold(
        4, unit="lengths", origin="of the Fourier transform; its peak is within 1/8 bin of a delay"
    )
    split: tuple[float, ...] = threshold(
        (0.5, 1.2),
        unit="c/2dnu",
        origin="separations at which one reflector is tried as two; about those hard to see",
    )
    nearest: float = threshold(
        1.0,
        unit="c/2dnu",
        origin="of a reflector from zero delay, where background takes its place",
    )
    steps: int = threshold(
        12, unit="steps", origin="of Gauss and Newton with damping; most fits take 4"
    )
    tolerance: float = threshold(
        1e-7, unit="relative", origin="fall of the cost that ends a fit; far below a noise variance"
    )


THRESHOLDS = ResolutionThresholds()
