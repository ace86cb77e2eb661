"""The exact inverse of a monotone operator: the drive whose response is the one asked for.

Given its past, an operator's response is an increasing function of the drive's next sample (see
`certificate`), so each sample of the drive is one scalar root, found causally in a scan. The
thresholds of Eq. 11 depend on the drive's own peak-to-peak value and Eq. 13 on its minimum; both
follow from the extremes of the target alone, since whatever came between, at its largest
drive each play rests on its rising bound or where the minimum left it.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Bool, Float

from rapi_jax._arguments import takes
from rapi_jax._precision import as_float64, float64
from rapi_jax.operators import AbstractOperator, Plays
from rapi_jax.plays._monotone_stretches import Stretches, find_stretches

from ._inverse_on_stretches import attach_samples, solve_samples
from ._root import Scalar, attach, root, search
from ._thresholds import THRESHOLDS


def _memoryless(operator: AbstractOperator, u: Scalar) -> Scalar:
    return operator.memoryless(u[None])[0]


def _error(u: Scalar, args: Any) -> Scalar:
    operator, plays, state, wanted = args
    return (
        plays.p @ plays.clamped(operator.centred(u), state) + _memoryless(operator, u) - wanted
    )  # Eq. (16)


def at_minimum(operator: AbstractOperator, u: Scalar, plays: Plays) -> Scalar:
    """The response at the drive's minimum, all plays as Eq. 13 has them."""
    return plays.p @ plays.lowest(operator.centred(u)) + _memoryless(operator, u)


def at_maximum(operator: AbstractOperator, u: Scalar, u_min: Scalar, plays: Plays) -> Scalar:
    """The response at the drive's maximum in a run whose minimum is `u_min`."""
    start = plays.lowest(operator.centred(u_min))
    return plays.p @ plays.clamped(operator.centred(u), start) + _memoryless(operator, u)


def _minimum_residual(u: Scalar, args: Any) -> Scalar:
    operator, plays, y_min, sign = args
    return sign * (at_minimum(operator, u, plays) - y_min)


def _drive_minimum(u_pp: Scalar, args: Any) -> Scalar:
    """The drive's minimum in a run of peak-to-peak `u_pp`, or an end of the range.

    Where `sign` is -1: with weights of both signs the response at the minimum may fall as the
    minimum rises, although every scan rises from there, since Eq. 13 moves all plays with it.
    """
    operator, y_min, _, freq, low, high, ratio, sign = args
    given = operator, operator.plays(ratio * u_pp, freq), y_min, sign
    fixed = jax.lax.stop_gradient(given)
    grid = jnp.linspace(low, high, THRESHOLDS.minimum_grid)
    below = jax.vmap(lambda u: _minimum_residual(u, fixed))(grid) < 0
    place = jnp.argmax(below[:-1] & ~below[1:])
    falling = sign < 0
    low, high = (jnp.where(falling, grid[k], x) for k, x in ((place, low), (place + 1, high)))
    return root(_minimum_residual, given, low, high, (low + high) / 2)


def _maximum_residual(u_pp: Scalar, args: Any) -> Scalar:
    operator, y_min, y_max, freq, low, high, ratio, _ = args
    u_min, plays = _drive_minimum(u_pp, args), operator.plays(ratio * u_pp, freq)
    # Outside the range, where the operator may turn over, it is continued more steeply than it is.
    ends = (plays.falling(operator.centred(u)) for u in (low, high))
    steepest = jnp.sum(jnp.abs(plays.p) * (1.0 + jnp.maximum(*ends)))
    rise = (y_max - y_min) / (high - low) + 2.0 * steepest
    u_max = jnp.minimum(u_min + u_pp, high)
    beyond = (u_min + u_pp - u_max) * rise - (at_minimum(operator, u_min, plays) - y_min)
    return at_maximum(operator, u_max, u_min, plays) + beyond - y_max


def _is_feasible(u_pp: Scalar, args: Any) -> Bool[Array, ""]:
    """Whether the drive stays in its range, and the minimum has a drive at all."""
    operator, y_min, y_max, freq, _, high, ratio, _ = args
    u_min = _drive_minimum(u_pp, args)
    off = jnp.abs(at_minimum(operator, u_min, operator.plays(ratio * u_pp, freq)) - y_min)
    return (u_min + u_pp <= high) & (off <= 1e-9 * (y_max - y_min))


