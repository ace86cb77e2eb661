"""Multi-start search: where the solver begins, and whether the ends agree."""

import dataclasses
from collections.abc import Iterator, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, AbstractOperator, Parameter, Recording, parameters
from rapi_jax.internal import follow

from ._thresholds import THRESHOLDS
from .assessment._convergence import unidentifiable
from .assessment._ends import Start, agree, correlation, rank_ends, settled
from .problem._problem import Problem, Solution


@dataclasses.dataclass(frozen=True, eq=False)
class Guesses:
    """First guesses from a recording, for a fit that begins with the best of them.

    Making them takes a third of a fit's time at 4 x 1000 samples. They are of that recording alone:
    a fit that leaves readings out makes new ones.
    """

    recording: Recording
    size: tuple[int, int, frozenset[str]]  # plays, order, parameters with a value for each play
    operators: Sequence[AbstractOperator]

    @classmethod
    def of(
        cls,
        operator: type[AbstractOperator],
        recording: Recording,
        *,
        plays: int,
        order: int,
        each: Sequence[str],
    ) -> "Guesses":
        """The best few of an operator's class."""
        found = operator.initial_guesses(
            recording, plays=plays, order=order, each=each, count=THRESHOLDS.guesses
        )
        return cls(recording, (plays, order, frozenset(each)), found)


def candidates(
    ecdl: ECDL, recording: Recording, count: int, guess: bool | Sequence[ECDL] | Guesses = True
) -> Iterator[tuple[str, ECDL]]:
    """Models of the shape of `ecdl` to start from: the best guess, the model given, more guesses.

    Operators that cannot guess are started from the model given and from copies of it with every
    parameter changed by up to a factor of 1.5. `guess` may also be models to use as guesses, or
    guesses made before, which count where they are of this recording and size.
    """
    operator, origin = ecdl.operator, held_origin(ecdl.operator)
    if isinstance(guess, Sequence):
        models = list(guess)
    elif guess is False:
        models = []
    else:
        each = [name for name in operator.tied_first if jnp.ndim(follow(operator, (name,))) > 0]
        plays, order = operator.count, operator.coefficients.size
        zero = 0.0 if origin is None else float(follow(operator, origin.path))
        counted = count_from(recording, zero)
        known = guess if isinstance(guess, Guesses) and guess.recording is counted else None
        if known is None or known.size != (plays, order, frozenset(each)):
            known = Guesses.of(type(operator), counted, plays=plays, order=order, each=each)
        models = [ECDL(_like(operator, one), ecdl.effects) for one in known.operators]
    given = [("given", ecdl)]
    found = [(f"guess {i + 1}", model) for i, model in enumerate(models)]
    yield from [*found[:1], *given, *found[1:]][:count]
    for i in range(max(count - len(found) - 1, 0)):
        yield f"given, changed {i + 1}", _changed(ecdl, i)


def held_origin(operator: AbstractOperator) -> Parameter | None:
    """The operator's origin of the drive, where a fit holds it as it is given."""
    found = [p for p in parameters(operator) if p.held and p.name == operator.fields.origin]
    return found[0] if found else None


def count_from(recording: Recording, origin: float) -> Recording:
    """`recording` with its drives counted from `origin`."""
    if origin == 0.0:
        return recording
    runs = [
        dataclasses.replace(
            run, drive=dataclasses.replace(run.drive, value=run.drive.value - origin)
        )
        for run in recording.runs
    ]
    return dataclasses.replace(recording, runs=tuple(runs))


def _like(operator: AbstractOperator, guess: AbstractOperator) -> AbstractOperator:
    """`guess` in the shapes of `operator`, of the same class, with its values of what is held."""
    found = parameters(operator)
    values = [
        jnp.broadcast_to(follow(operator if p.held else guess, p.path), p.shape) for p in found
    ]
    return eqx.tree_at(lambda o: [follow(o, p.path) for p in found], guess, values)


def _changed(ecdl: ECDL, seed: int) -> ECDL:
    rng = np.random.default_rng(seed)

    def change(leaf):
        return leaf * jnp.asarray(THRESHOLDS.start_change ** rng.uniform(-1.0, 1.0, leaf.shape))

    return jax.tree_util.tree_map(change, ecdl)


def perturb(problem: Problem, vector: np.ndarray, seed: int, size: float) -> np.ndarray:
    """`vector` with every free parameter changed at random, by `size` in its logarithm."""
    out = vector.copy()
    n = problem.vector.size
    factor = np.exp(size * np.random.default_rng(seed).standard_normal(n))
    out[:n] *= np.where(problem.free, factor, 1.0)
    return out


def _perturb_plays(
    problem: Problem, vector: np.ndarray, groups: np.ndarray, seed: int
) -> np.ndarray:
    """`vector` with the own values of two plays (see `tied_groups`) made larger or smaller."""
    rng, plays = np.random.default_rng(seed), THRESHOLDS.jump_plays
    limits = THRESHOLDS.jump_least, THRESHOLDS.jump_most
    out = vector.copy()
    for group in np.unique(groups):
        members = np.flatnonzero((groups == group) & problem.free)
        if members.size > plays:
            some = rng.choice(members, size=plays, replace=False)
            out[some] *= np.exp(rng.choice([-1.0, 1.0], plays) * rng.uniform(*limits, plays))
    return out


