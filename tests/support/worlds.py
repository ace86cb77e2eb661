"""Simulated sessions with known effects, and how large an effect is in a diagnosis's eyes."""

import dataclasses

import numpy as np
from examples_drive import EXAMPLES as ON_DRIVE
from examples_optical import EXAMPLES as ON_RESPONSE

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which.refits._flexible_refit import flexible_operator
from fitting.diagnosis.which.screening._base_remainder import orthonormal_basis
from rapi_jax import ECDL, Drive, Recording, triangle
from rapi_jax._ecdl import compiled_respond
from rapi_jax._precision import float64
from rapi_jax.effects import ALL, AbstractEffect
from rapi_jax.examples import paper_device
from rapi_jax.sampling._batch import to_batch

TRUTHS: dict[str, AbstractEffect] = {**ON_DRIVE, **ON_RESPONSE}


def drives(
    rates=(10.0, 20.0, 40.0), amplitudes=(2.0, 3.0), periods=4, samples=400, pause_s=0.2
) -> tuple[Drive, ...]:
    """Triangles about 3 V, one after the other in one session."""
    out, start = [], 0.0
    for amplitude in amplitudes:
        for rate in rates:
            (drive,) = triangle(
                rate, amplitude=amplitude, bias=3.0, samples=periods * samples, periods=periods
            )
            out.append(dataclasses.replace(drive, start_s=start))
            start += periods / rate + pause_s
    return tuple(out)


def ordered(effects) -> tuple[AbstractEffect, ...]:
    """Effects in the order of `effects.ALL`, in which they stand in the light's path."""
    return tuple(sorted(effects, key=lambda effect: ALL.index(type(effect))))


@float64
def answers(session: tuple[Drive, ...], effects=()) -> list[np.ndarray]:
    """What the paper's device with these effects answers, without noise: one session."""
    ecdl = ECDL(paper_device().operator, ordered(effects))
    data = to_batch(Recording.of(session, [d.value for d in session]), lead=True)
    rows = np.asarray(compiled_respond(ecdl, data.device()))
    return [rows[k][data.sample[k] >= 0] for k in range(len(session))]


def recorded(effects=(), *, noise: float, seed: int = 0, session=None) -> Recording:
    """The same with white noise, GHz a sample."""
    session = drives() if session is None else session
    rng = np.random.default_rng(seed)
    clean = answers(session, effects)
    return Recording.of(session, [y + noise * rng.standard_normal(y.size) for y in clean])


@float64
def projected(effects, session=None) -> float:
    """Rms over samples of what effects add and no richer hysteresis could absorb, GHz."""
    session = drives() if session is None else session
    whitened = WhitenedModel.of(Recording.of(session, answers(session)))
    operator = paper_device().operator
    whitener = whitened.make_whitener(Spectrum.of_white(1.0))
    plain = BaseModel.of(whitened, operator)
    rich = flexible_operator(whitened, plain, plain.prior_mean)
    refit = Refit(whitened, whitener, rich)
    bare = refit.evaluate(rich.prior_mean, ())
    full = refit.evaluate(rich.prior_mean, ordered(effects))
    s = full.errors.synchronous - bare.errors.synchronous
    t = full.errors.nonsynchronous - bare.errors.nonsynchronous
    q = orthonormal_basis(refit.jacobian_base(bare))
    s = s - q @ (q.T @ s)
    return float(np.sqrt((s @ s + t @ t) / sum(block.size for block in whitened.blocks)))
