"""How well a model predicts what it was not fitted to: periods, scan rates, amplitudes."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem, Solution
from fitting.identification.robust._reweighting import Reweighting
from fitting.solver._least_squares import SolverOptions
from rapi_jax import Drive, Recording

KINDS = ("last third", "rate", "swing", "run")


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """One scheme: what was left out of the fit, and the error on it.

    `rmse` and `std` (about each run's mean error) are in the response's unit, over the samples left
    out; `fraction` is `rmse` over their span. `train_rmse` is the rmse on what the fit did see.
    Where `origin_from_data` is true a run left out has an origin of its own, taken from its mean.
    `runs`: which runs were left out as a whole. `inside`: whether the others enclose them in rate
    and swing.
    """

    scheme: str
    rmse: float
    std: float
    fraction: float
    train_rmse: float
    samples: int
    origin_from_data: bool = False
    runs: tuple[int, ...] = ()
    inside: bool = True

    def usual(self, noise: float) -> float:
        """The error of the part that was fitted, noise at least."""
        return max(self.train_rmse, noise)

    def exceeds(self, noise: float, span: float) -> bool:
        """Whether the error is more than that of the fitted part and rounding explain."""
        limits = THRESHOLDS.generalisation * self.usual(noise) + THRESHOLDS.exact_fit * span
        return self.rmse > limits

    @property
    def determined(self) -> bool:
        """Whether the part that was fitted determines the model where the other was left out.

        An error of more than the whole span there is no prediction.
        """
        return not self.fraction > THRESHOLDS.undetermined

    @property
    def large(self) -> bool:
        """Whether the error is large beside the span of what was left out."""
        return self.fraction > THRESHOLDS.held_out_error


def no_run_is_predicted(held_out: Sequence[HeldOut], noise: float, span: float) -> bool:
    """Whether of several runs that were left out one by one the others predict none."""
    alone = [scheme for scheme in held_out if len(scheme.runs) == 1]
    return len(alone) > 1 and all(s.large and s.exceeds(noise, span) for s in alone)


def last_third(recording: Recording, problem: Problem) -> np.ndarray:
    """The samples, "runs time", of the last third of each run's periods.

    Of a run that does not repeat, or holds one period only, the last third of the samples.
    """
    out = np.zeros_like(problem.data.use)
    for row, run in enumerate(recording.runs):
        sample = problem.data.sample[row]
        inside = sample >= 0
        periods = run.drive.periods
        if periods >= 2:
            first = periods - max(1, round(periods / 3))
            out[row, inside] = run.drive.period[sample[inside]] >= first
        else:
            used = np.flatnonzero(problem.data.use[row])
            out[row, used[(2 * used.size) // 3 :]] = True
    return out & problem.data.use


def schemes(recording: Recording, problem: Problem) -> Iterator[tuple[str, np.ndarray, bool]]:
    """Name, held-out samples, and whether whole runs are left out, for each scheme that applies."""
    yield "last third", last_third(recording, problem), False
    rates = [run.drive.rate for run in recording.runs]
    if len(set(rates)) > 1:
        for rate in sorted(set(rates)):
            rows = np.array([r == rate for r in rates])
            yield f"rate {rate:g} Hz", problem.data.use & rows[:, None], True
    levels = np.array(recording.amplitudes)
    if levels.size > 1:
        nearest = [int(np.abs(levels - run.drive.u_pp).argmin()) for run in recording.runs]
        for i, level in enumerate(levels):
            rows = np.array([k == i for k in nearest])
            name = f"swing {level:.4g} {recording.drive_unit}"
            yield name, problem.data.use & rows[:, None], True
    if len(recording.runs) > 1:
        for row, run in enumerate(recording.runs):
            alone = np.arange(len(recording.runs)) == row
            yield f"run {run.name}", problem.data.use & alone[:, None], True


def _encloses(recording: Recording, rows: tuple[int, ...]) -> bool:
    """Whether rates and amplitudes of the runs `rows` lie between those of the others."""
    drives = recording.drives
    others = [drive for row, drive in enumerate(drives) if row not in rows]
    if not others:
        return False

    def between(of: Callable[[Drive], float], slack: float) -> bool:
        low, high = min(map(of, others)), max(map(of, others))
        return all(low / slack <= of(drives[row]) <= high * slack for row in rows)

    return between(lambda d: d.rate, 1.0) and between(lambda d: d.u_pp, THRESHOLDS.same_swing)


def cross_validate(
    problem: Problem,
    run_weights: np.ndarray,
    full: Solution,
    kinds: tuple[str, ...] = KINDS,
    *,
    options: SolverOptions,
    reweighting: Reweighting | None = None,
) -> list[HeldOut]:
    """Refit without each part, from the full fit's parameters, and predict it.

    `reweighting`: weights of the readings beside those of the runs, also of the errors in the end.
    """
    results = []
    done: set[bytes] = set()
    for name, left, whole in schemes(problem.recording, problem):
        if not name.startswith(kinds) or left.tobytes() in done:
            continue
        done.add(left.tobytes())
        seen = problem.data.use & ~left
        if not left.any() or seen.sum() <= problem.free_count:
            continue
        weight = problem.weights(run_weights, seen)
        if reweighting is not None:
            weight = weight * np.sqrt(reweighting.share)
        solution = problem.solve(full.start, weight, options)
        error = solution.error if reweighting is None else reweighting.judged(solution.error)
        one = score(problem, error, name, left, seen, whole and problem.own_origin)
        if whole:
            rows = tuple(np.flatnonzero(left.any(axis=1)).tolist())
            one = dataclasses.replace(one, runs=rows, inside=_encloses(problem.recording, rows))
        results.append(one)
    return results


def score(
    problem: Problem, error: np.ndarray, name: str, left: np.ndarray, seen: np.ndarray, own: bool
) -> HeldOut:
    """What is said of `error` on the samples `left`; with `own`, about each run's mean error."""
    rows = [row for row in range(left.shape[0]) if left[row].any()]
    centred = np.concatenate([error[r, left[r]] - error[r, left[r]].mean() for r in rows])
    plain = centred if own else error[left]
    span = max(float(np.ptp(problem.data.y[r, left[r]])) for r in rows)
    rmse = float(np.sqrt(np.mean(plain**2)))
    return HeldOut(
        scheme=name,
        rmse=rmse,
        std=float(np.sqrt(np.mean(centred**2))),
        fraction=rmse / span if span > 0 else float("nan"),
        train_rmse=float(np.sqrt(np.mean(error[seen] ** 2))),
        samples=int(left.sum()),
        origin_from_data=own,
    )
