"""Sessions of look-alikes: the hypotheses as fitted to them, and the scans that separate these."""

import dataclasses
import functools

import numpy as np

from fitting.diagnosis.next_scan import _choice
from fitting.diagnosis.next_scan._rival_set import Hypothesis, RivalSet
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which.evidence._tempering import Tempering
from rapi_jax import Recording, triangle
from rapi_jax.effects._amplifier_lowpass import AmplifierLowpass
from rapi_jax.effects._creep import Creep
from rapi_jax.effects._current_coupling import CurrentCoupling
from rapi_jax.effects._delay import Delay
from rapi_jax.effects._drift import Drift
from rapi_jax.effects._etalon import Etalon
from rapi_jax.effects._pickup import Pickup
from rapi_jax.examples import paper_device

N, P = 200, 3
RATES, AMPLITUDES = (10.0, 40.0), (2.0, 3.0)
NOISE = 0.02
WHITE = Spectrum.of_white(NOISE**2)
EXACT = Tempering()  # effects that follow their equations exactly
LAGS = ((Delay(tau=1.3e-4),), (AmplifierLowpass(tau=1.3e-4),))
SLOW = ((Creep(gain=0.001),), (Drift(amplitude=0.05, tau=1.0),))
# On one triangle at 20 Hz, a pickup of its fourth harmonic ripples as an etalon does.
SINES = (
    (Pickup(amplitude=0.01, phase=np.pi / 2, hertz=80.0),),
    tuple(
        Etalon(amplitude=0.008, phase=phase, spacing=spacing)
        for spacing in (22.0, 24.0, 26.0, 28.0)
        for phase in (0.0, 1.6, 3.2, 4.8)
    ),
)


def drives(rates=RATES, amplitudes=AMPLITUDES):
    """Triangles of one session."""
    out, start = [], 0.0
    for amplitude in amplitudes:
        for hz in rates:
            (one,) = triangle(hz, amplitude=amplitude, bias=3.0, samples=P * N, periods=P)
            out.append(dataclasses.replace(one, start_s=start))
            start += P / hz + 0.2
    return out


def recorded(operator, effects, runs):
    """The session without noise; each run with a zero of its own."""
    blank = Recording.of(runs, [np.zeros(d.size) for d in runs], response_origin="run")
    whitened = WhitenedModel.of(blank)
    base = BaseModel.of(whitened, operator)
    rows = whitened.response_rows(
        effects, whitened.operator_response(operator, base.prior_mean, effects)
    )
    model = [block.interpolate(rows[k]) for k, block in enumerate(whitened.blocks)]
    full = [np.resize(m.ravel(), d.size) for m, d in zip(model, runs, strict=True)]
    return Recording.of(runs, full, response_origin="run")


@functools.cache
def world(truth, *rivals):
    """Model, whitening, base and each hypothesis as fitted to data of `truth`, without noise."""
    operator = paper_device().operator
    runs = drives((20.0,), (3.0,)) if truth == "sines" else drives()
    whitened = WhitenedModel.of(recorded(operator, PAIRS[truth][0], runs))
    base, whitener = BaseModel.of(whitened, operator), whitened.make_whitener(WHITE)
    refit = Refit(whitened, whitener, base)
    starts = [e for name in (truth, *rivals) for e in PAIRS[name]]
    # The best of several starts, each alone.
    tries = [
        [refit.minimise(refit.evaluate(base.prior_mean, (e,)), 25) for e in some] for some in starts
    ]
    fits = [min(some, key=lambda state: state.cost) for some in tries]
    said = [Hypothesis(f.effects[0].name, f.effects, f.values, 1.0 / len(fits)) for f in fits]
    return whitened, whitener, base, said


FEED = ((CurrentCoupling(coupling=-2.5e-3),), (Delay(tau=1.3e-4),))
PAIRS = {"lags": LAGS, "slow": SLOW, "sines": SINES, "feed": FEED}


def rival_set(setup, tempering=EXACT, excess=None):
    """The hypotheses of a world, `none` at its own fit beside them."""
    whitened, whitener, base, said = setup
    refit = Refit(whitened, whitener, base)
    found = refit.minimise(refit.evaluate(base.prior_mean, ()), 25)
    none = Hypothesis("none", (), found.values, 0.0)
    excess = {frozenset(): found.cost} if excess is None else excess
    return RivalSet.of(
        refit,
        said,
        tempering=tempering,
        stake=lambda one, other: excess.get(one & other, 0.0),
        others=[none],
    )


def choose_next_scan(whitened, whitener, base, said, limits=None, tempering=EXACT):
    """The scan for a world, or for some of its hypotheses."""
    rivals = rival_set((whitened, whitener, base, said), tempering)
    return _choice.choose_next_scan(whitened, whitener, rivals, limits)
