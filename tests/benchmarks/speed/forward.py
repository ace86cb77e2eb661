"""The forward model: `predict` against a Numba loop on one thread, and its peak memory."""

import subprocess
import sys
from collections.abc import Iterator

import numpy as np

from rapi_jax import ECDL, RAPI, Drive, predict

from ._cases import device, free_drive, peer_values, periodic_drive
from ._memory import peak_above, resident
from ._paired import Disagree, Row, compared, take_turns
from ._peer_model import add_polynomial, lowest, plain_recursion, recursion, unpack
from ._runs import Shape

AGREES = 1e-11  # of the largest response
TWICE, SETTLED = "Numba, two passes", "Numba, one period to settle"
ONCE, FAST_ONCE = "Numba, one pass", "Numba, one pass, sums reordered"
OURS = "`predict`"


def peer_predict(operator: RAPI, drive: Drive, *, settle: int, fast: bool = True) -> np.ndarray:
    """The response by the Numba loop, after a first pass over `settle` samples."""
    loop = recursion if fast else plain_recursion
    values = peer_values(operator)
    shape = Shape(operator.count, operator.lam.size, operator.d.size)
    u = np.asarray(drive.value)
    r, lam, offset, p = unpack(values, shape, drive.rate, drive.u_pp)
    state, out = lowest(u.min(), r, lam, offset), np.empty(u.size)
    loop(u[:settle], r, lam, offset, p, state, out[:settle])
    loop(u, r, lam, offset, p, state, out)
    add_polynomial(u, np.asarray(operator.d), float(operator.d_0), out)
    return out


def rows(rounds: int, sizes: tuple[int, ...] = (10_000, 100_000, 1_000_000)) -> Iterator[Row]:
    """A drive of ten periods, settled; a drive that never repeats."""
    operator = device()
    ecdl = ECDL(operator)
    for samples in sizes:
        drive = periodic_drive(samples)
        yield from _compare(
            f"forward, {samples:.0e} samples x 10 plays, 10 periods",
            ecdl,
            drive,
            {TWICE: (samples, False), SETTLED: (samples // 10, True)},
            rounds,
        )
    samples = sizes[-1]
    yield from _compare(
        f"forward, {samples:.0e} samples x 10 plays, never repeats",
        ecdl,
        free_drive(samples),
        {ONCE: (0, False), FAST_ONCE: (0, True)},
        rounds,
    )


def _compare(work, ecdl, drive, peers, rounds) -> Iterator[Row]:
    def by_peer(settle, fast):
        return lambda: peer_predict(ecdl.operator, drive, settle=settle, fast=fast)

    ways = {OURS: lambda: np.asarray(predict(ecdl, drive))}
    ways |= {name: by_peer(*how) for name, how in peers.items()}
    answers = {name: way() for name, way in ways.items()}
    for name in peers:
        off = np.abs(answers[name] - answers[OURS]).max() / np.abs(answers[OURS]).max()
        if not off <= AGREES:
            raise Disagree(f"{work}: {name} is {off:.2g} of the largest response away from ours.")
    seconds = take_turns(ways, rounds)
    for name in peers:
        yield compared(work, OURS, name, seconds)


def memory_rows(samples: int = 10_000_000) -> Iterator[Row]:
    """Peak memory of either side in a fresh process, in arrays of `samples` numbers."""
    for kind, peer in (("10 periods", SETTLED), ("never repeats", FAST_ONCE)):
        found = {}
        for side in ("ours", "peer"):
            command = [sys.executable, "-m", __name__, side, kind, str(samples)]
            answer = subprocess.run(command, check=True, capture_output=True, text=True)
            found[side] = float(answer.stdout.split()[-1])
        yield Row(
            f"peak memory, {samples:.0e} samples x 10 plays, {kind}",
            OURS,
            peer,
            found["ours"],
            found["peer"],
            note="the answer is one array",
            unit="arrays",
        )


def _main() -> None:
    side, kind, samples = sys.argv[1], sys.argv[2], int(sys.argv[3])
    repeats = kind == "10 periods"
    operator = device()

    def way(drive):
        if side == "ours":
            return predict(ECDL(operator), drive)
        return peer_predict(operator, drive, settle=drive.size // 10 if repeats else 0)

    drive_of = periodic_drive if repeats else free_drive
    way(drive_of(1000))
    drive = drive_of(samples)
    before = resident()
    way(drive)
    print(peak_above(before) / (8 * samples))


if __name__ == "__main__":
    _main()
