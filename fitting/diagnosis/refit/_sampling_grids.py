"""Grids on which the operator is evaluated: of the whole session, and of one period of each run."""

import dataclasses
from functools import cached_property

import jax.numpy as jnp
import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock
from rapi_jax.internal import (
    DriveBatch,
    on_device,
    on_own_nodes,
    stretches_on_device,
    with_spare_nodes,
)

from ._shape_bucketing import pad_drives, repeat_rows, round_up


@dataclasses.dataclass(frozen=True, eq=False)
class SamplingGrids:
    """The drives of a recording with two grids for the operator; `drives`: see `Batch.drives`.

    Shapes are rounded, see `_shape_bucketing`; rows added repeat the last run.
    """

    drives: dict[str, np.ndarray]

    @cached_property
    def session(self) -> DriveBatch:
        """With the grid of all samples and the lead-in."""
        return on_device(pad_drives(self.drives))

    @cached_property
    def session_with_spare_nodes(self) -> DriveBatch:
        """The same with a node in each step that an effect may move."""
        return with_spare_nodes(self.session)

    @cached_property
    def samples(self) -> DriveBatch:
        """The samples as their own nodes: all that effects behind the operator see of the drives.

        So their compiled code asks for no number of nodes or turns, and is shared by more drives.
        """
        session = self.session
        return on_own_nodes(
            session, session.time, jnp.take_along_axis(session.node_u, session.place, axis=1)
        )

    @cached_property
    def period(self) -> DriveBatch:
        """With the grid of one period: enough where effects leave the drive as it is."""
        session, u = self.session, np.asarray(self.session.node_u)
        lead, last = np.asarray(session.node_history.lead), u.shape[1] - 1
        # Eq. 13 is the periodic state at the minimum, so there alone may an operator begin.
        whole = np.asarray(session.node_history.period_s) > 0
        whole &= u[np.arange(len(u)), lead] == u.min(axis=1)
        lead = np.where(whole, lead, 0)
        longest = round_up(int(np.max(np.asarray(session.place).max(axis=1) - lead)) + 1)
        index = np.minimum(lead[:, None] + np.arange(longest)[None, :], last)
        time = np.take_along_axis(np.asarray(session.node_time), index, axis=1)
        u = np.take_along_axis(u, index, axis=1)
        return dataclasses.replace(
            session,
            node_time=jnp.asarray(time),
            node_u=jnp.asarray(u),
            place=session.place - jnp.asarray(lead)[:, None],
            stretches=stretches_on_device(u),
        )


def nodes_alone(drives: DriveBatch) -> DriveBatch:
    """The drives without their samples: all that effects before the operator see of them."""
    node = jnp.zeros(drives.node_u.shape, dtype=drives.place.dtype)
    return dataclasses.replace(drives, time=drives.node_time, place=node, stretches=None)


@dataclasses.dataclass(frozen=True, eq=False)
class FirstPeriod:
    """The samples of the first period of each run, or of all of a run that does not repeat.

    - `index`: "runs time", into the rows of samples. `first`: first sample of each run.
    """

    index: np.ndarray
    first: list[int]

    @classmethod
    def of(cls, blocks: list[PeriodBlock], rows: int) -> "FirstPeriod":
        """Of these runs, padded to so many rows."""
        ends = [(int(b.left[0, 0]), int(b.right[0, -1]) + 1) for b in blocks]
        longest = round_up(max(end - begin for begin, end in ends))
        index = np.stack([np.minimum(np.arange(a, a + longest), b - 1) for a, b in ends])
        return cls(repeat_rows(index, rows), [begin for begin, _ in ends])

    def select(self, drives: DriveBatch) -> DriveBatch:
        """The drives with the samples of the first periods alone."""
        time, place = (
            jnp.asarray(np.take_along_axis(np.asarray(a), self.index, axis=1))
            for a in (drives.time, drives.place)
        )
        return dataclasses.replace(drives, time=time, place=place)

    def samples(self, samples: DriveBatch) -> DriveBatch:
        """The samples of the first periods as their own nodes, of `SamplingGrids.samples`."""
        first = self.select(samples)
        u = jnp.take_along_axis(samples.node_u, first.place, axis=1)
        return on_own_nodes(samples, first.time, u)
