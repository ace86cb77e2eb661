"""Outputs of many single plays, on monotone stretches of the drive (Eqs. 9, 12, 13)."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int


@dataclasses.dataclass(frozen=True, eq=False)
class PlayShapes:
    """Plays in one run: thresholds V, slopes and openings of the falling bounds, their bend 1/V.

    The falling bound is `lam u + eta r + bow (u - u_0)^2`.
    """

    r: Float[np.ndarray, " plays"]
    lam: Float[np.ndarray, " plays"]
    eta: Float[np.ndarray, " plays"]
    bow: Float[np.ndarray, " plays"]
    u_0: float

    def bounds(
        self, u: Float[np.ndarray, " grid"]
    ) -> tuple[Float[np.ndarray, "plays grid"], Float[np.ndarray, "plays grid"]]:
        """The rising and the falling bounds; where they cross, the rising one counts."""
        low = u[None, :] - self.r[:, None]
        high = self.lam[:, None] * u[None, :] + (self.eta * self.r)[:, None]
        high += self.bow[:, None] * (u[None, :] - self.u_0) ** 2
        return low, np.maximum(low, high)


def play_outputs(
    u: Float[np.ndarray, " grid"], shapes: PlayShapes, u_min: float | None
) -> Float[np.ndarray, "plays grid"]:
    """Outputs of the plays under the drive `u`, V from the operator's origin.

    They begin at Eq. 13 for the drive's minimum `u_min`; `None`: in the middle of their bands. On a
    stretch on which the drive is monotone a play is its first output, clamped.
    """
    low, high = shapes.bounds(u)
    if u_min is None:
        held = (low[:, 0] + high[:, 0]) / 2.0
    else:
        held = shapes.bounds(np.array([u_min]))[1][:, 0]
    out = np.empty_like(low)
    ends = _stretch_ends(u)
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        held = np.clip(held, low[:, begin], high[:, begin])
        np.clip(held[:, None], low[:, begin:end], high[:, begin:end], out=out[:, begin:end])
        held = out[:, end - 1]
    return out


def telling_samples(
    u: Float[np.ndarray, " grid"], at: Int[np.ndarray, " places"]
) -> tuple[Int[np.ndarray, " samples"], Int[np.ndarray, " places"]]:
    """The samples that tell outputs at `at`, and where among them each of these is.

    They are `at` and both ends of each stretch, so a play comes by all turns of the drive.
    """
    ends = np.array(_stretch_ends(u))
    samples = np.unique(np.concatenate([at, ends[:-1], ends[1:] - 1]))
    return samples, np.searchsorted(samples, at)


def _stretch_ends(u: Float[np.ndarray, " grid"]) -> list[int]:
    """Where each stretch begins on which the drive does not turn; last the number of samples."""
    way = np.sign(np.diff(u))
    moving = np.flatnonzero(way)
    turns = moving[1:][way[moving][1:] != way[moving][:-1]] + 1
    return [0, *turns.tolist(), u.size]
