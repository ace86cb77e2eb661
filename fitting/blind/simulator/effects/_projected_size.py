"""The strength at which an effect has the projected size that is asked for."""

from collections.abc import Callable

import numpy as np

CLOSE = 0.02  # of the size asked for
STEPS = 16
LEAST = 1e-12  # in place of no size at all, as an amplitude law has in a session of one amplitude


def solve_strength(
    size: Callable[[float], float], target: float, low: float, high: float
) -> tuple[float, float]:
    """Strength and size nearest to `target`, for a size that grows with the strength.

    Secants in logarithms, kept within what is known of the bracket; the ends are used where the
    target lies beyond them. The better of all tries is given, so a size that jumps is no error.
    """
    begin = float(np.sqrt(low * high))
    known: list[tuple[float, float]] = []  # (log strength, log size)
    under, over = np.log(low), np.log(high)
    x = np.log(begin)
    goal = np.log(max(target, LEAST))
    tried: list[tuple[float, float, float]] = []
    for _ in range(STEPS):
        strength = float(np.clip(np.exp(x), low, high))
        found = size(strength)
        y = float(np.log(max(found, LEAST)))
        tried.append((abs(y - goal), strength, found))
        if abs(y - goal) < CLOSE:
            break
        known.append((float(x), y))
        if y < goal:
            under = max(under, x)
        else:
            over = min(over, x)
        if over - under < 1e-9:
            break
        x = _next(known, goal, float(under), float(over))
    _, strength, found = min(tried)
    return strength, found


def _next(known: list[tuple[float, float]], goal: float, under: float, over: float) -> float:
    """The next logarithm of the strength to try, inside the bracket."""
    x, y = known[-1]
    power = 1.0
    if len(known) > 1:
        x0, y0 = known[-2]
        power = float(np.clip((y - y0) / (x - x0), 0.2, 5.0)) if x != x0 else 1.0
    guess = x + (goal - y) / power
    seen = [k[0] for k in known]
    if guess <= under:
        guess = (under + over) / 2 if under in seen else under
    elif guess >= over:
        guess = (under + over) / 2 if over in seen else over
    elif len(known) > 5 and len(known) % 2:  # secants that creep
        guess = (under + over) / 2
    return guess
