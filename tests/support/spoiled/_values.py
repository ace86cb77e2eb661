"""Drives and readings that are wrong in value: scale, range, noise, spikes, drift, hops."""

from collections.abc import Callable

import numpy as np

from rapi_jax import Drive, predict
from rapi_jax.examples import AMPLITUDE, BIAS

from ._columns import Columns, scaled
from ._ways import WAYS, Spoil, every, only, way


def _constant_drive(columns: Columns, row: int) -> None:
    columns.drive[row] = np.full_like(columns.drive[row], BIAS)


def _constant_response(columns: Columns, row: int) -> None:
    columns.response[row] = np.full_like(columns.response[row], 12.0)


def _response(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Columns, int], None]:
    def spoil(columns: Columns, row: int) -> None:
        columns.response[row] = change(columns.response[row])

    return spoil


def _drive(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Columns, int], None]:
    def spoil(columns: Columns, row: int) -> None:
        columns.drive[row] = change(columns.drive[row])

    return spoil


WAYS |= {
    "constant drive, all": every(_constant_drive),
    "constant drive, one run": only(_constant_drive),
    "constant response, all": every(_constant_response),
    "constant response, one run": only(_constant_response),
    "response offset by 1e6": every(_response(lambda y: y + 1e6)),
    "response offset by 1e12": every(_response(lambda y: y + 1e12)),
    "drive in another unit, all": every(_drive(lambda u: 1e3 * u)),
    "drive in another unit, one run": only(_drive(lambda u: 1e3 * u)),
    "response in another unit, all": every(_response(lambda y: 1e3 * y)),
    "response in another unit, one run": only(_response(lambda y: 1e3 * y)),
    "one run times 10": only(_response(lambda y: 10 * y)),
    "one run times 1.1": only(_response(lambda y: 1.1 * y)),
    "one run times 1.02": only(_response(lambda y: 1.02 * y)),
    "three bits": every(_response(lambda y: np.round(y / np.ptp(y) * 7) / 7 * np.ptp(y))),
    "rectified": every(_response(lambda y: np.abs(y - np.mean(y)))),
    "wrapped": every(_response(lambda y: np.mod(y, 0.7 * np.ptp(y)))),
    "sign flipped, one run": only(_response(lambda y: -y)),
}


def _clipped(share: float) -> Callable[[Columns, int], None]:
    def spoil(columns: Columns, row: int) -> None:
        y = columns.response[row]
        columns.response[row] = np.minimum(y, np.quantile(y, 1.0 - share))

    return spoil


def _softly_clipped(columns: Columns, row: int) -> None:
    y = columns.response[row]
    middle, half = (y.max() + y.min()) / 2, np.ptp(y) / 2
    z = (y - middle) / half
    columns.response[row] = middle + half * np.tanh(1.2 * z) / np.tanh(1.2)


WAYS |= {
    "clipped at 5 %": every(_clipped(0.05)),
    "clipped at 1 %": every(_clipped(0.01)),
    "clipped softly": every(_softly_clipped),
}


def _noise(columns: Columns, row: int) -> None:
    y = columns.response[row]
    columns.response[row] = y.mean() + y.std() * columns.rng.standard_normal(y.size)


WAYS |= {"pure noise, all": every(_noise), "pure noise, one run": only(_noise)}


def _hop(size: float, where: str) -> Spoil:
    def change(columns: Columns, row: int) -> None:
        u = columns.drive[row]
        tops = np.flatnonzero((u[1:-1] > u[:-2]) & (u[1:-1] >= u[2:])) + 1
        if tops.size < 2:  # spoiled before, so that it does not turn
            tops = np.array([u.size // 3, 2 * u.size // 3])
        at = {"inside": [(tops[0] + tops[1]) // 3 * 2], "turn": tops[:1], "turns": tops}[where]
        for place in at:
            columns.response[row][int(place) :] += size

    return only(change)


WAYS |= {
    "hop of 0.2 GHz": _hop(0.2, "inside"),
    "hop of 2 GHz": _hop(2.0, "inside"),
    "hop of 2 GHz at a turn": _hop(2.0, "turn"),
    "hop of 2 GHz at each turn": _hop(2.0, "turns"),
}


@way("sign flipped, all")
def _(columns: Columns) -> None:
    columns.response = [-y for y in columns.response]
    columns.device = scaled(columns.device, -1.0)


@way("drift of 10 GHz")
def _(columns: Columns) -> None:
    for row, time in enumerate(columns.time):
        begin = row / len(columns.time)
        columns.response[row] += 10.0 * (begin + time / time[-1] / len(columns.time))


def _spikes(count: int, size: float) -> Spoil:
    def change(columns: Columns, row: int) -> None:
        at = columns.rng.choice(columns.time[row].size, count, replace=False)
        columns.response[row][at] = size * columns.rng.choice([-1.0, 1.0], count)

    return only(change)


WAYS |= {"one spike": _spikes(1, 700.0), "ten spikes": _spikes(10, 60.0)}


def _frozen(share: float) -> Spoil:
    def change(columns: Columns, row: int) -> None:
        size = columns.time[row].size
        begin = size // 3
        columns.response[row][begin : begin + int(share * size)] = columns.response[row][begin]

    return only(change)


WAYS |= {"frozen for 3 %": _frozen(0.03), "frozen for 10 %": _frozen(0.1)}


@way("a gap interpolated")
def _(columns: Columns) -> None:
    size = columns.time[2].size
    begin, end = size // 3, size // 3 + size // 12
    columns.response[2][begin:end] = np.linspace(
        columns.response[2][begin], columns.response[2][end], end - begin
    )


def _noisy(share: float) -> Callable[[Columns, int], None]:
    def spoil(columns: Columns, row: int) -> None:
        y = columns.response[row]
        columns.response[row] = y + share * np.ptp(y) * columns.rng.standard_normal(y.size)

    return spoil


WAYS |= {"noise of 5 % of span": every(_noisy(0.05)), "noise of 10 % of span": every(_noisy(0.1))}


@way("no noise at all")
def _(columns: Columns) -> None:
    for row in range(len(columns.time)):
        drive = Drive(columns.time[row], columns.drive[row], columns.rates[row], "triangle")
        columns.response[row] = np.asarray(predict(columns.device, drive)).copy()


@way("noisy drive")
def _(columns: Columns) -> None:
    for row, u in enumerate(columns.drive):
        columns.drive[row] = u + 0.005 * AMPLITUDE * columns.rng.standard_normal(u.size)
