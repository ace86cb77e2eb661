"""Clocks, rates and lags that are wrong, and samples that are lost or doubled."""

from collections.abc import Callable

import numpy as np

from ._columns import Columns
from ._ways import WAYS, Spoil, every, only, way


@way("stamps repeated")
def _(columns: Columns) -> None:
    columns.time[1][40::40] = columns.time[1][39:-1:40]


@way("samples repeated, restamped")
def _(columns: Columns) -> None:
    at = np.sort(np.r_[np.arange(columns.time[1].size), np.arange(50, 1000, 90)])
    columns.drive[1], columns.response[1] = columns.drive[1][at], columns.response[1][at]
    columns.time[1] = np.arange(at.size) * columns.step[1]


def _jitter(share: float, stamped: bool) -> Spoil:
    def change(columns: Columns, row: int) -> None:
        time, step = columns.time[row], columns.step[row]
        true = time + share * step * columns.rng.uniform(-1.0, 1.0, time.size)
        true[0] = 0.0
        columns.response[row] = np.interp(true, time, columns.response[row])
        if stamped:
            columns.drive[row] = np.interp(true, time, columns.drive[row])
            columns.time[row] = true

    return every(change)


WAYS |= {
    "clock jitters 20 %, stamped": _jitter(0.2, True),
    "clock jitters 20 %, hidden": _jitter(0.2, False),
    "clock jitters 90 %, hidden": _jitter(0.9, False),
}


def _rate(factor: float) -> Callable[[Columns, int], None]:
    def spoil(columns: Columns, row: int) -> None:
        columns.rates[row] *= factor

    return spoil


WAYS |= {
    "rate wrong by 1 %": every(_rate(1.01)),
    "rate wrong by 2 %": every(_rate(1.02)),
    "rate double": every(_rate(2.0)),
}


@way("another waveform named")
def _(columns: Columns) -> None:
    columns.waveforms = ["sine"] * len(columns.waveforms)


@way("one clock wrong")
def _(columns: Columns) -> None:
    columns.time[2] = columns.time[2] * 1.25
    columns.rates[2] /= 1.25


@way("clock in ms")
def _(columns: Columns) -> None:
    columns.time = [1e3 * time for time in columns.time]


def _slipped(samples: int, both: bool) -> Spoil:
    def change(columns: Columns, row: int) -> None:
        at = np.arange(columns.time[row].size)
        half = at.size // 2
        at[half:] = np.minimum(at[half:] + samples, at[-1])
        columns.response[row] = columns.response[row][at]
        if both:
            columns.drive[row] = columns.drive[row][at]

    return only(change)


WAYS |= {
    "phase slip of 5 samples, response": _slipped(5, False),
    "phase slip of 20 samples, response": _slipped(20, False),
    "phase slip of 5 samples, both": _slipped(5, True),
    "phase slip of 20 samples, both": _slipped(20, True),
}


def _missing(both: bool) -> Callable[[Columns, int], None]:
    def spoil(columns: Columns, row: int) -> None:
        size = columns.time[row].size
        kept = np.sort(columns.rng.choice(size, int(0.95 * size), replace=False))
        columns.response[row] = columns.response[row][kept]
        columns.drive[row] = columns.drive[row][kept] if both else columns.drive[row][: kept.size]
        columns.time[row] = columns.time[row][: kept.size]

    return spoil


WAYS |= {
    "5 % of samples missing, restamped": every(_missing(True)),
    "5 % of samples missing in the response": every(_missing(False)),
}


@way("time reversed")
def _(columns: Columns) -> None:
    columns.drive = [u[::-1].copy() for u in columns.drive]
    columns.response = [y[::-1].copy() for y in columns.response]


@way("lag stated wrong by 5 ms")
def _(columns: Columns) -> None:
    columns.lag_s = 5e-3


@way("a lag of 1 ms not stated")
def _(columns: Columns) -> None:
    for row, time in enumerate(columns.time):
        period = 1.0 / columns.rates[row]
        late = np.mod(time - 1e-3, period) + np.floor(time[-1] / period / 2) * period
        columns.response[row] = np.interp(late, time, columns.response[row])
