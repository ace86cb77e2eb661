"""The motion after a drive stopped as that of a lag or a resonance: an exponential that may swing.

It tells these from creep, which goes on by as much in each decade of time.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

_LONGEST = 500  # samples; more of them show the law no better
_LENGTHS = np.geomspace(0.02, 1.0, 8)  # of the time constant, in holds
_CYCLES = np.r_[0.0, np.geomspace(0.25, 40.0, 24)]  # in one hold


@dataclasses.dataclass(frozen=True)
class Settling:
    """`a + exp(-t/tau) (b cos(2 pi f t) + c sin(2 pi f t))`: `time_constant_s` is tau, `hz` is f.

    `rms`: what it leaves, in the response's unit.
    """

    time_constant_s: float
    hz: float
    rms: float

    def describe(self) -> str:
        """What follows on "the response moves by 1 um": the law in words."""
        decay = f"within a time constant of {self.time_constant_s:.2g} s"
        swings = 2.0 * np.pi * self.hz * self.time_constant_s > 1.0
        return f"ringing at {self.hz:.3g} Hz {decay}" if swings else f"settling {decay}"


def creep_rms(since: Float[np.ndarray, " samples"], y: Float[np.ndarray, " samples"]) -> float:
    """What the best logarithm of time leaves of `y`, in its unit.

    Creep that began while the drive still moved follows the logarithm of the time since an earlier
    moment; where that was long ago, nearly a straight line.
    """
    earlier = since[:, None] + np.r_[0.0, np.geomspace(since[0], 100.0 * since[-1], 30)]
    law = np.log(earlier)
    law, y = law - law.mean(axis=0), y - y.mean()
    slope = (y @ law) / np.sum(law**2, axis=0)
    return float(np.sqrt(np.mean((y[:, None] - slope * law) ** 2, axis=0)).min())


def fit_settling(
    since: Float[np.ndarray, " samples"], y: Float[np.ndarray, " samples"]
) -> Settling:
    """The law that leaves least of `y`, at the times `since` the hold began (s)."""
    from scipy.optimize import minimize

    every = -(-since.size // _LONGEST)
    t, y = since[::every] - since[0], y[::every]
    length = float(t[-1])

    def left(law: Float[np.ndarray, " 2"]) -> float:
        decay = np.exp(-t / (length * np.exp(np.clip(law[0], -20.0, 20.0))))
        angle = 2.0 * np.pi * law[1] * t / length
        # The sine over its angle is a straight line where nothing swings: critical damping.
        columns = np.stack(
            [np.ones(t.size), decay * np.cos(angle), decay * t * np.sinc(angle / np.pi)], axis=1
        )
        rest = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
        return float(np.sqrt(np.mean(rest**2)))

    coarse = [(np.log(tau), cycles) for tau in _LENGTHS for cycles in _CYCLES]
    begin = np.array(min(coarse, key=lambda law: left(np.array(law))))
    found = minimize(left, begin, method="Nelder-Mead", options={"maxiter": 100})
    tau = length * float(np.exp(np.clip(found.x[0], -20.0, 20.0)))
    return Settling(tau, abs(float(found.x[1])) / length, float(found.fun))
