"""The recordings that both sides fit, and the start that both sides fit them from."""

import dataclasses

import numpy as np

from fitting.identification._weights import run_weights
from rapi_jax import ECDL, RAPI, Drive, Recording, predict, triangle
from rapi_jax.examples import AMPLITUDE, BIAS, NOISE, paper_device

from ._runs import Runs, Shape

OFF = {"alpha": 1.3, "zeta": 0.7, "a": 0.8}  # how far the start is off, with `lam`, `eta`, `b`


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """A recording, a model to start from, and the same for the peer."""

    recording: Recording
    start: ECDL
    values: np.ndarray  # the start as the peer's vector
    shape: Shape
    runs: Runs

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.values.size


def device(plays: int = 10) -> RAPI:
    """The paper's device, its hysteresis spread over `plays` operators."""
    paper = paper_device().operator
    assert isinstance(paper, RAPI)
    names = ("alpha", "zeta", "lam", "eta", "b", "d", "d_0")
    fields = {name: np.asarray(getattr(paper, name)) for name in names}
    return RAPI(**fields, a=float(paper.a) * 10 / plays, plays=plays)


def recorded(
    *, samples: int = 4000, runs: int = 4, plays: int = 10, seed: int = 0, spread: float = 0.0
) -> Recording:
    """A triangle of one period a run, 10 to 40 Hz; `spread`: how far parameters lie off (log)."""
    rng = np.random.default_rng(seed)
    true = device(plays)
    if spread:
        names = ("alpha", "zeta", "lam", "eta", "a", "b", "d", "d_0")
        fields = {name: np.asarray(getattr(true, name)) for name in names}
        for name in ("alpha", "lam", "a"):
            fields[name] = fields[name] * np.exp(spread * rng.standard_normal())
        true = RAPI(**fields, plays=plays)
    rates = np.linspace(10.0, 40.0, runs) if runs > 1 else np.array([20.0])
    drives = triangle(list(rates), amplitude=AMPLITUDE, bias=BIAS, samples=samples)
    clean = (np.asarray(predict(ECDL(true), drive)) for drive in drives)
    return Recording.of(drives, [y + NOISE * rng.standard_normal(y.size) for y in clean])


def case(recording: Recording, *, plays: int = 10, each: bool = False, order: int = 3) -> Case:
    """`recording` with a start 20 to 40 % off; its polynomial is the best one for that start.

    With it the projected cost, as our solver counts, is the whole cost, as the peer's does.
    """
    near = {name: float(getattr(device(plays), name)) for name in ("alpha", "zeta", "a")}
    lam = np.full(plays, 1.3) if each else 1.3
    fields = {name: factor * near[name] for name, factor in OFF.items()}
    fields |= {"lam": lam, "eta": 0.8, "b": 0.05}
    shape = Shape(plays, plays if each else 1, order)
    flat = ECDL(RAPI(**fields, d=np.zeros(order), d_0=0.0, plays=plays))
    weight = np.sqrt(run_weights(recording, "hysteresis"))
    runs = peer_runs(recording, weight)
    memory = np.stack([np.asarray(predict(flat, drive)) for drive in recording.drives])
    columns = runs.u.ravel()[:, None] ** np.arange(order + 1)
    scale = np.repeat(weight, runs.u.shape[1])
    solved = np.linalg.lstsq(
        scale[:, None] * columns, scale * (runs.y - memory).ravel(), rcond=None
    )[0]
    start = ECDL(RAPI(**fields, d=solved[1:], d_0=solved[0], plays=plays))
    return Case(recording, start, peer_values(start.operator), shape, runs)


def peer_runs(recording: Recording, weight: np.ndarray) -> Runs:
    """`recording` as the peer's arrays; its drives begin at their minimum, where Eq. 13 holds."""
    drives = recording.drives
    if any(drive.value.argmin() for drive in drives):
        raise ValueError("The peer starts at the minimum, but a drive begins elsewhere.")
    return Runs(
        np.stack([drive.value for drive in drives]),
        np.stack([run.response for run in recording.runs]),
        weight,
        np.array([drive.rate for drive in drives]),
        np.array([drive.u_pp for drive in drives]),
        np.array([drive.value.min() for drive in drives]),
    )


def peer_values(operator) -> np.ndarray:
    """An operator's parameters as the peer's vector."""
    names = ("alpha", "zeta", "lam", "eta", "a", "b", "d", "d_0")
    parts = [np.ravel(np.asarray(getattr(operator, name))) for name in names]
    return np.concatenate(parts)


def periodic_drive(samples: int, periods: int = 10) -> Drive:
    """A sine of `periods` periods that begins in its middle, so that a model must settle."""
    cycles = np.arange(samples) * (periods / samples)
    value = BIAS + AMPLITUDE / 2 * np.sin(2 * np.pi * cycles)
    return Drive(cycles / 20.0, value, 20.0, "sine")


def free_drive(samples: int, turns: int = 200) -> Drive:
    """A drive that never repeats: straight lines between random levels, at rate 20 Hz in Eq. 11."""
    levels = np.random.default_rng(0).uniform(-1.0, 1.0, turns + 1)
    place = np.arange(samples) * (turns / samples)  # turning points are samples
    value = np.interp(place, np.arange(turns + 1), levels)
    return Drive(np.arange(samples) * 1e-5, BIAS + AMPLITUDE / 2 * value, 20.0, "other")


def scanned(runs: int, samples: int, *, free: bool = False) -> tuple[Drive, ...]:
    """Drives of `samples` each, one period at rates of their own; or such that never repeat."""
    if free:
        return tuple(free_drive(samples) for _ in range(runs))
    rates = list(np.linspace(10.0, 40.0, runs))
    return triangle(rates, amplitude=AMPLITUDE, bias=BIAS, samples=samples)
