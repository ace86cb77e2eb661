r"""The play operator (Eqs. 8, 9, 12) and the weighted sum of many (Eq. 14).

A play is a clamp with memory: at each sample its output is the previous output, pushed into the
band `[lower, upper]`. So at any time it equals the bound that it touched last, at the moment of
that touch, and so does its derivative. Both functions below carry the sample of the last contact
through the scan and read the derivative off it, instead of carrying a tangent for every parameter.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rapi_jax._precision import as_float64, float64

from ._monotone_stretches import Stretches, clamp_states, rising, weighted_sum
from ._plays import Plays
from ._prefix_scan import prefix_contacts, prefix_values

# The steps are functions of the module: a scan called outside `jit` is then compiled only once.


def _step(value, bounds):
    lower, upper = bounds
    value = jnp.maximum(lower, jnp.minimum(upper, value))  # Eq. (9)
    return value, value


def _contact_step(carry, bounds):
    value, contact, low = carry
    lower, upper, sample = bounds
    capped = jnp.minimum(upper, value)
    new = jnp.maximum(lower, capped)  # Eq. (9)
    pushed_up = lower > capped
    touched = pushed_up | (upper < value)
    contact = jnp.where(touched, sample, contact)
    low = jnp.where(touched, pushed_up, low)
    return (new, contact, low), (new, contact, low)


def _contacts(
    lower: Float[Array, "time *lanes"],
    upper: Float[Array, "time *lanes"],
    start: Float[Array, "*lanes"],
) -> tuple[Float[Array, "time *lanes"], Int[Array, "time *lanes"], Bool[Array, "time *lanes"]]:
    """The recursion: outputs, sample of the last contact (-1: none yet), and whether from below.

    Where the band is crossed (`lower > upper`) the `max` of Eq. 9 is outermost, so `lower` wins.
    """
    if _on_accelerator():
        return prefix_contacts(lower, upper, start)
    never = jnp.full(start.shape, -1, dtype=jnp.int32)
    samples = jnp.arange(lower.shape[0], dtype=jnp.int32)
    initial = (start, never, jnp.zeros(start.shape, dtype=bool))
    return jax.lax.scan(_contact_step, initial, (lower, upper, samples))[1]


def _on_accelerator() -> bool:
    """Whether many samples at once cost less than one after the other."""
    return jax.default_backend() != "cpu"


def _values(lower, upper, start):
    if _on_accelerator():
        return prefix_values(lower, upper, start)
    return jax.lax.scan(_step, start, (lower, upper))[1]


@eqx.filter_custom_jvp
def _play(lower, upper, start):
    return _values(lower, upper, start)


@_play.def_jvp
@float64
def _play_jvp(primals, tangents):
    lower, upper, start = primals
    value, contact, low = _contacts(lower, upper, start)
    at = jnp.maximum(contact, 0)
    tangent = jnp.zeros_like(value)
    for bound, touched in zip(tangents[:2], (low, ~low), strict=True):
        if bound is not None:
            tangent = tangent + jnp.where(touched & (contact >= 0), bound[at], 0.0)
    if tangents[2] is not None:
        tangent = tangent + jnp.where(contact < 0, tangents[2], 0.0)
    return value, tangent


@float64
def play(
    lower: Float[Array, " time"], upper: Float[Array, " time"], start: Float[Array, ""]
) -> Float[Array, " time"]:
    """One play operator between two moving bounds (Eqs. 8, 9, 12).

    **Arguments**, all in one unit:

    - `lower`, `upper`: the band. `(u - r, u + r)` is the classical play (Eq. 8),
      `(u - r, lam u + eta r)` the asymmetric one (Eqs. 9, 12). Where they cross, `lower` wins.
    - `start`: the output before the first sample; Eq. 13 gives `max(u_min - r, lam u_min + eta r)`.

    **Returns** the output at each sample. Its derivative is exact away from kinks, at the cost of
    one gather per tangent.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import play
    >>> drive = jnp.array([0.0, 1.0, 2.0, 1.5, 0.0])
    >>> play(drive - 0.5, drive + 0.5, jnp.array(0.0)).tolist()
    [0.0, 0.5, 1.5, 1.5, 0.5]
    """
    return _play(as_float64(lower), as_float64(upper), as_float64(start))


@eqx.filter_custom_jvp
def _memory(u, r, lam, eta, p, start, bow, u_0, stretches):
    if stretches is None:
        return _values(*_bands(u, r, lam, eta, bow, u_0), start) @ p
    plays = Plays(r, lam, eta, p, bow, u_0)
    total = weighted_sum(plays, u, clamp_states(plays, u[stretches.turn], start), stretches.index)
    return jnp.where(rising(plays, jnp.min(u), jnp.max(u)), total, jnp.nan)


def _last_contacts(bounds, u, start, stretches):
    """What `_contacts` gives, from the turning points: the rest is known without recursion."""
    lower, upper = _bands(u, *bounds)
    if stretches is None:
        return _contacts(lower, upper, start)
    turn, index = stretches
    state, at_turn, low_at_turn = _contacts(lower[turn], upper[turn], start)
    before = state[index]
    capped = jnp.minimum(upper, before)
    pushed_up = lower > capped
    # At the turning point itself the output is on its bound: rounding must not decide again.
    moved = (u != u[turn][index])[:, None]
    touched = moved & (pushed_up | (upper < before))
    known = jnp.where(at_turn < 0, -1, turn[jnp.maximum(at_turn, 0)])[index]
    sample = jnp.arange(u.size, dtype=jnp.int32)[:, None]
    contact = jnp.where(touched, sample, known)
    return jnp.maximum(lower, capped), contact, jnp.where(touched, pushed_up, low_at_turn[index])


@_memory.def_jvp
@float64
def _memory_jvp(primals, tangents):
    u, r, lam, eta, p, start, bow, u_0, stretches = primals
    du, *others = tangents
    value, contact, low = _last_contacts((r, lam, eta, bow, u_0), u, start, stretches)
    out = _memory(*primals) if stretches is not None else value @ p
    at = jnp.maximum(contact, 0)
    below = low & (contact >= 0)
    above = ~low & (contact >= 0)
    r, lam, eta, p = (x[None, :] for x in (r, lam, eta, p))
    # The derivative of the sum with respect to each operator's own numbers; a tangent is then one
    # matrix product, however many parameters lie behind these.
    columns = (
        (jnp.where(above, eta, 0.0) - jnp.where(below, 1.0, 0.0)) * p,  # r
        jnp.where(above, u[at], 0.0) * p,  # lam
        jnp.where(above, r, 0.0) * p,  # eta
        value,  # p
        jnp.where(contact < 0, 1.0, 0.0) * p,  # start
    )
    bend = jnp.zeros(())
    if bow is not None:
        off = u[at] - u_0
        bend = 2.0 * bow * off
        columns += (
            jnp.sum(jnp.where(above, off**2, 0.0) * p, axis=1, keepdims=True),  # bow
            jnp.sum(jnp.where(above, -bend, 0.0) * p, axis=1, keepdims=True),  # u_0
        )
    given = [(c, jnp.atleast_1d(t)) for c, t in zip(columns, others, strict=False) if t is not None]
    tangent = jnp.zeros_like(out)
    if given:
        matrix = jnp.concatenate([c for c, _ in given], axis=1)
        tangent = matrix @ jnp.concatenate([t for _, t in given])
    if du is not None:
        slope = jnp.where(below, 1.0, jnp.where(above, lam + bend, 0.0)) * p
        tangent = tangent + jnp.sum(slope * du[at], axis=1)
    return out, tangent


def _bands(u, r, lam, eta, bow, u_0):
    upper = lam[None, :] * u[:, None] + (eta * r)[None, :]
    if bow is not None:
        upper = upper + (bow * (u - u_0) ** 2)[:, None]
    return u[:, None] - r[None, :], upper  # Eq. (12)


@float64
def memory(
    u: Float[Array, " time"],
    r: Float[Array, " plays"],
    lam: Float[Array, " plays"],
    eta: Float[Array, " plays"],
    p: Float[Array, " plays"],
    start: Float[Array, " plays"],
    bow: Float[Array, ""] | None = None,
    u_0: Float[Array, ""] | None = None,
    stretches: Stretches | None = None,
) -> Float[Array, " time"]:
    r"""The memory function $\sum_i p_i \Gamma_{r_i,\lambda_i,\eta_i}[u](t)$ (Eqs. 12, 14).

    `u` in the drive's unit, `r` likewise, `p` in response units per drive unit, `start` each
    operator's output before the first sample. `bow` bends the falling bounds of all operators
    alike, to $\lambda u + \eta r + c (u - u_0)^2$; not given, they are straight. With the drive's
    `stretches` known the recursion runs over its turning points alone; NaN then where a falling
    bound does not rise with the drive. This function and its derivative are the seam behind which
    the recursion lives: everything that predicts comes through here.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import memory
    >>> drive = jnp.array([0.0, 1.0, 2.0, 1.0, 0.0])
    >>> one = jnp.ones(1)
    >>> memory(drive, 0.5 * one, one, one, 2.0 * one, 0.0 * one).tolist()  # 2 x a play of 0.5 V
    [0.0, 1.0, 3.0, 3.0, 1.0]
    """
    bend = (None, None) if bow is None or u_0 is None else (as_float64(bow), as_float64(u_0))
    return _memory(*(as_float64(x) for x in (u, r, lam, eta, p, start)), *bend, stretches)
