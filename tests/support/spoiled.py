"""Ways to spoil a recording of the paper's device without making it unreadable.

Each takes a healthy recording's columns and gives back spoiled ones, with what the world was like:
a model that is to be trusted has to predict that world.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from rapi_jax import ECDL, RAPI, Drive, Recording, predict, triangle
from rapi_jax.examples import AMPLITUDE, BIAS, FREQUENCIES, NOISE, paper_device


@dataclasses.dataclass
class Columns:
    """A recording that may be changed at will: one array a run of time, drive and response."""

    time: list[np.ndarray]
    drive: list[np.ndarray]
    response: list[np.ndarray]
    rates: list[float]
    waveforms: list[str]
    rng: np.random.Generator
    device: ECDL
    lag_s: float = 0.0

    @property
    def step(self) -> list[float]:
        """Time from sample to sample in each run, s."""
        return [float(t[1] - t[0]) for t in self.time]

    @property
    def span(self) -> float:
        """Peak to peak of the healthy response, GHz."""
        return max(float(np.ptp(y)) for y in self.response)

    def recording(self) -> Recording:
        """As a laboratory would hand it in; raises `DataError` where nothing would read it."""
        drives = [
            Drive(t, u, rate, shape, start_s=float(10 * i))
            for i, (t, u, rate, shape) in enumerate(
                zip(self.time, self.drive, self.rates, self.waveforms, strict=True)
            )
        ]
        return Recording.of(drives, self.response, response_lag_s=self.lag_s)


def healthy(seed: int, *, samples: int = 400, periods: int = 3, noise: float = NOISE) -> Columns:
    """The paper's device, its numbers a few percent different for each seed, at four rates."""
    rng = np.random.default_rng(seed)
    device = near_paper(rng)
    drives = triangle(
        FREQUENCIES, amplitude=AMPLITUDE, bias=BIAS, samples=samples * periods, periods=periods
    )
    clean = [np.asarray(predict(device, drive)) for drive in drives]
    return Columns(
        [drive.time.copy() for drive in drives],
        [drive.value.copy() for drive in drives],
        [y + noise * rng.standard_normal(y.size) for y in clean],
        list(FREQUENCIES),
        ["triangle"] * len(drives),
        rng,
        device,
    )


def near_paper(rng: np.random.Generator) -> ECDL:
    """A device of the paper's kind."""
    operator: Any = paper_device().operator
    names = ("alpha", "zeta", "lam", "eta", "a", "b", "d", "d_0")
    fields = {name: np.asarray(getattr(operator, name)) for name in names}
    for name in ("alpha", "zeta", "lam", "a"):
        fields[name] = fields[name] * np.exp(0.05 * rng.standard_normal())
    return ECDL(RAPI(**fields, plays=10))


def answers(device: ECDL, columns: Columns, row: int) -> np.ndarray:
    """What another device would have said to the drive of a run, with fresh noise."""
    drive = Drive(columns.time[row], columns.drive[row], columns.rates[row], "triangle")
    clean = np.asarray(predict(device, drive))
    return clean + NOISE * columns.rng.standard_normal(clean.size)


def scaled(device: ECDL, factor: float) -> ECDL:
    """The device with its response times `factor`."""
    operator: Any = device.operator
    names = ("alpha", "zeta", "lam", "eta", "b")
    same = {name: getattr(operator, name) for name in names}
    more = {name: factor * np.asarray(getattr(operator, name)) for name in ("a", "d", "d_0")}
    return ECDL(RAPI(**same, **more, plays=operator.count))


Spoil = Callable[[Columns], None]
WAYS: dict[str, Spoil] = {}


def way(name: str) -> Callable[[Spoil], Spoil]:
    """Enter a way to spoil under its name."""

    def enter(spoil: Spoil) -> Spoil:
        assert name not in WAYS
        WAYS[name] = spoil
        return spoil

    return enter


