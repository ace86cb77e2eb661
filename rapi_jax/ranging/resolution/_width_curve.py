"""The beat's width against the size of a scan's nonlinearity: Eqs. 5 to 7, and measured."""

import dataclasses
from typing import Literal

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax._metrics import SPEED_OF_LIGHT as C
from rapi_jax._metrics import Branch, linearity

Shape = Literal["quadratic", "cubic", "sine", "random", "up", "down"]
Values = Float[np.ndarray, " sizes"]
_SAMPLES = 4001


@dataclasses.dataclass(frozen=True, eq=False)
class WidthCurve:
    """Widths of one shape of nonlinearity at several sizes of it.

    - `rms_ghz`: the rms nonlinearity, GHz.
    - `predicted_hz` (Eq. 5), `measured_hz`: the beat's width, Hz; `ratio`: measured to predicted.
    - `resolution_m` (Eq. 6), `nonlinear_resolution_m` (Eq. 7), `measured_m`: range resolution, m.
    """

    rms_ghz: Values
    predicted_hz: Values
    measured_hz: Values
    resolution_m: Values
    nonlinear_resolution_m: Values
    measured_m: Values

    @property
    def ratio(self) -> Values:
        """Measured width over that of Eq. 5."""
        return self.measured_hz / self.predicted_hz


def width_curve(
    shape: Shape,
    rms_ghz: Values,
    *,
    delay_s: float = 24.5e-9,
    periods: float = 1.0,
    span_ghz: float = 60.0,
    duration_s: float = 0.04,
    excitation_hz: float = 10.0,
    seed: int = 0,
) -> WidthCurve:
    """The beat's width by Eq. 5 and measured, over the rms of a nonlinearity of one shape.

    **Arguments:** those of `crooked_branch`, and

    - `rms_ghz`: sizes, GHz. `delay_s`: of the interferometer, s; the paper's auxiliary one.
    """
    branches = [
        crooked_branch(
            shape,
            float(size),
            periods=periods,
            span_ghz=span_ghz,
            duration_s=duration_s,
            excitation_hz=excitation_hz,
            seed=seed,
        )
        for size in rms_ghz
    ]
    width = np.array([branch.peak_width_hz(delay_s) for branch in branches])
    slope = np.array([abs(branch.slope_ghz_per_s) * 1e9 for branch in branches])
    return WidthCurve(
        rms_ghz=np.asarray(rms_ghz, dtype=float),
        predicted_hz=np.array([branch.eq5_width_hz(delay_s) for branch in branches]),
        measured_hz=width,
        resolution_m=np.array([branch.resolution_m(delay_s) for branch in branches]),
        nonlinear_resolution_m=np.array([b.nonlinear_resolution_m(delay_s) for b in branches]),
        measured_m=C * width / (2.0 * slope),
    )


def crooked_branch(
    shape: Shape,
    rms_ghz: float,
    *,
    periods: float = 1.0,
    span_ghz: float = 60.0,
    duration_s: float = 0.04,
    excitation_hz: float = 10.0,
    seed: int = 0,
) -> Branch:
    """A scan over `span_ghz` with a nonlinearity of one shape and size.

    **Arguments:**

    - `shape`: `"quadratic"`, `"cubic"`, `"sine"` (of so many `periods`), `"random"` (white noise
      below `periods` cycles a scan, from `seed`), or `"up"` and `"down"`, the branches of the
      device of Table 1 at `excitation_hz`.
    - `rms_ghz`: about the least-squares line, GHz.

    Raises `DataError` for a shape that is not one of these or has no curvature.
    """
    place = np.linspace(-1.0, 1.0, _SAMPLES)
    error = _error(shape, place, periods, excitation_hz, seed)
    line = np.polynomial.Polynomial.fit(place, error, 1)
    error = error - line(place)
    size = float(np.sqrt(np.mean(error**2)))
    if size < 1e-9:
        raise DataError(f"A nonlinearity of shape {shape!r} with {periods} periods is a line.")
    time = duration_s * (place + 1.0) / 2.0
    direction = "down" if shape == "down" else "up"
    ramp = span_ghz * place / 2.0 * (-1.0 if direction == "down" else 1.0)
    return Branch(direction, 0, time, ramp + rms_ghz / size * error, duration_s)


def _error(shape: str, place: np.ndarray, periods: float, excitation_hz: float, seed: int):
    """The nonlinearity over the scan, -1 to 1, before its line is taken out; any size."""
    if shape in ("quadratic", "cubic"):
        return place ** (2 if shape == "quadratic" else 3)
    if shape == "sine":
        return np.sin(np.pi * periods * (place + 1.0))
    if shape == "random":
        rng = np.random.default_rng(seed)
        number = np.arange(1, int(max(periods, 1.0)) * 2 + 1)[:, None]  # half cycles
        return rng.standard_normal(number.size) @ np.cos(np.pi * number * (place + 1.0) / 2.0)
    if shape in ("up", "down"):
        return _device_branch(shape, place, excitation_hz)
    raise DataError(f"`shape` must be quadratic, cubic, sine, random, up or down, not {shape!r}.")


def _device_branch(direction: str, place: np.ndarray, excitation_hz: float) -> np.ndarray:
    """The nonlinearity of a branch of the paper's device, GHz."""
    from rapi_jax import examples
    from rapi_jax._ecdl import predict
    from rapi_jax._waveform import triangle
    from rapi_jax.recording._run import Run

    drives = triangle(
        (excitation_hz,), amplitude=examples.AMPLITUDE, bias=examples.BIAS, samples=_SAMPLES - 1
    )
    response = np.asarray(predict(examples.paper_device(), drives[0]))
    branch = getattr(linearity(Run(drives[0], response)), direction)
    order = np.argsort(branch.time)
    time = branch.time[order]
    even = time[0] + (place + 1.0) / 2.0 * (time[-1] - time[0])
    return np.interp(even, time, branch.residual[order])
