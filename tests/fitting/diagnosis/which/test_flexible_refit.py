"""The flexible operator where noise is unknown: how long it is searched."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which.refits._flexible_refit import follows_drive
from rapi_jax import RAPI, Recording, Run
from rapi_jax.examples import paper_device


def _of(operator, sign: float) -> tuple[Refit, State]:
    plain = record(drives())
    runs = tuple(Run(run.drive, sign * run.response, name=run.name) for run in plain.runs)
    whitened = WhitenedModel.of(Recording(runs))
    base = BaseModel.of(whitened, operator)
    refit = Refit(whitened, whitened.make_whitener(Spectrum.of_white(1e-4)), base)
    return refit, refit.evaluate(base.prior_mean, ())


def _scaled(operator: RAPI, plays: float, polynomial: float) -> RAPI:
    def fields(o: RAPI) -> tuple:
        return o.a, o.d

    return eqx.tree_at(fields, operator, (plays * operator.a, polynomial * operator.d))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_hysteresis_turns_where_the_drive_turns(sign):
    """Of a laser whose frequency rises with the drive, and of one where it falls."""
    assert follows_drive(*_of(_scaled(paper_device().operator, sign, sign), sign))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_plays_that_outweigh_a_polynomial_against_the_drive_draw_a_lag(sign):
    """Such a response still follows its drive at large, but goes on after each turn."""
    operator = paper_device().operator
    lagging = _scaled(operator, 6.0 * sign, -0.1 * sign)
    run = record(drives()).runs[0]
    response = np.asarray(lagging(jnp.asarray(run.drive.value), jnp.asarray(run.drive.rate)))
    assert sign * np.cov(run.drive.value, response)[0, 1] > 0.0
    assert not follows_drive(*_of(lagging, sign))
