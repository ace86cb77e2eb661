"""Mode hops of the laser's external cavity."""

from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractSwitch
from .base._derived import HALF_LIGHT_MM_GHZ, Derived, ScanRange
from .base._first_guess import detectable_amplitude
from .base._first_order_lags import respond_from_rest
from .base._linear import Modes
from .base._residual_summary import ResidualSummary

_ONE_PLACE = 1e-9  # of the span: readings closer than this tell no slope


class ModeHop(AbstractSwitch):
    r"""A jump at a threshold in frequency, back at a lower one: $\nu + \Delta$ while hopped.

    The laser hops when the response reaches `threshold` $\nu_h$, and hops back when it falls below
    $\nu_h$ - `width`. `size` is $\Delta$, of either sign: a multiple $m c/2L$ of the cavity's mode
    spacing. A run that begins between the two thresholds begins as if it had come from below.
    The jump is sudden, or settles by a first-order lag of `settle_s`.

    External-cavity lasers hop by 3 to 4 GHz (MOGLabs CEL and CEX manuals).

    >>> import equinox as eqx
    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import ModeHop
    >>> nu = jnp.array([8.0, 11.0, 9.5, 8.0])  # GHz
    >>> hop = eqx.filter_jit(ModeHop.at(size=5.0, threshold=10.0, width=1.0))  # compiled whole
    >>> hop(nu, nu).tolist()  # back below 9 GHz
    [8.0, 16.0, 14.5, 8.0]
    """

    name: ClassVar[str] = "mode_hop"
    label: ClassVar[str] = "mode hops"
    pointwise: ClassVar[bool] = True
    signature_axis: ClassVar = "response"
    remedy: ClassVar[str] = "Scan less or move the bias, so that the hop lies outside."
    size: Float[Array, ""] = parameter(unit="{x}", default=0.0)
    threshold: Float[Array, ""] = parameter(unit="{x}", default=0.0)
    width: Float[Array, ""] = parameter(unit="{x}", default=0.0, bounds=(0.0, np.inf))
    settle_s: Float[Array, ""] = parameter(unit="s", default=0.0, bounds=(0.0, 0.1))

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        hopped = self.hopped(nu).astype(nu.dtype)
        settles = self.settle_s > THRESHOLDS.hop_settled
        lag = jnp.where(settles, self.settle_s, 1.0)

        def slowly() -> Array:
            return respond_from_rest(Modes(lag[None], jnp.ones(1)), t, hopped)

        # A sudden one needs no recursion, which takes longer than all the rest.
        return nu + self.size * jax.lax.cond(settles, slowly, lambda: hopped)

    @float64
    def hopped(self, nu: Float[Array, " time"]) -> Array:
        """Whether the laser is beyond its hop, at each sample."""
        above = nu >= self.threshold
        known = above | (nu < self.threshold - self.width)
        # Index of the last sample outside the band; -1 before the first.
        last = jax.lax.cummax(jnp.where(known, jnp.arange(nu.size), -1))
        return (last >= 0) & above[jnp.maximum(last, 0)]

    def with_states(
        self,
        nu: Float[np.ndarray, " samples"],
        on: Bool[np.ndarray, " samples"],
        run: Int[np.ndarray, " samples"],
    ) -> "ModeHop":
        """See `AbstractSwitch`; unchanged where `on` holds no hop."""
        same = run[1:] == run[:-1]
        up, down = (1 + np.flatnonzero(same & (np.diff(on.astype(int)) == way)) for way in (1, -1))
        if not up.size:
            return self
        threshold = _fit_threshold(nu[~on], nu[up])
        width = float(self.width)
        if down.size:
            width = max(threshold - _fit_threshold(nu[down], nu[on]), 0.0)
        return type(self).at(
            size=self.size, threshold=threshold, width=width, settle_s=self.settle_s
        )

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        del scan
        return (
            Derived(
                "cavity, if one mode", "mm", "size", lambda hop: HALF_LIGHT_MM_GHZ / abs(hop), True
            ),
        )

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[ModeHop]":
        """Jumps of the data between neighbouring samples, and the sharpest steps of the residual
        as a function of the response, upward steps paired with downward ones.
        """
        span = summary.span
        if not (np.isfinite(span) and span > 0):
            return []
        return [*_guess_from_jumps(cls, summary), *cls._guess_from_steps(summary)]

    @classmethod
    def _guess_from_steps(cls, summary: ResidualSummary) -> "list[ModeHop]":
        span = summary.span
        up, down = (_find_steps(summary, sign, THRESHOLDS.hop_steps) for sign in (1, -1))
        narrow = THRESHOLDS.hop_narrow * span
        found = []
        for at, jump in up:
            below = [a for a, j in down if j * jump > 0 and -0.01 * span < at - a < 0.3 * span]
            found += [(jump, at, max(at - a, narrow)) for a in below[:1]] or [(jump, at, narrow)]
        found += [(jump, at, narrow) for at, jump in down[:1]]
        wider = [(jump, at, THRESHOLDS.hop_wide * span) for jump, at, _ in found]
        return [
            cls.at(size=jump, threshold=at, width=width, settle_s=settle)
            for jump, at, width in [*found, *wider]
            for settle in (THRESHOLDS.hop_sudden, THRESHOLDS.hop_slow * summary.step_s)
        ]


