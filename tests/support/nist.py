"""The NIST StRD nonlinear regression problems: a reader of the files, and the models."""

import dataclasses
import hashlib
import re
from collections.abc import Callable
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

FOLDER = Path(__file__).parents[1] / "data" / "nist"
Model = Callable[[Array, Array], Array]  # (parameters, predictors) -> response


@dataclasses.dataclass(frozen=True)
class Problem:
    """One file: data, two starts, and what NIST certifies."""

    name: str
    starts: tuple[np.ndarray, np.ndarray]
    values: np.ndarray
    stderr: np.ndarray
    squares: float
    spread: float  # residual standard deviation
    y: np.ndarray
    x: np.ndarray


def read(name: str) -> Problem:
    """Read `name`.dat; `x` has shape `samples`, or `predictors samples` where there are several."""
    text = (FOLDER / f"{name}.dat").read_text(encoding="ascii")
    rows = re.findall(r"^ *b\d+ *=((?: +[-+.\dE]+){4}) *$", text, flags=re.MULTILINE)
    table = np.array([row.split() for row in rows], dtype=float)
    first, last = re.search(r"Data +\(lines (\d+) to +(\d+)\)", text).groups()  # pyright: ignore
    lines = text.splitlines()[int(first) - 1 : int(last)]
    data = np.array([line.split() for line in lines], dtype=float).T
    count = int(_number(text, "Number of Observations"))
    parameters = int(re.search(r"(\d+) Parameters", text)[1])  # pyright: ignore[reportOptionalSubscript]
    if data.shape[1] != count or table.shape != (parameters, 4):
        raise ValueError(f"{name}.dat does not hold what its header says")
    squares = _number(text, "Residual Sum of Squares")
    spread = _number(text, "Residual Standard Deviation")
    x = data[1] if data.shape[0] == 2 else data[1:]
    return Problem(
        name, (table[:, 0], table[:, 1]), table[:, 2], table[:, 3], squares, spread, data[0], x
    )


def hashes() -> dict[str, tuple[str, str]]:
    """For each file of `SHA256SUMS`, the hash written there and the one it has."""
    lines = (FOLDER / "SHA256SUMS").read_text(encoding="ascii").split("\n")
    pairs = [line.split() for line in lines if line]
    return {
        name: (told, hashlib.sha256((FOLDER / name).read_bytes()).hexdigest())
        for told, name in pairs
    }


def _number(text: str, label: str) -> float:
    return float(re.search(rf"^{label}: +(\S+)", text, flags=re.MULTILINE)[1])  # pyright: ignore


def _powers(b: Array, x: Array) -> Array:
    """The polynomial `b[0] + b[1] x + ...`."""
    return jnp.polyval(b[::-1], x)


def _rational(b: Array, x: Array, numerator: int) -> Array:
    below = jnp.concatenate([jnp.ones(1, b.dtype), b[numerator:]])
    return _powers(b[:numerator], x) / _powers(below, x)


def _cycle(b: Array, period: Array | float, x: Array) -> Array:
    angle = 2 * jnp.pi * x / period
    return b[0] * jnp.cos(angle) + b[1] * jnp.sin(angle)


def _chwirut(b: Array, x: Array) -> Array:
    return jnp.exp(-b[0] * x) / (b[1] + b[2] * x)


def _gauss(b: Array, x: Array) -> Array:
    peaks = [b[i] * jnp.exp(-((x - b[i + 1]) ** 2) / b[i + 2] ** 2) for i in (2, 5)]
    return b[0] * jnp.exp(-b[1] * x) + peaks[0] + peaks[1]


def _lanczos(b: Array, x: Array) -> Array:
    return sum((b[i] * jnp.exp(-b[i + 1] * x) for i in (0, 2, 4)), start=jnp.zeros_like(x))


def _saturation(b: Array, x: Array) -> Array:
    return b[0] * (1 - jnp.exp(-b[1] * x))


def _enso(b: Array, x: Array) -> Array:
    return b[0] + _cycle(b[1:3], 12.0, x) + _cycle(b[4:6], b[3], x) + _cycle(b[7:9], b[6], x)


MODELS: dict[str, Model] = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": _saturation,
    "Chwirut1": _chwirut,
    "Chwirut2": _chwirut,
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "ENSO": _enso,
    "Eckerle4": lambda b, x: b[0] / b[1] * jnp.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": _gauss,
    "Gauss2": _gauss,
    "Gauss3": _gauss,
    "Hahn1": lambda b, x: _rational(b, x, 4),
    "Kirby2": lambda b, x: _rational(b, x, 3),
    "Lanczos1": _lanczos,
    "Lanczos2": _lanczos,
    "Lanczos3": _lanczos,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * jnp.exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * jnp.exp(-x * b[3]) + b[2] * jnp.exp(-x * b[4]),
    "Misra1a": _saturation,
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda b, x: b[0] - b[1] * x[0] * jnp.exp(-b[2] * x[1]),
    "Rat42": lambda b, x: b[0] / (1 + jnp.exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1 + jnp.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - jnp.arctan(b[2] / (x - b[3])) / jnp.pi,
    "Thurber": lambda b, x: _rational(b, x, 4),
}
LOGARITHMIC = {"Nelson"}  # the file models log(y)


def response(problem: Problem) -> np.ndarray:
    """What the model of `problem` describes: `y`, or its logarithm."""
    return np.log(problem.y) if problem.name in LOGARITHMIC else problem.y


def digits(found: np.ndarray, certified: np.ndarray) -> float:
    """Correct digits of the worst entry (log relative error), at most the 11 certified."""
    error = np.max(np.abs(found - certified) / np.abs(certified))
    return float(-np.log10(max(error, 1e-11))) if np.isfinite(error) else 0.0
