"""The drive on which an operator alone has to be evaluated to answer a run, and the way back.

An operator without effects sees no clock: of a drive that repeats exactly one period is enough,
from its minimum, where Eq. 13 is the periodic state. Turning points between samples are added.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from rapi_jax.recording._drive import Drive

from ._reconstruction import nodes_between_samples, periodic_nodes_between_samples
from ._thresholds import THRESHOLDS

_ALIGNMENT = 64  # bytes; JAX takes such an array as it is, without a copy


class OperatorNodes(NamedTuple):
    """Drives at which the operator is evaluated in order, and which of them are samples.

    - `u`: the drives, padded with the last. `size`: how many there are.
    - `first`: sample of the period with which they begin; 0 where nothing repeats.
    - `between`: of the unpadded ones in the order of samples, those that lie between samples.
    - `lead`: those before the run. `samples`: of the run.
    """

    u: Float[np.ndarray, " nodes"]
    size: int
    first: int
    between: Int[np.ndarray, " corners"]
    lead: int
    samples: int

    @classmethod
    def of(cls, drive: Drive) -> "OperatorNodes":
        """The nodes of a drive."""
        count = drive.whole_period
        if count:
            value = drive.value[:count]
            at, height = periodic_nodes_between_samples(value, finer=False)
            lead = 0
        else:
            before = drive.lead_in()
            value = np.concatenate([before, drive.value]) if before.size else drive.value
            at, height = nodes_between_samples(value, drive.samples_a_period, finer=False)
            lead = before.size
        spot = np.ceil(at).astype(int)
        between = spot + np.arange(spot.size)
        if spot.size:
            value = np.insert(value, spot, height)
        first = int(np.argmin(value)) if count else 0
        size = value.size
        u = aligned(size + -size % THRESHOLDS.row_multiple)
        u[: size - first] = value[first:]
        u[size - first : size] = value[:first]
        u[size:] = u[size - 1]
        return cls(u, size, first, between, lead, drive.size)

    def answer(self, response: Float[np.ndarray, " nodes"]) -> Float[np.ndarray, " time"]:
        """The response at the samples of the run, from that at the nodes."""
        size, first, lead = self.size, self.first, self.lead
        if not first and not self.between.size:
            if self.samples + lead <= size:
                return response[lead : lead + self.samples]
            one = response[:size]
        else:
            one = np.concatenate([response[size - first : size], response[: size - first]])
            one = np.delete(one, self.between)[lead:] if self.between.size else one[lead:]
        out = aligned(self.samples)
        whole = self.samples // one.size * one.size
        out[:whole].reshape(-1, one.size)[:] = one
        out[whole:] = one[: self.samples - whole]
        return out


def aligned(size: int) -> Float[np.ndarray, " size"]:
    """An empty array that a device on this host can use in place."""
    spare = _ALIGNMENT // 8
    raw = np.empty(size + spare)
    start = (-raw.ctypes.data % _ALIGNMENT) // 8
    return raw[start : start + size]