def _guess_from_jumps(cls: type[ModeHop], summary: ResidualSummary) -> list[ModeHop]:
    """Hops larger than the noise of single samples, with their thresholds in the data."""
    inside = np.diff(summary.run) == 0
    leap = np.where(inside, np.diff(summary.residual), 0.0)
    usual = float(np.median(np.abs(leap[inside]))) / 0.6745 if inside.any() else 0.0
    far = np.flatnonzero(
        np.abs(leap) > max(THRESHOLDS.hop_outlier * usual, detectable_amplitude(summary))
    )
    # Hops are of one size, and steps of what a base misfits of none: besides all, the largest.
    largest = far[np.abs(leap[far]) > THRESHOLDS.hop_alike * np.abs(leap[far]).max(initial=0.0)]
    every = [far] if largest.size == far.size else [far, largest]
    return [one for places in every for one in _hop_at(cls, summary, leap, places)]


def _hop_at(
    cls: type[ModeHop], summary: ResidualSummary, leap: np.ndarray, places: np.ndarray
) -> list[ModeHop]:
    """The hop whose jumps follow the samples at `places`; none where all of them go down.

    With its thresholds in the data, and in the response of the model: where the two differ by more
    than the scan goes beyond a threshold, the model with the one in the data never hops.
    """
    rising = np.diff(summary.response) > 0
    up, down = places[rising[places]], places[~rising[places]]
    if not up.size:
        return []
    size = float(np.median(leap[up]))
    same = up[np.sign(leap[up]) == np.sign(size)]
    back = down[np.sign(leap[down]) == -np.sign(size)]
    data, model = summary.response + summary.residual, summary.response
    found = []
    for going, returning in (
        ((data[same], data[same + 1] - leap[same]), (data[back + 1], data[back] + leap[back])),
        ((model[same], model[same + 1]), (model[back + 1], model[back])),
    ):
        at, width = _fit_threshold(*going), 0.0
        if back.size:
            width = at - _fit_threshold(*returning)
        width = max(width, THRESHOLDS.hop_narrow * summary.span)
        found.append(cls.at(size=size, threshold=at, width=width, settle_s=THRESHOLDS.hop_sudden))
    return found


def _fit_threshold(below: np.ndarray, above: np.ndarray) -> float:
    """The threshold between `below` and `above`, readings on the two sides of a jump.

    Where the two overlap: the least sum of squares of the readings on the wrong side. Readings
    bound a threshold without a model of the response.
    """
    from scipy.optimize import bisect

    low, high = float(below.max()), float(above.min())
    if low <= high:
        return (low + high) / 2.0

    def slope(at: float) -> float:
        wrong = np.maximum(below - at, 0.0).sum() - np.maximum(at - above, 0.0).sum()
        return -float(wrong)

    root: Any = bisect(slope, high, low)  # typed as if it gave more
    return float(root)


def _find_steps(summary: ResidualSummary, direction: int, count: int) -> list[tuple[float, float]]:
    """Responses at, and sizes of, the residual's sharpest steps, sharpest first."""
    rising = np.zeros(summary.response.size)
    for k in np.unique(summary.run):
        mine = np.flatnonzero(summary.run == k)
        if mine.size > 1:
            rising[mine] = np.gradient(summary.response[mine])
    mine = rising * direction > 0
    if mine.sum() < 4 * THRESHOLDS.hop_line_bins:
        return []
    nu, rest = summary.response[mine], summary.residual[mine]
    order = np.argsort(nu, kind="stable")
    parts = np.array_split(order, min(THRESHOLDS.hop_bins, order.size // 2))
    place = np.array([nu[p].mean() for p in parts])
    mean = np.array([rest[p].mean() for p in parts])
    noise = max(float(np.median(np.abs(np.diff(mean)))), 1e-3 * detectable_amplitude(summary))
    jump, sharp = np.zeros(place.size), np.zeros(place.size)
    for i in range(THRESHOLDS.hop_line_bins, place.size - THRESHOLDS.hop_line_bins + 1):
        edge = (place[i - 1] + place[i]) / 2.0
        sides = (slice(i - THRESHOLDS.hop_line_bins, i), slice(i, i + THRESHOLDS.hop_line_bins))
        apart = _ONE_PLACE * summary.span
        lines = [np.polyfit(place[s] - edge, mean[s], 1) for s in sides if np.ptp(place[s]) > apart]
        if len(lines) < 2:
            continue
        off = [np.polyval(c, place[s] - edge) - mean[s] for c, s in zip(lines, sides, strict=True)]
        jump[i] = lines[1][1] - lines[0][1]
        sharp[i] = abs(jump[i]) / (noise + float(np.std(np.concatenate(off))))
    found: list[tuple[float, float]] = []
    for i in np.argsort(-sharp, kind="stable"):
        at = float((place[i - 1] + place[i]) / 2.0)
        if jump[i] == 0 or len(found) == count:
            break
        if all(abs(at - other) > THRESHOLDS.hop_apart * summary.span for other, _ in found):
            found.append((at, float(jump[i])))
    return found
