"""The exact inverse, and the whole of `compensate`, against bisection in Numba."""

from collections.abc import Iterator

import numpy as np

from rapi_jax import ECDL, DriveLimits, compensate, exact_inverse, linear_scan, predict, triangle
from rapi_jax.examples import AMPLITUDE, BIAS

from ._cases import device, peer_values
from ._paired import Disagree, Row, compared, take_turns
from ._peer_inverse import bisection_inverse
from ._runs import Shape

RATE = 20.0  # Hz
WITHIN = (0.0, 6.5)  # V
AGREES = 1e-9  # of the drive's swing
PEER = "Numba, bisection"
INVERSE, COMPENSATE = "`exact_inverse`", "`compensate`: certificate, limits, prediction"


def rows(rounds: int, sizes: tuple[int, ...] = (1_000, 8_192, 100_000)) -> Iterator[Row]:
    """One period of a straight scan of the paper's device."""
    operator = device()
    ecdl, values = ECDL(operator), peer_values(operator)
    shape = Shape(operator.count, operator.lam.size, operator.d.size)
    (drive,) = triangle(RATE, amplitude=0.9 * AMPLITUDE, bias=BIAS, samples=4000)
    answer = np.asarray(predict(ecdl, drive))
    limits = DriveLimits(*WITHIN, slew_v_per_s=1e6, step_v=1e3, max_frequency_hz=1e3)
    for samples in sizes:
        (target,) = linear_scan(RATE, span=float(np.ptp(answer)), samples=samples)
        y = answer.min() + target.value
        work = f"inverse of {samples} samples x {operator.count} plays"
        seconds, note = _measure(
            work,
            INVERSE,
            lambda y=y: np.asarray(exact_inverse(operator, y, RATE, within=WITHIN)),
            lambda y=y: bisection_inverse(values, shape, RATE, y, *WITHIN),
            rounds,
        )
        yield compared(work, INVERSE, PEER, seconds, note=note)
    (target,) = linear_scan(RATE, span=float(np.ptp(answer)), samples=8_192)

    def whole() -> np.ndarray:
        return compensate(ecdl, target, limits=limits, bias=BIAS).drive.value

    found = compensate(ecdl, target, limits=limits, bias=BIAS)
    y = np.asarray(predict(ecdl, found.drive))
    work = "compensated scan of 8192 samples"
    seconds, note = _measure(
        work,
        COMPENSATE,
        whole,
        lambda: bisection_inverse(values, shape, RATE, y, *WITHIN),
        rounds,
    )
    yield compared(work, COMPENSATE, PEER, seconds, note=note)


def _measure(work, name, ours, peer, rounds) -> tuple[dict[str, np.ndarray], str]:
    """Times, once both have found the same drive."""
    mine, other = ours(), peer()
    off = float(np.abs(mine - other).max() / np.ptp(other))
    if not off <= AGREES:
        raise Disagree(f"{work}: the drives are {off:.2g} of the swing apart.")
    return take_turns({name: ours, PEER: peer}, rounds), f"drives {off:.0e} of the swing apart"
