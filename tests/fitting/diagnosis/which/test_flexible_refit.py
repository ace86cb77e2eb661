"""The flexible operator where noise is unknown: it has to follow the drive, as hysteresis does."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._forward_selection import _needs_pairs, without_effects
from fitting.diagnosis.which.refits._flexible_refit import follows_drive
from fitting.diagnosis.which.refits._shared_base import share_flexible_base
from rapi_jax import RAPI, Recording, Run
from rapi_jax.effects import Delay
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


@pytest.mark.parametrize("late", [False, True])
def test_a_flexible_base_that_draws_a_lag_is_not_taken(late):
    """One period, so noise is unknown: beside such a base every effect would leave as little.

    All are then judged beside the identified base, and what one leaves there calls for no second.
    """
    effects = (Delay(tau=5e-3),) if late else ()
    single = record(drives((10.0,), periods=1), *effects)
    fitted = fit_base(WhitenedModel.of(single), None)
    assert not fitted.spectrum.measured
    none = without_effects(fitted.refit, fitted.state, fitted.eta_fixed[1])
    assert (none.flexible_refit is none.refit) == late
    if late:
        assert none.on_flexible_base is none.on_base
        assert share_flexible_base(none, [none]) == [none]
        assert not _needs_pairs(none, [none], noise_known=False)
    else:
        assert follows_drive(none.flexible_refit, none.on_flexible_base)
        assert none.cost < none.on_base.cost
