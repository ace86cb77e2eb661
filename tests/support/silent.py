"""Sessions whose readings are 0, so that a model's values are its errors; and noise for them."""

import dataclasses

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock, period_blocks
from rapi_jax import Recording, triangle
from rapi_jax.sampling._batch import to_batch


def session(
    rates: tuple[float, ...] = (10.0, 20.0, 30.0, 40.0), periods: int = 5, phases: int = 156
) -> tuple[Recording, list[PeriodBlock]]:
    """Triangles at these rates; the readings are 0, so that a model's values are its errors."""
    drives, start = [], 0.0
    for hz in rates:
        (d,) = triangle(hz, amplitude=2.0, bias=3.0, samples=periods * phases, periods=periods)
        drives.append(dataclasses.replace(d, start_s=start))
        start += periods / hz + 0.2
    recording = Recording.of(drives, [np.zeros(d.size) for d in drives])
    return recording, period_blocks(recording, to_batch(recording, lead=True))


def usual_step(parts: list[PeriodBlock]) -> float:
    """The sampling interval at which a spectrum's slow part is told, s."""
    return float(np.median([b.step_s for b in parts]))


def noise(rng: np.random.Generator, parts: list[PeriodBlock], low: float = 0.0) -> list[np.ndarray]:
    """White noise of variance 1, or 1/2 + low / (1 + (f/200 Hz)^2), cut from a longer record."""
    if not low:
        return [rng.standard_normal(b.left.shape) for b in parts]
    out = []
    for b in parts:
        line = np.fft.rfft(rng.standard_normal(8 * b.size))
        f = np.fft.rfftfreq(8 * b.size, b.step_s)
        slow = low * usual_step(parts) / b.step_s  # a process in time: faster samples hold more
        line *= np.sqrt(0.5 + slow / (1.0 + (f / 200.0) ** 2))
        out.append(np.fft.irfft(line, 8 * b.size)[: b.size].reshape(b.left.shape))
    return out
