"""The closed form of the operator's derivative against JAX, which goes through every sample."""

import functools

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._compiled_stages import linearise_response
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.refit.jacobian._operator_jacobian import linearise_in_closed_form
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import PI, RAPI, FixedRAPI, MixedRAPI
from rapi_jax.effects import AmplifierLowpass, AmplitudeLaw, SlewLimit
from rapi_jax.examples import paper_device

EFFECTS = {
    "none": (),
    "drive": (AmplifierLowpass(tau=2e-3),),
    "slew limit": (SlewLimit(limit=150.0),),
    "law": (AmplitudeLaw(gain=0.02, threshold=0.1),),
}
RNG = np.random.default_rng(3)


def changed(operator, size=0.05):
    """The operator with every value moved, so that none is special."""
    base = BaseModel.of(whitened_of("steady"), operator)
    moved = base.prior_mean * (1.0 + size * RNG.normal(size=base.prior_mean.size))
    return whitened_of("steady").set_values(operator, moved)


SESSIONS = {
    "steady": {"amplitudes": (3.0, 2.0), "phase": 0.37, "periods": 3},
    "less than a period": {"samples": 200.37, "periods": 1.4},
}


@functools.cache
def whitened_of(session):
    return WhitenedModel.of(record(drives(**SESSIONS[session])))


KINDS = ("paper", "individual", "flexible", "falling", "crossed", "fixed", "mixed", "classical")


def operator_of(kind, recording):
    if kind in ("paper", "individual"):
        each = ("lam", "eta") if kind == "individual" else ()
        return changed(RAPI.guess(recording, each=each) if each else paper_device().operator)
    if kind == "flexible":
        form = paper_device().operator.flexible(recording)
        return eqx.tree_at(lambda o: o.bow, changed(form.operator, 0.02), jnp.asarray(-0.01))
    if kind in ("falling", "crossed"):  # bounds that fall on a part of the drive, or cross there
        form = paper_device().operator.flexible(recording)
        operator = changed(form.operator, 0.02)
        eta = operator.eta * (1.0 if kind == "falling" else -1.5)
        return eqx.tree_at(lambda o: (o.bow, o.eta), operator, (jnp.asarray(-0.5), eta))
    if kind == "classical":
        r = jnp.linspace(0.1, 1.2, 6)
        return PI(r=r, p=jnp.linspace(3.0, 1.0, 6), d=jnp.array([5.0, 0.3]), d_0=2.0, origin=1.5)
    cls = {"fixed": FixedRAPI, "mixed": MixedRAPI}[kind]
    return cls.guess(recording)


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("session", SESSIONS)
def test_it_is_the_derivative_through_all_samples(session, kind, name):
    whitened, effects = whitened_of(session), EFFECTS[name]
    operator = operator_of(kind, whitened.recording)
    values = BaseModel.of(whitened, operator).prior_mean
    if values.size > BaseModel.of(whitened_of("steady"), operator).prior_mean.size:
        values[-whitened.initial_state_size(operator.count) :] = RNG.uniform(
            0.1, 0.9, whitened.initial_state_size(operator.count)
        )
    given = whitened.operator_input(effects)
    start = whitened._padded_initial_state(operator, values)
    place = np.asarray(whitened._first_period_drives(effects).place)
    found = linearise_in_closed_form(operator, values, given, start, place)
    assert found is not None
    response, derivative = linearise_response(
        operator, values, given._replace(stretches=None), start
    )
    want = whitened.at_first_period(effects, response)
    np.testing.assert_allclose(found.response, want, rtol=1e-11, atol=1e-9)
    columns = whitened.at_first_period(effects, derivative)
    size = np.abs(columns).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(found.derivative - columns) <= 1e-9 * np.maximum(size, 1e-9))


class Doubled(RAPI):
    def memoryless(self, u):
        return 2.0 * super().memoryless(u)


def test_no_closed_form_where_drives_turn_often_or_the_response_is_another():
    whitened = whitened_of("steady")
    plain = paper_device().operator
    often = whitened.operator_input(())._replace(stretches=None)
    doubled = Doubled.guess(whitened.recording)
    place = np.asarray(whitened._first_period_drives(()).place)
    for operator, given in ((plain, often), (doubled, whitened.operator_input(()))):
        values = BaseModel.of(whitened, operator).prior_mean
        assert linearise_in_closed_form(operator, values, given, None, place) is None
    # The columns then come from JAX.
    columns = whitened.linearise_operator(doubled, values, ()).derivative
    d_1 = whitened_of("steady").at_first_period((), whitened.operator_input(()).u)
    np.testing.assert_allclose(columns[place_of(doubled, "d_1")], 2.0 * d_1, rtol=1e-12)


def place_of(operator, name):
    return ParameterVector.of(operator).names.index(name)
