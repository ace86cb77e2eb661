"""How often two reflectors are told apart, by simulation."""

import numpy as np
from jaxtyping import Float

from ._reflectors import find_reflectors


def resolving_probability(
    separations: Float[np.ndarray, " separations"],
    *,
    signal_to_noise: float,
    ratio: float = 1.0,
    samples: int = 256,
    replicates: int = 100,
    false_alarm: float = 0.01,
    seed: int = 0,
) -> Float[np.ndarray, " separations"]:
    """Share of records in which two reflectors are found where they are.

    Of records with random delays and phases, those count in which exactly two reflectors are found,
    each within half the separation of its true delay.

    **Arguments:**

    - `separations`: in units of c/2dnu, the resolution of the span.
    - `signal_to_noise`: amplitude of the stronger reflector over the noise rms of one sample.
    - `ratio`: amplitude of the weaker one over that of the stronger.
    """
    rng = np.random.default_rng(seed)
    place = (np.arange(samples) - (samples - 1) / 2.0) / samples
    shares = []
    for separation in np.asarray(separations, dtype=float):
        apart = 0
        for _ in range(replicates):
            bins = rng.uniform(samples / 8, samples / 4) + separation * np.array([0.0, 1.0])
            phase = rng.uniform(0.0, 2.0 * np.pi, 2)
            waves = np.cos(2.0 * np.pi * bins * place[:, None] + phase)
            x = waves @ np.array([1.0, ratio]) + rng.standard_normal(samples) / signal_to_noise
            found = find_reflectors(x, 1.0 / samples, false_alarm=false_alarm)
            near = found.count == 2 and np.abs(found.delay_s - bins).max() < separation / 2.0
            apart += bool(near)
        shares.append(apart / replicates)
    return np.array(shares)