def _smallest_zero(f: Any, holds: Any, args: Any, widest: Scalar) -> tuple[Scalar, Bool[Array, ""]]:
    """The smallest `u_pp` up to `widest` where `f` is zero and `holds`, and whether there is one.

    Thresholds that grow with `u_pp` can make `f` rise and fall, so it need not be increasing. No
    derivative.
    """
    args, widest = jax.lax.stop_gradient((args, widest))
    grid = widest * jnp.linspace(1e-9, 1.0, THRESHOLDS.swing_grid)
    values = jax.vmap(lambda u_pp: f(u_pp, args))(grid)
    crossing = (values[:-1] <= 0) != (values[1:] <= 0)
    (places,) = jnp.nonzero(
        crossing, size=THRESHOLDS.swing_crossings, fill_value=THRESHOLDS.swing_grid - 2
    )

    def signed(u_pp: Scalar, args: Any) -> Scalar:
        return args[0] * f(u_pp, args[1])

    def at(place: Any) -> tuple[Scalar, Any]:
        sign = jnp.where(values[place + 1] >= values[place], 1.0, -1.0)
        low, high = grid[place], grid[place + 1]
        u_pp = search(signed, (sign, args), low, high, (low + high) / 2)
        return u_pp, holds(u_pp, args)

    found, good = jax.lax.map(at, places)
    return found[jnp.argmax(good)], jnp.any(good)


@eqx.filter_jit
def extremes(
    operator: AbstractOperator,
    y_min: Scalar,
    y_max: Scalar,
    freq: Scalar,
    low: Scalar,
    high: Scalar,
    ratio: Scalar,
) -> tuple[Scalar, Scalar]:
    """Smallest and largest drive of a run whose response goes from `y_min` to `y_max`.

    The fixed point on `u_pp` of Eq. 11, as one scalar root. Looked for in `[low, high]`; where
    there is none, somewhere in it. `ratio`: see `drive_range_for_span`.
    """
    given = (operator, y_min, y_max, freq, low, high, ratio)
    fixed = jax.lax.stop_gradient(given)

    def go_on(state):
        attempts, _, _, found = state
        return ~found & (attempts < 2)

    def attempt(state):  # a loop, so that both signs are one program: half as long to compile
        attempts, _, _, _ = state
        sign = jnp.where(attempts == 0, 1.0, -1.0)
        args = (*fixed, sign)
        u_pp, found = _smallest_zero(_maximum_residual, _is_feasible, args, fixed[5] - fixed[4])
        return attempts + 1, sign, u_pp, found

    begin = (0, jnp.ones_like(ratio), fixed[5] - fixed[4], jnp.asarray(False))
    _, sign, u_pp, _ = jax.lax.while_loop(go_on, attempt, begin)
    args = (*given, sign)
    u_pp = attach(_maximum_residual, args, jax.lax.stop_gradient(u_pp))
    u_min = _drive_minimum(u_pp, args)
    return u_min, u_min + u_pp


def _span(u_pp: Scalar, args: Any) -> Scalar:
    operator, centre, span, freq, ratio = args
    plays = operator.plays(ratio * u_pp, freq)
    u_min = centre - u_pp / 2
    top = at_maximum(operator, u_min + u_pp, u_min, plays)
    return top - at_minimum(operator, u_min, plays) - span


@eqx.filter_jit
def drive_range_for_span(
    operator: AbstractOperator,
    span: Scalar,
    centre: Scalar,
    freq: Scalar,
    widest: Scalar,
    ratio: Scalar,
) -> tuple[Scalar, Scalar]:
    """Smallest and largest drive about `centre` whose responses lie `span` apart.

    Looked for up to a peak-to-peak drive of `widest`, which is the answer where there is none.
    `ratio`: the peak-to-peak drive sent, for Eq. 11, over the one that reaches the operator.
    """
    args = (operator, centre, span, freq, ratio)
    found, _ = _smallest_zero(_span, lambda u_pp, _: jnp.asarray(True), args, widest)
    u_pp = attach(_span, args, found)
    return centre - u_pp / 2, centre + u_pp / 2


