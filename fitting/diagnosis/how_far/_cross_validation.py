"""Cross-validation of effects: rates, amplitudes and last periods are held out in turn.

Both models, with the effect and without, are refitted to what remains, from their full fits. Parts
that what remains does not determine are listed, and say nothing.
"""

import dataclasses
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel

from ._bootstrap import closed_fraction
from ._held_out import Fold, FullRefit, folds
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class CrossValidation:
    """Errors before and after on all that was held out, and each part's closed fraction.

    `parts` lists those that are not determined, too; they take no part in anything else.
    """

    parts: list[dict]
    before: list[np.ndarray]
    after: list[np.ndarray]
    blocks: list[PeriodBlock]
    closed: dict[str, float] | None

    def rms(self, own_origin: bool) -> tuple[float, float]:
        """Errors before and after."""
        return rms(self.before, own_origin), rms(self.after, own_origin)


def cross_validate(
    whitened: WhitenedModel,
    none: tuple[Refit, State],
    candidates: Sequence[tuple[Refit, State]],
    progress: Callable[[str], None] = lambda line: None,
) -> list[CrossValidation | None]:
    """The closed fraction of each candidate, part by part; `None` where nothing can be held.

    `none`: the base without them, refitted once for each part.
    """
    parts = folds(whitened)

    before = FullRefit(*none)

    @cache
    def without(fold: Fold) -> list[np.ndarray] | None:
        return before.held_out_errors(fold)

    return [
        _validate(whitened, parts, without, FullRefit(*candidate), progress)
        for candidate in candidates
    ]


def _validate(
    whitened: WhitenedModel,
    parts: Sequence[Fold],
    without: Callable[[Fold], list[np.ndarray] | None],
    candidate: FullRefit,
    progress: Callable[[str], None],
) -> CrossValidation | None:
    before: list[np.ndarray] = []
    after: list[np.ndarray] = []
    held: list[PeriodBlock] = []
    rows = []
    spectrum, own = candidate.refit.whitener.spectrum, whitened.own_origin
    for fold in parts:
        if not _has_enough_data(fold, candidate.state):
            continue
        progress(f"held out: {fold.name}")
        old = without(fold)
        new = None if old is None else candidate.held_out_errors(fold)
        if old is None or new is None:
            rows.append(_row(fold, None, None, None))
            continue
        rows.append(
            _row(fold, rms(old, own), rms(new, own), _closed(old, new, fold.held, spectrum, own))
        )
        before, after = before + old, after + new
        held = held + fold.held
    if not held:
        return None
    closed = _closed(before, after, held, spectrum, own)
    return CrossValidation(rows, before, after, held, closed)


def _row(
    fold: Fold, before: float | None, after: float | None, closed: dict[str, float] | None
) -> dict:
    return {
        "part": fold.name,
        "determined": before is not None,
        "before": before,
        "after": after,
        "closed_fraction": closed,
    }


def _closed(
    before: list[np.ndarray],
    after: list[np.ndarray],
    held: list[PeriodBlock],
    spectrum: Spectrum,
    own: bool,
) -> dict[str, float] | None:
    if spectrum.measured:
        return closed_fraction(before, after, held, spectrum, own_origin=own)
    return _closed_at_least(before, after, own)


def _closed_at_least(
    before: list[np.ndarray], after: list[np.ndarray], own: bool
) -> dict[str, float] | None:
    """The same where noise is unknown: with none taken off, so the value is a lower bound.

    The interval is that of resampled segments of the runs, made twice as wide.
    """
    segments = []
    for b, a in zip(before, after, strict=True):
        shift = (b.mean(), a.mean()) if own else (0.0, 0.0)
        parts = zip(
            np.array_split((b - shift[0]).ravel(), THRESHOLDS.segments),
            np.array_split((a - shift[1]).ravel(), THRESHOLDS.segments),
            strict=True,
        )
        segments += [(float(p @ p), float(q @ q)) for p, q in parts]
    power = np.array(segments)
    if not power[:, 0].sum() > 0:
        return None
    value = 1.0 - float(power[:, 1].sum() / power[:, 0].sum())
    rng = np.random.default_rng(0)
    drawn = power[rng.integers(0, len(power), (THRESHOLDS.segment_draws, len(power)))].sum(axis=1)
    low, high = np.quantile(1.0 - drawn[:, 1] / drawn[:, 0], [0.025, 0.975])
    return {
        "value": value,
        "low": value - THRESHOLDS.unknown_noise_widening * max(value - float(low), 0.0),
        "high": min(value + THRESHOLDS.unknown_noise_widening * max(float(high) - value, 0.0), 1.0),
    }


def _has_enough_data(fold: Fold, state: State) -> bool:
    seen = sum(b.left.shape[1] for b, use in zip(fold.seen, fold.use, strict=True) if use)
    return bool(fold.use.any() and seen > THRESHOLDS.samples_per_value * state.values.size)


def rms(errors: list[np.ndarray], own_origin: bool) -> float:
    """Root mean square over all runs; with `own_origin` about each run's mean."""
    if own_origin:
        errors = [e - e.mean() for e in errors]
    return float(np.sqrt(np.mean(np.concatenate([e.ravel() for e in errors]) ** 2)))
