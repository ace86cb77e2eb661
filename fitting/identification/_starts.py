"""Several starts: where the solver begins, and whether the ends agree."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.solver._identifiability import unidentifiable
from rapi_jax import ECDL, RAPI, AbstractOperator, GeneralRAPI, Recording
from rapi_jax._parameter import follow

from ._problem import Problem, Solution

_EACH = ("alpha", "lam", "eta")
# Two ends agree where their predictions differ by this share of the rms residual: a tenth where the
# residual is white noise, more where it is correlated, since then the model is wrong by about as
# much anyway and near-equal ends are the rule.
_AGREE, _AGREE_MISFIT = 0.1, 0.25
_GUESSES = 8
_SHAKES = 4
# Where the model is wrong in ways that repeat, the plays' kinks make many near-equal ends: so many
# jumps are made, by turns from plays that are all alike, by these sizes (standard deviations of
# logarithms), and from the best end so far. There two plays jump and the others stay, by logarithms
# in this range: over four sets of seeds that ends lower on average than shaking all a little.
_JUMPS = 24
_SIZES = (0.1, 0.2, 0.3)
_PLAYS, _LEAP = 2, (0.2, 1.0)
_WRONG = 0.3  # correlation of neighbouring residuals


@dataclasses.dataclass(frozen=True)
class Start:
    """One start and its end: `origin` says where it came from."""

    origin: str
    steps: int
    cost: float
    converged: bool
    agrees: bool  # with the best end
    trace: tuple[tuple[int, float], ...]


def candidates(
    ecdl: ECDL, recording: Recording, count: int, guess: bool | Sequence[ECDL] = True
) -> Iterator[tuple[str, ECDL]]:
    """Models of the shape of `ecdl` to start from: the best guess, the model given, more guesses.

    Operators that cannot guess are started from the model given and from copies of it with every
    parameter changed by up to a factor of 1.5. `guess` may also be the guesses.
    """
    operator = ecdl.operator
    if not isinstance(guess, bool):
        models = list(guess)
    elif guess and isinstance(operator, RAPI | GeneralRAPI):
        each = [name for name in _EACH if jnp.ndim(follow(operator, (name,))) > 0]
        guesses = RAPI.guesses(
            recording, plays=operator.count, order=operator.d.size, each=each, count=_GUESSES
        )
        models = [ECDL(_like(operator, guess), ecdl.effects) for guess in guesses]
    else:
        models = []
    given = [("given", ecdl)]
    found = [(f"guess {i + 1}", model) for i, model in enumerate(models)]
    yield from [*found[:1], *given, *found[1:]][:count]
    for i in range(max(count - len(found) - 1, 0)):
        yield f"given, changed {i + 1}", _changed(ecdl, i)


def _like(operator: RAPI | GeneralRAPI, guess: RAPI) -> RAPI | GeneralRAPI:
    """`guess` as an operator of the kind and the shape of `operator`."""
    weights = jnp.broadcast_to(guess.a, operator.a.shape)
    guess = eqx.tree_at(lambda o: o.a, guess, weights)
    return guess if isinstance(operator, RAPI) else GeneralRAPI.of(guess, u_0=operator.u_0)


def _changed(ecdl: ECDL, seed: int) -> ECDL:
    rng = np.random.default_rng(seed)

    def change(leaf):
        return leaf * jnp.asarray(1.5 ** rng.uniform(-1.0, 1.0, leaf.shape))

    return jax.tree_util.tree_map(change, ecdl)


def _shaken(problem: Problem, vector: np.ndarray, seed: int, size: float = 0.05) -> np.ndarray:
    out = vector.copy()
    n = problem.vector.size
    factor = np.exp(size * np.random.default_rng(seed).standard_normal(n))
    out[:n] *= np.where(problem.free, factor, 1.0)
    return out


def _leapt(problem: Problem, vector: np.ndarray, groups: np.ndarray, seed: int) -> np.ndarray:
    """`vector` with what two plays have of their own (see `shared`) made larger or smaller."""
    rng = np.random.default_rng(seed)
    out = vector.copy()
    for group in np.unique(groups):
        members = np.flatnonzero((groups == group) & problem.free)
        if members.size > _PLAYS:
            some = rng.choice(members, size=_PLAYS, replace=False)
            out[some] *= np.exp(rng.choice([-1.0, 1.0], _PLAYS) * rng.uniform(*_LEAP, _PLAYS))
    return out


def shared(operator: AbstractOperator, problem: Problem) -> np.ndarray | None:
    """Groups that tie each vector of play parameters to one value; `None` where there is none."""
    vector = problem.vector
    groups = np.arange(vector.size)
    for part, at in zip(vector.parts, vector.slices, strict=True):
        if part.name in _EACH and part.shape and isinstance(operator, RAPI | GeneralRAPI):
            groups[at] = at.start
    return None if (groups == np.arange(groups.size)).all() else groups


def averaged(problem: Problem, vector: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """`vector` with every group at its mean, as a tied fit needs it."""
    out = vector.copy()
    n = problem.vector.size
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        if problem.free[members].all():
            out[:n][members] = vector[:n][members].mean()
    return out


def _cost(end: Solution) -> float:
    return end.cost


def _correlation(rows: np.ndarray) -> float:
    """Correlation of neighbouring residuals, 0 where negative; rows are runs."""
    power = float(np.sum(rows[:, :-1] ** 2))
    return max(float(np.sum(rows[:, 1:] * rows[:, :-1])) / power, 0.0) if power > 0 else 0.0


def agree(problem: Problem, weight: np.ndarray, one: Solution, other: Solution) -> bool:
    """Whether two ends are the same model, judged by what they predict where it was fitted."""
    difference = np.linalg.norm(weight * (one.error - other.error))
    residual = np.sqrt(2.0 * min(one.cost, other.cost))
    share = _AGREE + _AGREE_MISFIT * _correlation(weight * min(one, other, key=_cost).error)
    scale = np.linalg.norm(weight * (problem.data.y - problem.data.y[weight > 0].mean()))
    return bool(difference <= max(share * residual, 1e-6 * scale))


def tilted(problem: Problem, vector: np.ndarray, groups: np.ndarray, by: float) -> np.ndarray:
    """`vector` with `lam` growing from the narrowest play to the widest, by `4**by` in all."""
    out = vector.copy()
    at = [i for i, name in enumerate(problem.vector.names) if name.startswith("lam_")]
    if at and groups[at[-1]] == at[0]:
        out[at] *= 2.0 ** (by * np.linspace(-1.0, 1.0, len(at)))
    return out


def search_starts(
    problem: Problem,
    weight: np.ndarray,
    count: int,
    *,
    guess: bool | Sequence[ECDL] = True,
    enough: int = 2,
    **options: Any,
) -> tuple[Solution, list[Start]]:
    """Fit from up to `count` starts, until `enough` of them have ended in the best end.

    A model with a value for each play is first fitted with one value for all, then let go, once as
    it is and once with its plays unequal: the wide basin first, the fine valleys after. Where the
    residuals repeat, jumps look for a better one among many that are near equal,
    but not for one in which plays have lost their say.
    Where no two ends agree, the best is shaken a few times, which counts as starts nearby.
    """
    groups = shared(problem.ecdl.operator, problem)
    ends: list[tuple[str, Solution]] = []
    begun: list[np.ndarray] = []
    tied = np.zeros(0)

    def settled() -> bool:
        best = min((end for _, end in ends), key=_cost)
        return sum(agree(problem, weight, best, end) for _, end in ends) >= enough

    for origin, model in candidates(problem.ecdl, problem.recording, count, guess):
        start = problem.start(model)
        if any(np.allclose(start, other, rtol=1e-3, atol=0.0) for other in begun):
            continue  # a start that was made already proves nothing
        begun.append(start)
        tilts = {"": 0.0}
        if groups is not None:
            full = np.concatenate([groups, np.arange(groups.size, problem.own_size)])
            start = problem.solve(averaged(problem, start, groups), weight, full, **options).values
            tied = start
            tilts["tilted"] = 1.0
        found = []
        for name, by in tilts.items():
            begin = start if groups is None else tilted(problem, start, groups, by)
            found.append((f"{origin} {name}".strip(), problem.solve(begin, weight, **options)))
        ends.append(min(found, key=lambda pair: pair[1].cost))
        if settled():
            break
    best = min((end for _, end in ends), key=_cost)
    if count > 1 and groups is not None and _correlation(weight * best.error) > _WRONG:
        sound, jumps = not unidentifiable(problem, best), []
        for jump in range(_JUMPS):
            if jump % 2:
                begin = _leapt(problem, best.values, groups, jump)
            else:
                begin = _shaken(problem, tied, jump, _SIZES[jump // 2 % len(_SIZES)])
            end = problem.solve(begin, weight, **options)
            jumps.append((f"jump {jump + 1}", end))
            if end.cost < best.cost and not (sound and unidentifiable(problem, end)):
                best = end
        ends += [
            (name, end)
            for name, end in jumps
            if end.cost >= best.cost and agree(problem, weight, best, end)
        ]
    for shake in range(_SHAKES):
        if settled() or count == 1:
            break
        best = min((end for _, end in ends), key=_cost)
        begin = _shaken(problem, best.values, shake)
        ends.append((f"best, shaken {shake + 1}", problem.solve(begin, weight, **options)))
    best = min((end for _, end in ends), key=_cost)
    starts = [
        Start(
            origin,
            end.solver.steps,
            end.cost,
            end.solver.converged,
            agree(problem, weight, best, end),
            end.solver.trace,
        )
        for origin, end in ends
    ]
    return best, starts