@takes(operator=AbstractOperator)
@float64
def exact_inverse(
    operator: AbstractOperator,
    y: Float[ArrayLike, " time"],
    freq: Any,
    *,
    within: tuple[Any, Any],
) -> Float[Array, " time"]:
    """The drive to which `operator`, at scan rate `freq` (Hz), answers `y`, sample by sample.

    **Arguments:**

    - `y`: the response wanted, in the response's unit, from a start as Eq. 13 has it. For a scan
      that repeats: one period from its minimum, which is then the periodic state.
    - `freq`: the scan rate, a number or a traced one.
    - `within`: lowest and highest drive to look in.

    **Returns** the drive, in the drive's unit: `operator(exact_inverse(operator, y, f), f)` is `y`
    to rounding, provided the operator is monotone there: see `certify`. Fails with a RuntimeError
    where `y` leaves what the operator reaches `within`. Works under `jit`, `vmap` and `grad`, by
    the implicit function theorem.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import PI, exact_inverse
    >>> operator, rate = PI(r=[0.5], p=[2.0], d=[1.0]), jnp.array(10.0)
    >>> wanted = operator(jnp.array([0.0, 1.0, 2.0, 1.5, 1.0]), rate)
    >>> exact_inverse(operator, wanted, rate, within=(-1.0, 5.0)).round(9).tolist()  # V
    [0.0, 1.0, 2.0, 1.5, 1.0]
    """
    low, high = (as_float64(x) for x in within)
    y, freq = as_float64(y), as_float64(freq)
    return _exact(operator, y, freq, low, high, target_stretches(y))


@eqx.filter_jit
def _exact(operator, y, freq, low, high, stretches):
    one = jnp.ones_like(low)
    u_min, u_max = extremes(operator, jnp.min(y), jnp.max(y), freq, low, high, one)
    u = scan_inverse(operator, y, freq, u_min, u_max, one, stretches)
    off = jnp.abs(operator(u, freq, u_pp=u_max - u_min, u_min=u_min, stretches=stretches) - y)
    return eqx.error_if(
        u,
        ~(jnp.max(off) <= 1e-6 * jnp.ptp(y)),
        "the operator does not reach this response within the drives allowed, or is not monotone "
        "there. `certify` says where.",
    )


def target_stretches(y: Float[Array, " time"]) -> Stretches | None:
    """Where the target `y` is monotone; `None` where its turns are many, or it is traced."""
    if isinstance(y, Tracer):
        return None
    found = find_stretches(np.asarray(y)[None, :])
    return None if found is None else Stretches(*jax.device_put([row[0] for row in found]))


@eqx.filter_jit
def scan_inverse(operator, y, freq, u_min, u_max, ratio, stretches=None):
    """The drive for `y`, once its extremes are known; `ratio` as in `drive_range_for_span`.

    `stretches`: where `y` is monotone, if that is known.
    """
    plays = operator.plays(ratio * (u_max - u_min), freq)
    slack = 1e-9 * (u_max - u_min)  # so that rounding of the extremes cannot shut a root out
    low, high = u_min - slack, u_max + slack
    if stretches is not None and plays.bow is None:
        return _on_stretches(operator, plays, y, stretches, u_min, low, high)

    def step(carry, wanted):
        u, rate, state = carry
        new = root(_error, (operator, plays, state, wanted), low, high, u + rate)
        state = plays.clamped(operator.centred(new), state)
        return (new, jax.lax.stop_gradient(new - u), state), new

    start = plays.lowest(operator.centred(u_min))
    return jax.lax.scan(step, (u_min, jnp.zeros_like(u_min), start), y)[1]


def _on_stretches(operator, plays, y, stretches, u_min, low, high):
    """The same over monotone stretches: turning points in turn, then all samples at once."""

    def step(carry, wanted):
        u, state = carry
        new = root(_error, (operator, plays, state, wanted), low, high, u)
        state = plays.clamped(operator.centred(new), state)
        return (new, state), (operator.centred(new), state)

    start = plays.lowest(operator.centred(u_min))
    turning, states = jax.lax.scan(step, (u_min, start), y[stretches.turn])[1]
    fixed = jax.lax.stop_gradient((operator, plays, y, stretches, (turning, states)))
    ends = (operator.centred(jax.lax.stop_gradient(x)) for x in (low, high))
    u = jax.lax.stop_gradient(solve_samples(*fixed, *ends) - operator.centred(jnp.zeros(())))
    return jnp.clip(attach_samples(operator, plays, y, stretches, states, u), low, high)