def tied_groups(operator: AbstractOperator, problem: Problem) -> np.ndarray | None:
    """Groups that tie each vector of play parameters to one value; `None` where there is none."""
    vector = problem.vector
    groups = np.arange(vector.size)
    for part, at in zip(vector.parts, vector.slices, strict=True):
        if part.name in operator.tied_first and part.shape:
            groups[at] = at.start
    return None if (groups == np.arange(groups.size)).all() else groups


def average_groups(problem: Problem, vector: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """`vector` with every group at its mean, as a tied fit needs it."""
    out = vector.copy()
    n = problem.vector.size
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        if problem.free[members].all():
            out[:n][members] = vector[:n][members].mean()
    return out


def grade_lam(problem: Problem, vector: np.ndarray, groups: np.ndarray, by: float) -> np.ndarray:
    """`vector` with `lam` growing from the narrowest play to the widest, by `4**by` in all."""
    out = vector.copy()
    at = [i for i, name in enumerate(problem.vector.names) if name.startswith("lam_")]
    if at and groups[at[-1]] == at[0]:
        out[at] *= 2.0 ** (by * np.linspace(-1.0, 1.0, len(at)))
    return out


def _cost(end: Solution) -> float:
    return end.cost


def search_starts(
    problem: Problem,
    weight: np.ndarray,
    count: int,
    options: SolverOptions,
    *,
    guess: bool | Sequence[ECDL] | Guesses = True,
) -> tuple[Solution, list[Start]]:
    """Fit from up to `count` first guesses, until enough of them have reached the best end.

    Starts beside an end found before come on top of `count`, and are marked `nearby`. Where the
    residuals repeat and plays have values of their own, 24 jumps from the best end look for a
    better one among many that are near equal; those that agree with the best are kept. Where no
    two ends agree, the best is perturbed up to four times.
    """
    groups = tied_groups(problem.ecdl.operator, problem)
    ends, tied = _fit_candidates(problem, weight, count, options, guess, groups)
    first = len(ends)
    best = min((end for _, end in ends), key=_cost)
    wrong = correlation(weight * best.error) > THRESHOLDS.misfit_correlation
    if count > 1 and groups is not None and wrong:
        ends += _jump(problem, weight, best, tied, groups, options)
    for trial in range(THRESHOLDS.perturbations):
        if count == 1 or settled(problem, weight, ends):
            break
        best = min((end for _, end in ends), key=_cost)
        begin = perturb(problem, best.start, trial, THRESHOLDS.perturbation)
        ends.append((f"best, shaken {trial + 1}", problem.solve(begin, weight, options)))
    return rank_ends(problem, weight, ends, nearby=len(ends) - first)


def _fit_candidates(
    problem: Problem,
    weight: np.ndarray,
    count: int,
    options: SolverOptions,
    guess: bool | Sequence[ECDL] | Guesses,
    groups: np.ndarray | None,
) -> tuple[list[tuple[str, Solution]], np.ndarray]:
    """Named ends of the candidates until enough agree, and the last vector with tied plays.

    A model with a value for each play is first fitted with one value for all, then with all free,
    once as it is and once with its plays unequal: the wide basin first, the fine valleys after.
    """
    ends: list[tuple[str, Solution]] = []
    begun: list[np.ndarray] = []
    tied = np.zeros(0)
    for origin, model in candidates(problem.ecdl, problem.recording, count, guess):
        start = problem.start(model)
        if any(np.allclose(start, other, rtol=THRESHOLDS.same_start, atol=0.0) for other in begun):
            continue
        begun.append(start)
        gradings = {"": 0.0}
        if groups is not None:
            ties = np.concatenate([groups, np.arange(groups.size, problem.own_size)])
            averaged = average_groups(problem, start, groups)
            start = problem.solve(averaged, weight, options, ties=ties).start
            tied = start
            gradings["tilted"] = 1.0
        found = []
        for name, by in gradings.items():
            begin = start if groups is None else grade_lam(problem, start, groups, by)
            found.append((f"{origin} {name}".strip(), problem.solve(begin, weight, options)))
        ends.append(min(found, key=lambda pair: pair[1].cost))
        if settled(problem, weight, ends):
            break
    return ends, tied


def _jump(
    problem: Problem,
    weight: np.ndarray,
    best: Solution,
    tied: np.ndarray,
    groups: np.ndarray,
    options: SolverOptions,
) -> list[tuple[str, Solution]]:
    """Ends of jumps that agree with the best: by turns from tied plays and from the best end.

    An end in which parameters are no longer identifiable does not become the best.
    """
    sizes = THRESHOLDS.jump_small, THRESHOLDS.jump_medium, THRESHOLDS.jump_large
    identifiable, jumps = not unidentifiable(problem, best), []
    for jump in range(THRESHOLDS.jumps):
        if jump % 2:
            begin = _perturb_plays(problem, best.start, groups, jump)
        else:
            begin = perturb(problem, tied, jump, sizes[jump // 2 % len(sizes)])
        end = problem.solve(begin, weight, options)
        jumps.append((f"jump {jump + 1}", end))
        if end.cost < best.cost and not (identifiable and unidentifiable(problem, end)):
            best = end
    return [
        (name, end)
        for name, end in jumps
        if end.cost >= best.cost and agree(problem, weight, best, end)
    ]
