"""How often a track's 95 % intervals hold the truth, over simulated targets."""

import moving_targets as targets
import numpy as np

from rapi_jax.ranging.tracking import Observations, track


def shares(motion: str, velocity: float, replicates: int) -> tuple[float, float]:
    """Shares of 95 % intervals of distance and of velocity that hold the truth."""
    rng = np.random.default_rng(int(1e4 * velocity) + len(motion))
    t, gain = targets.middles(80)
    distances, velocities = [], []
    for _ in range(replicates):
        if motion == "constant":
            truth = targets.constant(t, velocity)
        elif motion == "vibrating":
            truth = targets.vibrating(t, rng)
        else:
            truth = targets.stage(
                t, velocity, begin=rng.uniform(1.2, 1.4), end=rng.uniform(2.6, 2.8)
            )
        seen = Observations(t, targets.apparent(rng, gain, *truth), np.full(80, 1e-5), gain)
        found = track(seen, expected_m=(0.5, 1.0))
        distances.append(np.mean(np.abs(found.distance - truth[0]) < 1.96 * found.distance_stderr))
        velocities.append(np.mean(np.abs(found.velocity - truth[1]) < 1.96 * found.velocity_stderr))
    return float(np.mean(distances)), float(np.mean(velocities))
