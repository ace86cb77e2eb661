"""Small recordings of the paper's device: what the tests of a diagnosis at its edges are given."""

import numpy as np

from rapi_jax import ECDL, RAPI, Drive, Recording
from rapi_jax._ecdl import compiled_respond
from rapi_jax.effects import AbstractEffect
from rapi_jax.examples import paper_device
from rapi_jax.sampling._batch import to_batch

RATES, SAMPLES, PERIODS, NOISE, SEED = (10.0, 40.0), 200, 3, 0.02, 0


def drives(
    rates: tuple[float, ...] = RATES,
    *,
    amplitudes: tuple[float, ...] = (3.0,),
    periods: float = PERIODS,
    samples: float = SAMPLES,
    phase: float = 0.0,
    clock: bool = True,
) -> list[Drive]:
    """Triangles about 3 V; `samples` a period need not be whole, `phase` is that of the start."""
    out, start = [], 0.0
    for amplitude in amplitudes:
        for hz in rates:
            t = np.arange(int(samples * periods)) / (hz * samples)
            u = 3.0 + amplitude * (0.5 - np.abs(2.0 * np.mod(t * hz + phase, 1.0) - 1.0))
            out.append(Drive(t, u, excitation_hz=hz, waveform="triangle", start_s=start))
            start += (periods / hz + 0.2) * clock
    return out


def wandering(size: int = 600) -> Drive:
    """A drive without a rate: two incommensurate sines."""
    t = np.arange(size) / 2000.0
    return Drive(t, 3.0 + 1.2 * np.sin(2 * np.pi * 5 * t) + 0.4 * np.sin(2 * np.pi * 13.1 * t))


def record(
    runs: list[Drive],
    *effects: AbstractEffect,
    noise: float = NOISE,
    seed: int = SEED,
    scale: float = 1.0,
    operator: RAPI | None = None,
    **fields,
) -> Recording:
    """What the paper's device (or `operator`) with `effects` answers, and white noise (GHz)."""
    device = ECDL(operator or paper_device().operator, effects)
    rows = to_batch(Recording.of(runs, [d.value for d in runs]), lead=True)
    answer = np.asarray(compiled_respond(device, rows.device()))
    rng = np.random.default_rng(seed)
    return Recording.of(
        runs,
        [
            scale * (answer[k][rows.sample[k] >= 0] + noise * rng.standard_normal(d.size))
            for k, d in enumerate(runs)
        ],
        **fields,
    )


def off(share: float) -> RAPI:
    """The paper's operator with every parameter that shows off by `share`, up and down in turn."""
    true = paper_device().operator
    up, down = 1.0 + share, 1.0 - share
    return RAPI(
        alpha=true.alpha * up,
        zeta=true.zeta * down,
        lam=true.lam * up,
        eta=true.eta,
        a=true.a * down,
        b=true.b,
        d=true.d * np.array([up, down, up]),
        d_0=true.d_0,
        plays=true.count,
    )
