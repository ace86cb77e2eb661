r"""How much of the gap a model closes on data that took no part in its fit, with an interval.

`closed = 1 - G2_after / G2_before`, `G2` the mean square of errors of both kinds above the noise.
Its spread comes from runs and periods drawn anew: runs with replacement, and of each the periods,
in blocks where one is like the next.
"""

import dataclasses

import numpy as np
from scipy import stats

from fitting.diagnosis.noise._lines import SpectralLines, to_lines
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.where._gap import measure_gap
from fitting.diagnosis.where._sums_of_squares import sum_squares

from ._thresholds import THRESHOLDS

# Of a median's error, what is left when the mean of the same exponential numbers is taken off.
_SHARED_FLOOR = float(np.sqrt(1.0 - 2.0 * np.log(2.0) ** 2))


def closed_fraction(
    before: list[np.ndarray],
    after: list[np.ndarray],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    *,
    own_origin: bool = False,
    apart: bool = False,
    draws: int = 2000,
    seed: int = 0,
) -> dict[str, float] | None:
    """The closed fraction as `value`, `low`, `high` (95 %), from errors of held-out runs.

    `apart`: whether the spectrum was measured without these readings; then its own error counts in
    full, and else next to nothing, since what noise they have more raises the floor as well.

    Errors are "periods phases" (model less data, 0 where masked), of the models before and after.
    Fewer periods than the block has: the last ones. `None` where the gap before is not
    significantly positive, or noise is not known: then there is nothing to close, or no telling.

    The spread is that of `e = G2_after - (1 - closed) G2_before` of the runs. A plain two-stage
    bootstrap counts the scatter of periods twice, and that of few runs too low, so the runs' `e`
    are scaled for both stages together to have the unbiased variance, and the interval is widened
    by Student's t. With one run its periods tell the spread, and the interval is made twice as
    wide, since another run may differ; with one period as well the noise spectrum tells it.
    """
    held = [_last(b, e.shape[0]) for b, e in zip(blocks, before, strict=True)]
    if own_origin:
        before, after = (
            [_centred(e, b) for e, b in zip(x, held, strict=True)] for x in (before, after)
        )
    first = measure_gap(before, held, spectrum, own_origin=own_origin)
    if not spectrum.measured or not first.significant or first.structural2 <= 0:
        return None
    table = _Table.of(before, after, held, spectrum, own_origin)
    ratio = table.after.sum() / table.before.sum()
    if not table.before.sum() > 0:
        return None
    value = 1.0 - float(ratio)
    if len(held) == 1 and held[0].periods == 1:
        spread = _from_noise(before[0], after[0], held[0], spectrum, float(ratio))
        low, high = (
            value - THRESHOLDS.single_run_widening * 1.96 * spread,
            value + THRESHOLDS.single_run_widening * 1.96 * spread,
        )
        return {"value": value, "low": low, "high": high}
    rng = np.random.default_rng(seed)
    drawn, freedom = table.drawn(float(ratio), draws, rng)
    # The floor is the same before and after, and not known exactly.
    floor = first.floor2_stderr * (1.0 if apart else _SHARED_FLOOR)
    shift = floor * rng.standard_normal(draws) * (1.0 - ratio)
    drawn = drawn - shift * table.readings / table.before.sum()
    wide = float(
        stats.t.ppf((1 + THRESHOLDS.level) / 2, freedom)
        / stats.norm.ppf((1 + THRESHOLDS.level) / 2)
    )
    wide *= THRESHOLDS.single_run_widening if len(held) == 1 else 1.0
    low, high = np.quantile(drawn, [(1 - THRESHOLDS.level) / 2, (1 + THRESHOLDS.level) / 2])
    return {
        "value": value,
        "low": value + wide * min(float(low), 0.0),
        "high": value + wide * max(float(high), 0.0),
    }


def _last(block: PeriodBlock, periods: int) -> PeriodBlock:
    if periods == block.periods:
        return block
    names = ("left", "right", "fraction", "time", "data", "use", "drive")
    return dataclasses.replace(block, **{n: getattr(block, n)[-periods:] for n in names})


