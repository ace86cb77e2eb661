"""What is predicted of scans not recorded, against laws that are known."""

import dataclasses

import numpy as np
import pytest
from worlds import (
    BaseModel,
    Refit,
    WhitenedModel,
    answers,
    drives,
    flexible_operator,
    projected,
    recorded,
)

from fitting import diagnose
from fitting.diagnosis.how_far._predicted_gain import _can_be_compensated, nonlinearity_rms
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit.estimates._estimates import effective_parameter_count
from rapi_jax import Recording, parameters
from rapi_jax._precision import float64
from rapi_jax.effects import Delay, Pickup
from rapi_jax.examples import paper_device

SESSION = drives(rates=(10.0, 20.0, 40.0), periods=3, samples=192)


def block(samples=400):
    """One block of a triangle of 400 samples a period, and the share of each ramp gone by."""
    (one,) = drives(rates=(20.0,), amplitudes=(2.0,), periods=2, samples=samples)
    found = WhitenedModel.of(Recording.of([one], [one.value])).blocks[0]
    half = samples // 2
    return found, np.tile(np.arange(samples) % half / half, (found.periods, 1))


def test_straight_ramps_are_not_nonlinearity_rms():
    found, share = block()
    for up, down in ((1.0, 1.0), (3.0, -7.0)):
        rising = np.arange(share.shape[1]) < share.shape[1] // 2
        assert nonlinearity_rms(np.where(rising, up, down) * share + 5.0, found) == pytest.approx(
            0, abs=1e-9
        )


def test_a_bow_on_each_ramp_has_the_rms_of_a_parabola_about_its_line():
    """Over a width w the rms of x^2 about its best line is w^2 / sqrt(180)."""
    found, share = block()
    assert nonlinearity_rms(share**2, found) == pytest.approx(0.8**2 / np.sqrt(180.0), rel=0.02)


def test_what_does_not_repeat_is_no_crookedness():
    found, share = block()
    odd = np.where(np.arange(found.periods)[:, None] % 2 == 0, 1.0, -1.0)
    assert nonlinearity_rms(odd * share**2, found) == pytest.approx(0.0, abs=1e-12)


@float64
def refit():
    whitened = WhitenedModel.of(Recording.of(SESSION, answers(SESSION)))
    plain = BaseModel.of(whitened, paper_device().operator)
    rich = flexible_operator(whitened, plain, plain.prior_mean)
    return Refit(whitened, whitened.make_whitener(Spectrum.of_white(1e-4)), rich)


@float64
def test_the_number_of_values_determined_lies_between_none_and_all():
    one = refit()
    state = one.evaluate(one.base.prior_mean, ())
    free = int(one.base.free.sum())
    count = effective_parameter_count(one, state)
    assert 5 < count < free
    held = dataclasses.replace(
        one, base=dataclasses.replace(one.base, prior_std=one.base.prior_std * 1e-9)
    )
    finite = np.isfinite(one.base.prior_std)
    assert effective_parameter_count(held, state) <= int((one.base.free & ~finite).sum()) + 1e-3
    nonsynchronous = dataclasses.replace(
        one, base=dataclasses.replace(one.base, prior_std=one.base.prior_std * 1e9)
    )
    assert effective_parameter_count(nonsynchronous, state) > count


@float64
def test_no_drive_is_promised_from_a_model_that_does_not_rise_with_it():
    one = refit()
    state = one.evaluate(one.base.prior_mean, ())
    assert _can_be_compensated(one.whitened, one, state, 0)
    operator = one.whitened.set_values(one.base.operator, state.values)
    values, at = state.values.copy(), 0
    for p in parameters(operator):
        if p.name == "d":
            values[at] -= 60.0  # GHz/V: far below zero right after each turn
        at += p.size
    falling = dataclasses.replace(state, values=values)
    assert not _can_be_compensated(one.whitened, one, falling, 0)


@pytest.mark.slow
def test_a_diagnosis_foresees_what_closes_and_how_straight_a_scan_becomes():
    truth = Delay(tau=1e-4)
    noise = projected([truth], SESSION) / 4.0
    report = diagnose(None, recorded([truth], noise=noise, session=SESSION), scan=False)
    found = report.content["shrinkage"]
    for name in ("foreseen", "straighter"):
        assert found[name]["low"] <= found[name]["value"] <= found[name]["high"]
    assert found["foreseen"]["high"] <= 1.0 and found["foreseen"]["value"] > 0.9
    assert found["straighter"]["low"] > 1.0
    scan = found["nonlinearity"]
    assert scan["after"]["low"] <= scan["after"]["value"] <= scan["after"]["high"] < scan["before"]
    assert scan["before"] / scan["after"]["value"] == pytest.approx(found["straighter"]["value"])


@pytest.mark.slow
def test_no_scan_becomes_straighter_by_an_effect_that_no_drive_allows_for():
    truth = Pickup(amplitude=0.05, hertz=50.3, phase=0.3)
    report = diagnose(None, recorded([truth], noise=0.01, session=SESSION), scan=False)
    assert report.verdict.name == "pickup"
    found = report.content["shrinkage"]
    assert found["straighter"] is None and found["foreseen"]["high"] > 0.9
    assert found["nonlinearity"] is None
