"""Quantisation of the drive by a digital source."""

from collections.abc import Iterable
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractBend, AbstractDriveEffect
from .base._contribution import Contribution
from .base._derived import Derived, ScanRange
from .base._first_guess import find_peaks
from .base._linear_path import LinearPath
from .base._residual_summary import ResidualSummary


class Quantisation(AbstractBend):
    r"""A drive rounded to whole steps: $u_0 + q\,\mathrm{round}((u - u_0) / q)$.

    A converter of $n$ bits over a range $R$ has $q = R / 2^n$; `origin` ($u_0$) is where one of its
    levels lies. It cannot be undone; a finer source can replace it.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Quantisation
    >>> time, drive = jnp.arange(4.0) * 0.001, jnp.array([0.0, 0.3, 0.6, 0.8])
    >>> Quantisation.at(step=0.5)(time, drive).round(3).tolist()  # V
    [0.0, 0.5, 0.5, 1.0]
    """

    step: Float[Array, ""] = parameter(unit="{u}", default=0.0, bounds=(0.0, jnp.inf))  # q
    origin: Float[Array, ""] = parameter(unit="{u}", default=0.0)  # u_0

    name: ClassVar[str] = "quantisation"
    label: ClassVar[str] = "quantisation of the drive"
    signature_axis: ClassVar = "drive"
    remedy: ClassVar[str] = "Use a source with more bits, or more of its range."
    smooth: ClassVar = False

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        return (Derived("resolution", "bit", "step", lambda step: np.log2(scan.drive / step)),)

    def signature_period(self) -> float:
        return float(self.step)

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """Levels that are each off by an error of its own."""
        step, origin = float(self.step), float(self.origin)
        if not step > 0:
            return []
        level = np.unique(np.round((here.drive - origin) / step))
        if level.size > THRESHOLDS.uneven_levels:
            return []
        errors = [_LevelError.at(level=origin + k * step, step=step) for k in level]
        return [here.scaled(np.stack([here.beside(error) for error in errors]))]

    @classmethod
    def search_ranges(cls, summary: ResidualSummary) -> dict[str, tuple[float, float]]:
        """The step as its first guesses may be, whatever is known of the laser by then."""
        span = float(np.ptp(summary.drive))
        return {"step": (THRESHOLDS.finest_step * span, span / THRESHOLDS.fewest_steps)}

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[Quantisation]":
        """Periods of the residual as a function of the drive; and 6, 8 ... 14 bits of its range."""
        low, high = float(summary.drive.min()), float(summary.drive.max())
        if not high > low:
            return []
        counts = range(THRESHOLDS.coarsest_bits, THRESHOLDS.finest_bits + 1, 2)
        bits = [((high - low) / 2**n, low) for n in counts]
        return [cls.at(step=q, origin=at) for q, at in _find_sawteeth(summary) + bits]

    @float64
    def between(
        self, t: Float[Array, " time"], u: Float[Array, " time"]
    ) -> tuple[Float[Array, " time"], Float[Array, " steps"], Float[Array, " steps"]]:
        """The staircase, drawn monotone between samples; its mean over each step is exact.

        Behind a lag or a delay that is long beside a step no more of it is left.
        """
        some = self.step > 0
        step = jnp.where(some, self.step, 1.0)
        x = (u - self.origin) / step
        value = jnp.where(some, self.origin + step * jnp.round(x), u)
        # By how much of its rise the mean over a step lies above the level at its start.
        level, rise = jnp.round(x), jnp.diff(jnp.round(x))
        area, run = jnp.diff(level * (x - level / 2.0)), jnp.diff(x)
        moves = some & (rise != 0)
        mean = area / jnp.where(moves, run, 1.0)
        share = jnp.where(moves, (mean - level[:-1]) / jnp.where(moves, rise, 1.0), 0.5)
        share = jnp.clip(share, 0.0, 1.0)
        early = share >= 0.5  # it rises first, and rests after; else the other way round
        part = jnp.where(early, 2.0 * (1.0 - share), 1.0 - 2.0 * share)
        bend = jnp.where(
            moves, jnp.where(early, value[1:], value[:-1]), (value[1:] + value[:-1]) / 2.0
        )
        return value, t[:-1] + part * jnp.diff(t), bend


