"""A recording as rectangular arrays: one row per run, ready for a model mapped over runs."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped

from rapi_jax.plays._monotone_stretches import Stretches, stretches_on_device
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._run import Run

from ._history import History
from ._sampling_grid import Row, row_of
from ._thresholds import THRESHOLDS


class DriveBatch(eqx.Module):
    """The drives of several runs, one row each; see `Row`.

    The operator acts on the nodes; `place` spreads what it answers over the samples of the runs.
    `stretches` says where the drive as sent is monotone on the nodes, if its turns are few.
    `spare`: every other node is one that an effect may move, see `with_spare_nodes`.
    """

    node_time: Float[Array, "runs nodes"]
    node_u: Float[Array, "runs nodes"]
    node_history: History
    time: Float[Array, "runs time"]
    place: Int[Array, "runs time"]
    history: History
    freq: Float[Array, " runs"]
    u_pp: Float[Array, " runs"]
    u_min: Float[Array, " runs"]
    bias: Float[Array, " runs"]
    stretches: Stretches | None = None
    spare: bool = eqx.field(static=True, default=False)


def interleaved(
    nodes: Shaped[Array, "runs nodes"], between: Shaped[Array, "runs steps"]
) -> Shaped[Array, "runs doubled"]:
    """Nodes and what lies between them in turn, of each run; the last comes twice."""
    both = jnp.stack([nodes, jnp.concatenate([between, nodes[:, -1:]], axis=1)], axis=2)
    return both.reshape(nodes.shape[0], -1)


def with_spare_nodes(drives: DriveBatch) -> DriveBatch:
    """The drives with a node in the middle of each step, for a drive that will bend there."""

    def middle(nodes: Array) -> Array:
        return interleaved(nodes, (nodes[:, 1:] + nodes[:, :-1]) / 2.0)

    history = drives.node_history
    return DriveBatch(
        middle(drives.node_time),
        middle(drives.node_u),
        history._replace(lead=2 * history.lead),
        drives.time,
        2 * drives.place,
        drives.history,
        drives.freq,
        drives.u_pp,
        drives.u_min,
        drives.bias,
        None,
        spare=True,
    )


def on_own_nodes(
    drives: DriveBatch, time: Float[Array, "runs time"], u: Float[Array, "runs time"]
) -> DriveBatch:
    """Rows of samples as their own nodes: all that effects behind the operator see of drives."""
    place = jnp.broadcast_to(jnp.arange(u.shape[1], dtype=drives.place.dtype), u.shape)
    return dataclasses.replace(
        drives,
        node_time=time,
        node_u=u,
        node_history=drives.history,
        time=time,
        place=place,
        stretches=None,
        spare=False,
    )


def rows_with_spare_nodes(
    sent: DriveBatch, reached: DriveBatch
) -> tuple[DriveBatch, Int[Array, "runs doubled"]]:
    """The samples and in turn the spare nodes between them, with the drive that was sent.

    Also which node each is. `sent`: the drives with spare nodes; `reached`: behind effects that
    moved these.
    """
    place = sent.place
    lead = sent.node_history.lead.astype(place.dtype)[:, None]
    # Behind the last node of a period that repeats comes the step that led to its first.
    wraps = (sent.node_history.period_s[:, None] > 0) & (place == 2 * lead - 2)
    spare = jnp.where(wraps, lead - 1, place + 1)

    def at(nodes: Array, index: Array) -> Array:
        return jnp.take_along_axis(nodes, index, axis=1)

    following = jnp.concatenate([sent.time[:, 1:], sent.time[:, -1:]], axis=1)
    ends = following <= sent.time  # a row is continued with its last sample
    step = 2.0 * (at(sent.node_time, spare) - at(sent.node_time, spare - 1))
    later = at(reached.node_time, spare) - at(reached.node_time, spare - 1)
    share = jnp.where(ends | (step <= 0), 0.0, later / jnp.where(step > 0, step, 1.0))
    u, middle = at(sent.node_u, spare - 1), at(sent.node_u, spare)
    time = jnp.where(ends, sent.time, jnp.minimum(sent.time + later, following))
    history = sent.history._replace(lead=2 * sent.history.lead)
    rows = on_own_nodes(
        dataclasses.replace(sent, history=history),
        interleaved(sent.time, time[:, :-1]),
        interleaved(u, (u + 2.0 * (middle - u) * share)[:, :-1]),
    )
    return rows, interleaved(place, jnp.where(ends, place, spare)[:, :-1])


class Batch(eqx.Module):
    """All runs of a recording, padded to one length.

    Each row is a lead-in of one period (where asked for), the run with the turning points between
    its samples, and a repeat of the last of these. `use` marks complete periods and valid readings:
    what a fit may look at. `sample` is the index in its run, -1 elsewhere. NumPy arrays; `device()`
    gives what a model needs as JAX arrays.
    """

    time: np.ndarray  # "runs time", s in the session
    u: np.ndarray  # "runs time", drive unit, lag taken out
    y: np.ndarray  # "runs time", response unit, 0 outside
    use: np.ndarray  # "runs time"
    sample: np.ndarray  # "runs time"
    freq: np.ndarray  # "runs", Hz
    u_pp: np.ndarray  # "runs"
    u_min: np.ndarray  # "runs"
    drives: dict[str, np.ndarray]  # the fields of `DriveBatch`

    def device(self) -> DriveBatch:
        """What a model needs of the drives, as JAX arrays; call with 64-bit types on."""
        return on_device(self.drives)


def usable(run: Run, lag_s: float) -> Bool[np.ndarray, " time"]:
    """The samples of a run that a fit may look at: complete periods, readings that are numbers."""
    use = run.valid & (run.drive.time >= lag_s)
    return use & (run.drive.period >= 0) if run.drive.repeats else use


def _stack(columns: Sequence[np.ndarray], fill: int | None = None) -> np.ndarray:
    """Columns of different lengths as one array, padded with their last element or with `fill`."""
    longest = max(column.size for column in columns)
    longest += -longest % THRESHOLDS.row_multiple
    rows = np.empty((len(columns), longest), dtype=columns[0].dtype)
    for row, column in zip(rows, columns, strict=True):
        row[: column.size] = column
        row[column.size :] = column[-1] if fill is None else fill
    return rows


def batch(drives: Sequence[Drive], rows: Sequence[Row]) -> dict[str, np.ndarray]:
    """The fields of `DriveBatch` as NumPy arrays, those of a history with a prefix."""
    ends = [float(row.time[-1]) for row in rows]
    begins = [float(row.time[row.lead]) for row in rows]
    gaps = [np.inf] + [b - e for b, e in zip(begins[1:], ends[:-1], strict=True)]
    step = max(drive.step_s for drive in drives)
    # A run that starts before the last one ended shares no clock with it.
    gaps = [max(g, 0.0) if g > -step / 2 else np.inf for g in gaps]
    # With the turning points between samples: thresholds follow what the drive reaches (Eq. 11).
    low = np.array([row.node_u.min() for row in rows])
    u_pp = np.array([np.ptp(row.node_u) for row in rows])
    return {
        "node_time": _stack([row.node_time for row in rows]),
        "node_u": _stack([row.node_u for row in rows]),
        "node_lead": np.array([row.node_lead if row.period_s else 0 for row in rows]),
        "time": _stack([row.time for row in rows]),
        "place": _stack([row.place for row in rows]),
        "lead": np.array([row.lead for row in rows]),
        "period_s": np.array([row.period_s for row in rows]),
        "gap_s": np.array(gaps),
        "freq": np.array([drive.rate for drive in drives]),
        "u_pp": u_pp,
        "u_min": low,
        "bias": low + u_pp / 2.0,
    }


def on_device(fields: dict[str, np.ndarray]) -> DriveBatch:
    """`fields` of `batch` as JAX arrays; call with 64-bit types on."""
    a = jax.device_put(fields)
    own = {k: a[k] for k in ("node_time", "node_u", "time", "place", "freq", "u_pp", "u_min")}
    never = jax.device_put(np.full(fields["gap_s"].shape, np.inf))
    return DriveBatch(
        **own,
        bias=a["bias"],
        node_history=History(a["period_s"], a["node_lead"], never),
        history=History(a["period_s"], a["lead"], a["gap_s"]),
        stretches=stretches_on_device(fields["node_u"]),
    )


def to_batch(recording: Recording, *, lead: bool = False) -> Batch:
    """`recording` as rectangular arrays; `lead`: with the period before each run that repeats."""
    lag = recording.response_lag_s
    rows = [row_of(drive, lag, lead=lead) for drive in recording.drives]
    fields = batch(recording.drives, rows)
    sample = _stack([row.sample for row in rows], -1)
    y, use = np.zeros(sample.shape), np.zeros(sample.shape, dtype=bool)
    for k, run in enumerate(recording.runs):
        inside = sample[k] >= 0
        y[k] = np.where(inside, np.where(run.valid, run.response, 0.0)[sample[k]], 0.0)
        use[k] = inside & usable(run, lag)[sample[k]]
    return Batch(
        time=fields["time"],
        u=np.take_along_axis(fields["node_u"], fields["place"], axis=1),
        y=y,
        use=use,
        sample=sample,
        freq=fields["freq"],
        u_pp=fields["u_pp"],
        u_min=fields["u_min"],
        drives=fields,
    )
