"""A recording as rectangular arrays: one row a run, ready for a model that is mapped over runs."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ._recording import Recording, Run

_ROUND = (
    256  # rows are padded to a multiple of this, so that similar recordings share compiled code
)


class Sampled(eqx.Module):
    """All runs of a recording, padded to one length.

    Each row is a lead-in (at most one settling period), the run, and a repeat of the last drive
    value. `use` marks complete periods and valid readings: what a fit may look at. `sample` is the
    index in its run, -1 outside. NumPy arrays; `device()` gives the ones a model needs as JAX
    arrays.
    """

    time: np.ndarray  # "runs time", s in the session
    u: np.ndarray  # "runs time", drive unit, lag taken out
    y: np.ndarray  # "runs time", response unit, 0 outside
    use: np.ndarray  # "runs time"
    sample: np.ndarray  # "runs time"
    freq: np.ndarray  # "runs", Hz
    u_pp: np.ndarray  # "runs"
    u_min: np.ndarray  # "runs"

    def device(self) -> "DriveBatch":
        """What a model needs of the drives, as JAX arrays; call with 64-bit types on."""
        numbers = (self.time, self.u, self.freq, self.u_pp, self.u_min)
        return DriveBatch(*(jnp.asarray(a) for a in numbers))


class DriveBatch(eqx.Module):
    """The drives of several runs, one row each."""

    time: Float[Array, "runs time"]
    u: Float[Array, "runs time"]
    freq: Float[Array, " runs"]
    u_pp: Float[Array, " runs"]
    u_min: Float[Array, " runs"]


def usable(run: Run, lag_s: float) -> Bool[np.ndarray, " time"]:
    """The samples of a run that a fit may look at: complete periods, readings that are numbers."""
    use = run.valid & (run.drive.time >= lag_s)
    return use & (run.drive.period >= 0) if run.drive.repeats else use


def sampled(recording: Recording) -> Sampled:
    """`recording` as rectangular arrays."""
    rows = []
    for run in recording.runs:
        drive = run.drive.delayed(recording.response_lag_s)
        lead = drive.lead_in()
        index = np.arange(-lead.size, drive.size)
        rows.append(
            (
                drive.start_s + index * drive.step_s,
                np.concatenate([lead, drive.value]),
                np.concatenate([np.zeros(lead.size), np.nan_to_num(run.response)]),
                np.concatenate([np.zeros(lead.size, bool), usable(run, recording.response_lag_s)]),
                np.maximum(index, -1),
            )
        )
    longest = max(row[0].size for row in rows)
    longest += -longest % _ROUND
    modes = ("edge", "edge", "constant", "constant", "constant")
    fills: tuple[dict, ...] = ({}, {}, {}, {}, {"constant_values": -1})
    columns = [
        np.stack([np.pad(row[k], (0, longest - row[k].size), mode, **fill) for row in rows])
        for k, (mode, fill) in enumerate(zip(modes, fills, strict=True))
    ]
    drives = [run.drive for run in recording.runs]
    return Sampled(
        *columns,
        freq=np.array([d.rate for d in drives]),
        u_pp=np.array([d.u_pp for d in drives]),
        u_min=np.array([float(d.value.min()) for d in drives]),
    )
