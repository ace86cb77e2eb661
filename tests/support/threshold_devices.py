"""Simulated devices whose thresholds do not grow with the swing, in sessions of some amplitudes."""

import dataclasses

import numpy as np

from rapi_jax import ECDL, PI, AbstractOperator, Drive, Recording, triangle
from rapi_jax._ecdl import compiled_respond
from rapi_jax._precision import float64
from rapi_jax.effects import AbstractEffect
from rapi_jax.sampling._batch import to_batch


def session(
    rates=(10.0, 20.0, 30.0, 40.0), amplitudes=(2.0, 4.0), periods=3, samples=256
) -> tuple[Drive, ...]:
    """Triangles about 3 V, one after the other."""
    out, start = [], 0.0
    for amplitude in amplitudes:
        for rate in rates:
            (drive,) = triangle(
                rate, amplitude=amplitude, bias=3.0, samples=periods * samples, periods=periods
            )
            out.append(dataclasses.replace(drive, start_s=start))
            start += periods / rate + 0.2
    return tuple(out)


def classical(plays=12, widest=1.3, total=6.0, fall=1.0) -> PI:
    """A classical piezo: symmetric plays, thresholds fixed in V, weights that fall with them."""
    r = widest * np.arange(1, plays + 1) / plays
    p = np.exp(-fall * r / widest)
    return PI(r=r, p=total * p / p.sum(), d=(14.0, -0.4))


@float64
def record(
    operator: AbstractOperator,
    *effects: AbstractEffect,
    noise: float = 0.02,
    seed: int = 0,
    drives: tuple[Drive, ...] | None = None,
) -> Recording:
    """What a device answers, with white noise, GHz a sample."""
    drives = session() if drives is None else drives
    data = to_batch(Recording.of(drives, [d.value for d in drives]), lead=True)
    rows = np.asarray(compiled_respond(ECDL(operator, effects), data.device()))
    rng = np.random.default_rng(seed)
    clean = [rows[k][data.sample[k] >= 0] for k in range(len(drives))]
    return Recording.of(drives, [y + noise * rng.standard_normal(y.size) for y in clean])
