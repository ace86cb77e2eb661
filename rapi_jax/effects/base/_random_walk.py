"""Functions of time of which a random walk is a sum, narrow-band noise, and such as begin anew with
each run.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

_FADING = np.geomspace(0.1, 5.0, 30)  # time constants, of a run
_BEYOND = 1.25  # of the session, after which sines and cosines repeat


def random_walk(
    time: Float[np.ndarray, " samples"], count: int, smoothness: float = 1.0
) -> Float[np.ndarray, "functions samples"]:
    r"""The first `count` functions of the Karhunen-Loeve series of a Wiener process.

    $\sin((k - 1/2) \pi s) / (k - 1/2)$, $s$ the time from 0 to 1: with sizes of one variance their
    sum is a random walk, up to what is faster than the last of them. `smoothness`: the power of the
    denominator; with 2 it is a smooth curve, with 1.5 one between the two.
    """
    lasts = float(np.ptp(time))
    share = (time - time.min()) / lasts if lasts > 0 else np.zeros_like(time)
    order = np.arange(1, count + 1)[:, None] - 0.5
    return np.sin(order * np.pi * share) / order**smoothness


def narrow_band(
    time: Float[np.ndarray, " samples"], hertz: float, highest: float, quality: float = 1.0
) -> Float[np.ndarray, "functions samples"]:
    """Sines and cosines up to `highest` Hz of which noise about `hertz` is a sum.

    Their variances by frequency are those of white noise behind a band pass of second order, as of
    a controller that hunts: with `quality` 1, a band as wide as its frequency.
    """
    lasts = _BEYOND * float(np.ptp(time))  # else the noise would end as it begins
    tone = np.arange(1, int(highest * lasts) + 1)[:, None] / lasts
    width = tone * hertz / quality
    size = width / np.sqrt((tone**2 - hertz**2) ** 2 + width**2)
    turn = 2.0 * np.pi * tone * (time - time.min())
    return np.vstack([size * np.sin(turn), size * np.cos(turn)])


def anew_in_each_run(
    time: Float[np.ndarray, " samples"], run: Int[np.ndarray, " samples"]
) -> Iterator[Float[np.ndarray, "functions samples"]]:
    """Sets of functions of what begins anew with each run, and so does not drift.

    A level and a slope in time for each run; and what fades in each, by one time constant for all
    runs, from a tenth of a run to five.
    """
    own = run == np.unique(run)[:, None]
    since = np.zeros(time.size)
    for mine in own:
        since[mine] = time[mine] - time[mine].min()
    lasts = max(float(np.median([since[mine].max() for mine in own])), 1e-300)
    yield np.concatenate([own, own * (since / lasts - 0.5)]).astype(float)
    for tau in lasts * _FADING:
        yield own * np.exp(-since / tau)