def every(change: Callable[[Columns, int], None]) -> Spoil:
    """What is done to each run."""

    def spoil(columns: Columns) -> None:
        for row in range(len(columns.time)):
            change(columns, row)

    return spoil


def only(change: Callable[[Columns, int], None], row: int = 2) -> Spoil:
    """What is done to one run."""
    return lambda columns: change(columns, row)


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


@way("response of another run")
def _(columns: Columns) -> None:
    columns.response[3] = columns.response[0].copy()


@way("columns swapped")
def _(columns: Columns) -> None:
    columns.drive, columns.response = columns.response, columns.drive


@way("two devices, 5 % apart")
def _(columns: Columns) -> None:
    other = scaled(columns.device, 1.05)
    for row in (1, 3):
        columns.response[row] = answers(other, columns, row)


@way("two devices, the second from the middle of a run")
def _(columns: Columns) -> None:
    other = scaled(columns.device, 1.05)
    half = columns.time[2].size // 2
    columns.response[2][half:] = answers(other, columns, 2)[half:]
    columns.response[3] = answers(other, columns, 3)


@way("a square drive")
def _(columns: Columns) -> None:
    for row, rate in enumerate(columns.rates):
        high = np.mod(columns.time[row] * rate, 1.0) < 0.5
        columns.drive[row] = BIAS + AMPLITUDE * (high - 0.5)
        columns.response[row] = answers(columns.device, columns, row)
        columns.waveforms[row] = "step"


def _noise(columns: Columns, row: int) -> None:
    y = columns.response[row]
    columns.response[row] = y.mean() + y.std() * columns.rng.standard_normal(y.size)


WAYS |= {"pure noise, all": every(_noise), "pure noise, one run": only(_noise)}


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


def _hop(size: float, where: str) -> Spoil:
    def change(columns: Columns, row: int) -> None:
        u = columns.drive[row]
        tops = np.flatnonzero((u[1:-1] > u[:-2]) & (u[1:-1] >= u[2:])) + 1
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


@way("sign flipped, all")
def _(columns: Columns) -> None:
    columns.response = [-y for y in columns.response]
    columns.device = scaled(columns.device, -1.0)


@way("time reversed")
def _(columns: Columns) -> None:
    columns.drive = [u[::-1].copy() for u in columns.drive]
    columns.response = [y[::-1].copy() for y in columns.response]


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


@way("lag stated wrong by 5 ms")
def _(columns: Columns) -> None:
    columns.lag_s = 5e-3


@way("a lag of 1 ms not stated")
def _(columns: Columns) -> None:
    for row, time in enumerate(columns.time):
        period = 1.0 / columns.rates[row]
        late = np.mod(time - 1e-3, period) + np.floor(time[-1] / period / 2) * period
        columns.response[row] = np.interp(late, time, columns.response[row])


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


@way("a linear device")
def _(columns: Columns) -> None:
    flat: Any = columns.device.operator
    columns.device = ECDL(
        RAPI(
            alpha=0.3, zeta=6e-3, lam=1.0, eta=1.0, a=1e-9, b=0.1,
            d=(float(flat.d[0]), 0.0, 0.0), d_0=0.0, plays=10,
        )
    )  # fmt: skip
    for row in range(len(columns.time)):
        columns.response[row] = answers(columns.device, columns, row)


@way("responses in another order")
def _(columns: Columns) -> None:
    columns.response = columns.response[::-1]


@way("the same data under all rates")
def _(columns: Columns) -> None:
    columns.response = [columns.response[0].copy() for _ in columns.response]


@way("bias wrong in half of the runs")
def _(columns: Columns) -> None:
    for row in (1, 3):
        columns.drive[row] = columns.drive[row] + 0.3


@way("noisy drive")
def _(columns: Columns) -> None:
    for row, u in enumerate(columns.drive):
        columns.drive[row] = u + 0.005 * AMPLITUDE * columns.rng.standard_normal(u.size)
