"""A healthy recording of the paper's device, as columns that may be changed."""

import dataclasses
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