class _LevelError(AbstractDriveEffect):
    """One level of a converter, off by a quarter of a step."""

    level: Float[Array, ""] = parameter(unit="{u}", default=0.0)
    step: Float[Array, ""] = parameter(unit="{u}", default=0.0)
    name: ClassVar[str] = "level_error"

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[_LevelError]":
        """None: it is a part of another effect's forms."""
        del summary
        return []

    @float64
    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        del t
        return u + jnp.where(jnp.abs(u - self.level) < 0.5 * self.step, 0.25 * self.step, 0.0)


def _find_sawteeth(summary: ResidualSummary) -> list[tuple[float, float]]:
    r"""Steps and origins of the sawteeth over the drive that explain most of the residual.

    Rounding puts $-(q/\pi) \sin(2\pi (u - u_0)/q)$ and its harmonics into the drive there, and the
    slope of the response times that into the residual; behind a lag, what the lag leaves of that.
    So the residual is matched with each sine as it would be read, over that sine's length.
    """
    residual, places = summary.residual - summary.residual.mean(), summary.places
    found: list[tuple[float, float, float]] = []
    for drive, path in places or ((summary.drive, None),):
        if np.ptp(drive) > 0:
            matched = residual if path is None else path.adjoint(residual)
            found += _sines(drive, matched, path, summary.span / float(np.ptp(drive)))
    found.sort(key=lambda one: -one[0])
    return [(step, origin) for _, step, origin in found[: THRESHOLDS.quantisation_lines]]


def _sines(
    drive: Float[np.ndarray, " samples"],
    residual: Float[np.ndarray, " samples"],
    path: LinearPath | None,
    slope: float,
) -> list[tuple[float, float, float]]:
    """Of sines over a drive what they explain of the residual, their period, and a level's place.

    `residual`: matched with the `path`. `slope`: of the response, per V.
    """
    low, high = float(drive.min()), float(drive.max())
    span = high - low
    cells = int(min(THRESHOLDS.quantisation_cells, 2.0 / THRESHOLDS.finest_step))
    level = np.zeros(cells)
    np.add.at(level, ((drive - low) / span * (cells - 1)).astype(int), residual)
    # Padded to four ranges, so that no line falls between two.
    height = np.abs(np.fft.rfft(level, n=4 * cells)) ** 2
    cycles = np.fft.rfftfreq(4 * cells, span / (cells - 1))
    looked = (cycles * span >= THRESHOLDS.fewest_steps) & (
        cycles <= 1.0 / (THRESHOLDS.finest_step * span)
    )
    explained = np.zeros(cycles.size)
    explained[looked] = _explained(height[looked], cycles[looked], drive, path, slope)
    lines = THRESHOLDS.quantisation_lines
    peaks = find_peaks(explained, lines, apart=THRESHOLDS.quantisation_apart)
    out = []
    for i in (i for i in peaks if explained[i] > 0):
        near = cycles[i] + np.linspace(-1.0, 1.0, 41) * (cycles[1] - cycles[0])
        total = np.exp(-2j * np.pi * near[:, None] * drive[None, :]) @ residual
        best = int(np.argmax(np.abs(total)))
        step = 1.0 / float(near[best])
        phase = float(np.angle(total[best]))  # of a cosine
        # -sin(2 pi (u - u0) / q) = cos(2 pi u / q + phase)
        origin = (0.5 * np.pi - phase) * step / (2.0 * np.pi)
        middle = (low + high) / 2.0  # a level there, so that step and origin are told apart
        square, waves = np.abs(total[best : best + 1]) ** 2, near[best : best + 1]
        score = float(_explained(square, waves, drive, path, slope)[0])
        out.append((score, step, origin + step * round((middle - origin) / step)))
    return out


def _explained(
    square: Float[np.ndarray, " waves"],
    cycles: Float[np.ndarray, " waves"],
    drive: Float[np.ndarray, " samples"],
    path: LinearPath | None,
    slope: float,
) -> Float[np.ndarray, " waves"]:
    """What sines of so many cycles a volt explain, as far as their size is that of a sawtooth.

    Sines of many periods are one as they are sampled; only a sawtooth of the right one has this
    size. `square`: of their products with the residual.
    """
    size = slope / (np.pi * cycles)
    power = np.full(cycles.size, drive.size / 2.0)
    if path is not None:
        power = path.power(drive, cycles) / 2.0
        # What is faster than the samples a lag sees by its mean.
        size = size * np.abs(np.sinc(2.0 * cycles * np.median(np.abs(np.diff(drive)))))
    found = np.sqrt(square) / np.maximum(power, 1e-300)
    return power * np.minimum(found, size) ** 2
