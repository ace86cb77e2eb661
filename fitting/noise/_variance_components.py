r"""Variances of noise processes from what a fit leaves, by restricted likelihood.

With weights $w$ a run, columns $J$ and $G = J'WJ$, a fit leaves $(I - JG^{-1}J'W)e$ of the noise
$e$. So a line's expected power is not the noise's: the fit took out what looks like its columns.
It is linear in the variances all the same, and they are found by Whittle's likelihood of the power
in bins of lines. Processes are added one by one, as long as each raises the likelihood by more than
chance does.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ._lines import PowerBins
from ._relaxations import NoiseModel, Processes
from ._scoring import Bins, maximise
from ._thresholds import THRESHOLDS


def estimate_noise(
    residuals: Sequence[Float[np.ndarray, " _"]],
    columns: Sequence[Float[np.ndarray, "_ columns"]],
    weights: Sequence[float],
    bins: Sequence[PowerBins],
) -> NoiseModel:
    """The noise of runs from a weighted fit's residuals.

    `columns`: of the fit in each run, orthonormal over all once each run is multiplied by the
    square root of its weight. `bins`: of the lines that count. Runs share what is the same from
    second to second, or from sample to sample, whichever is more likely, but for a factor of each;
    or nothing, where that is more likely by more than chance.
    """
    steps = [b.step_s for b in bins]
    ways = [steps] if len(set(steps)) == 1 else [steps, [min(steps)] * len(steps)]
    products = [b.products(c) for b, c in zip(bins, columns, strict=True)]
    power = [b.power(r) for b, r in zip(bins, residuals, strict=True)]
    found = []
    for way in ways:
        processes = Processes.of(way, [b.size for b in bins])
        expected = _Expected.of(products, weights, bins, processes, way)
        shared = maximise(expected.shared(power))
        found.append((shared.score, NoiseModel(processes, shared.by_run, tuple(way))))
        if len(bins) > 1 and way is ways[-1]:
            variance, score = _each_its_own(expected, power, shared.by_run)
            found.append((score, NoiseModel(processes, variance, tuple(way))))
    return max(found, key=lambda pair: pair[0])[1]


def collect(
    residuals: Sequence[Float[np.ndarray, " _"]],
    columns: Sequence[Float[np.ndarray, "_ columns"]],
    weights: Sequence[float],
    bins: Sequence[PowerBins],
    noise: NoiseModel,
) -> Bins:
    """Power, what `noise` lets expect (the one process there is), and freedom of all bins."""
    products = [b.products(c) for b, c in zip(bins, columns, strict=True)]
    expected = _Expected.of(products, weights, bins, noise.processes, noise.step_s)
    power = [b.power(r) for b, r in zip(bins, residuals, strict=True)]
    found = expected.shared(power)
    each = [
        noise.variance[k] @ expected.own[k] + expected.of_others(k, noise.variance)
        for k in range(len(bins))
    ]
    kept = np.concatenate(expected.freedom) > THRESHOLDS.least_freedom
    return dataclasses.replace(found, expected=np.concatenate(each)[None, kept])


def _each_its_own(
    expected: "_Expected", power: Sequence[np.ndarray], start: np.ndarray
) -> tuple[np.ndarray, float]:
    """Variances of runs that share nothing, and the score; the noise of one shows in all."""
    variance, score = start, -np.inf
    alone = range(len(power))
    for _ in range(THRESHOLDS.own_passes):
        each = [maximise(expected.alone(power, k, variance)) for k in alone]
        if not all(one.by_run.any() for one in each):
            return start, -np.inf  # a run without lines that count
        variance = np.stack([one.by_run[k] for k, one in enumerate(each)])
        score = sum(one.score for one in each)
    return variance, score


@dataclasses.dataclass(frozen=True, eq=False)
class _Expected:
    """Expected power in each run's bins of each process of variance 1.

    - `own`: in a run, of its own noise. `back`: in a run (first), of the noise of each run.
    - `freedom`: degrees of freedom that the fit left. `harmonic`: as in `PowerBins`.
    """

    own: list[Float[np.ndarray, "processes _"]]
    back: list[Float[np.ndarray, "runs processes _"]]
    freedom: list[Float[np.ndarray, " _"]]
    harmonic: list[Float[np.ndarray, " _"]]

    @classmethod
    def of(
        cls,
        products: Sequence[Float[np.ndarray, "_ columns columns"]],
        weights: Sequence[float],
        bins: Sequence[PowerBins],
        processes: Processes,
        steps_s: Sequence[float],
    ) -> "_Expected":
        """From what bins hold of the products of the fit's orthonormal columns."""
        lines: dict[tuple[float, int], np.ndarray] = {}
        alone, mean, freedom = [], [], []
        for b, step, w, p in zip(bins, steps_s, weights, products, strict=True):
            if (step, b.size) not in lines:
                lines[step, b.size] = processes.periodogram(step, b.size)
            power = b.sums(lines[step, b.size])
            count, taken = b.sums(np.ones(b.place.size)), w * np.einsum("bii->b", p)
            mean.append(power / np.maximum(count, 1.0))
            alone.append(power - 2.0 * mean[-1] * taken)
            freedom.append(count - taken)
        spread = [  # of the estimates, by the noise of each run
            w**2 * np.einsum("cb,bij->cij", m, p)
            for w, m, p in zip(weights, mean, products, strict=True)
        ]
        back = [np.einsum("bij,scij->scb", p, np.stack(spread)) for p in products]
        own = [np.maximum(one + back[k][k], 0.0) for k, one in enumerate(alone)]
        return cls(own, back, freedom, [b.harmonic for b in bins])

    def shared(self, power: Sequence[np.ndarray]) -> Bins:
        """All bins, where runs share their variances."""
        total = [
            one + b.sum(axis=0) - b[k]
            for k, (one, b) in enumerate(zip(self.own, self.back, strict=True))
        ]
        return self._bins(power, total, range(len(total)), [np.zeros(f.size) for f in self.freedom])

    def alone(self, power: Sequence[np.ndarray], run: int, variance: np.ndarray) -> Bins:
        """The bins of one run, where the others have the variances `variance`."""
        own = [self.own[run]]
        return self._bins([power[run]], own, [run], [self.of_others(run, variance)])

    def of_others(
        self, run: int, variance: Float[np.ndarray, "runs processes"]
    ) -> Float[np.ndarray, " bins"]:
        """What the noise of other runs leaves in one, through the parameters."""
        others = np.arange(variance.shape[0]) != run
        return np.einsum("sc,scb->b", variance[others], self.back[run][others])

    def _bins(
        self,
        power: Sequence[np.ndarray],
        expected: Sequence[np.ndarray],
        runs: Sequence[int],
        known: Sequence[np.ndarray],
    ) -> Bins:
        freedom = [self.freedom[k] for k in runs]
        found = Bins(
            np.concatenate(power),
            np.concatenate(expected, axis=1),
            np.concatenate(known),
            np.concatenate(freedom),
            np.concatenate([np.full(f.size, k) for k, f in zip(runs, freedom, strict=True)]),
            np.concatenate([self.harmonic[k] for k in runs]),
            len(self.own),
        )
        return found.pick(found.freedom > THRESHOLDS.least_freedom)