def _centred(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    mean = (error * block.use).sum() / max(block.use.sum(), 1.0)
    return (error - mean) * block.use


@dataclasses.dataclass(frozen=True, eq=False)
class _Table:
    """Sums of squares above noise, "runs periods", 0 behind a run's last period (`inside`)."""

    before: np.ndarray
    after: np.ndarray
    inside: np.ndarray
    readings: float

    @classmethod
    def of(
        cls,
        before: list[np.ndarray],
        after: list[np.ndarray],
        blocks: list[PeriodBlock],
        spectrum: Spectrum,
        own_origin: bool,
    ) -> "_Table":
        parts = sum_squares(before, blocks, spectrum, own_origin=own_origin)
        longest = max(b.periods for b in blocks)
        rows = np.zeros((3, len(blocks), longest))
        for k, (block, part) in enumerate(zip(blocks, parts, strict=True)):
            noise = part.noise * block.use.sum(axis=1) * part.freedom / part.readings
            for row, error in zip(rows, (before[k], after[k]), strict=False):
                row[k, : block.periods] = (block.use * error**2).sum(axis=1) - noise
            rows[2, k, : block.periods] = 1.0
        return cls(rows[0], rows[1], rows[2], sum(p.readings for p in parts))

    def drawn(self, ratio: float, draws: int, rng: np.random.Generator) -> tuple[np.ndarray, float]:
        """Draws of the closed fraction less its value, and the degrees of freedom behind them."""
        count = self.inside.sum(axis=1)
        runs, longest = self.inside.shape
        off = self.after - ratio * self.before  # its sum over all is 0
        own = off.sum(axis=1)
        about = (off - (own / count)[:, None]) * self.inside
        length = _block_length(about, count)
        # Of a run's sum, by circular blocks of its periods.
        within = np.where(count > 1, _circular(about, count, length), 0.0)
        inflate = np.sqrt(count / np.maximum(count - 1.0, 1.0))
        scatter = float(own @ own) / max(runs - 1, 1) if runs > 1 else 0.0
        between = max(scatter - float(within.mean()), 0.0)
        mean_square = float(own @ own) / runs
        shrink = np.sqrt(between / mean_square) if mean_square > 0 and runs > 1 else 0.0
        freedom = float(runs - 1) if between > 0 else float((count - 1).sum())

        pick = rng.integers(0, runs, (draws, runs))
        start = rng.random((draws, runs, -(-longest // length)))
        periods = count[pick][:, :, None]
        place = np.repeat(np.floor(start * periods), length, axis=2)[:, :, :longest]
        place = (place + np.arange(longest)[None, None, :] % length) % periods
        keep = np.arange(longest)[None, None, :] < periods
        moved = about[pick[:, :, None], place.astype(int)] * keep
        e = shrink * own[pick] + inflate[pick] * moved.sum(axis=2)
        remaining = self.before.sum(axis=1)[pick].sum(axis=1)
        whole = float(self.before.sum())
        return -e.sum(axis=1) / np.maximum(remaining, THRESHOLDS.least_gap * whole), max(
            freedom, 1.0
        )


def _block_length(about: np.ndarray, count: np.ndarray) -> int:
    """Periods a block: more than one where neighbours correlate beyond chance."""
    pairs = float(np.maximum(count - 1.0, 0.0).sum())
    power = float((about**2).sum())
    if pairs < THRESHOLDS.least_pairs or power <= 0:
        return 1
    correlation = float((about[:, 1:] * about[:, :-1]).sum()) / power
    # About their own mean, numbers without any likeness have -1/n.
    correlation += float((count > 1).sum()) / float(count[count > 1].sum())
    if correlation < THRESHOLDS.correlation_sigmas / np.sqrt(pairs):
        return 1
    correlation = min(correlation, THRESHOLDS.largest_correlation)
    length = (2.0 * correlation / (1.0 - correlation**2)) ** (2.0 / 3.0) * float(count.max()) ** (
        1.0 / 3.0
    )
    return int(np.clip(round(length), 2, max(int(count.max()) // 2, 1)))


def _circular(about: np.ndarray, count: np.ndarray, length: int) -> np.ndarray:
    """Variance of each run's sum over its periods."""
    out = np.zeros(count.size)
    for k, row in enumerate(about):
        n = int(count[k])
        size = min(length, n)
        chunk = sum(np.roll(row[:n], -i) for i in range(size))
        out[k] = n / size * float(np.mean(np.square(chunk))) * n / max(n - 1, 1)
    return out


def _from_noise(
    before: np.ndarray, after: np.ndarray, block: PeriodBlock, spectrum: Spectrum, ratio: float
) -> float:
    lines = SpectralLines.of(block)
    s = spectrum.of_lines(lines)
    left = np.abs(to_lines(after - ratio * before)) ** 2
    own = (1.0 - ratio) ** 2
    cross = max(float((lines.multiplicity * s) @ (left - own * s)), 0.0)
    variance = 4.0 * cross + 2.0 * own * float(lines.multiplicity @ s**2)
    before_sum = float((before**2).sum() - (lines.multiplicity @ s))
    return float(np.sqrt(variance)) / max(before_sum, 1e-300)
