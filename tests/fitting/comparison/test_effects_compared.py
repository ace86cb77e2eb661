"""Effects that one of two recordings has, or both in another size: found with their true sizes."""

import re
from unittest.mock import Mock

import numpy as np
import pytest
from worlds import answers, drives, recorded

from fitting import FitResult, compare
from fitting.comparison._differences import Interval
from fitting.comparison._estimates import PairEstimates
from fitting.comparison._joint_fit import JointFit, SharedErrors, failed_joint_fit
from rapi_jax import effects
from rapi_jax.effects import Delay, Etalon, Pickup
from rapi_jax.examples import paper_device

NOISE = 0.02  # GHz
FEW = (effects.AmplifierLowpass, Delay, Etalon, Pickup)  # a diagnosis of all takes longer


def pickup(amplitude, phase=0.4):
    return Pickup.at(amplitude=amplitude, hertz=150.0, phase=phase)


def sessions(before, after):
    return recorded(before, noise=NOISE, seed=1), recorded(after, noise=NOISE, seed=2)


def within(interval: Interval, truth: float) -> bool:
    return interval.low <= truth <= interval.high


@pytest.fixture(scope="module")
def came():
    """A tone below 1 kHz and a delay below 200 us, both small beside what their bounds allow."""
    return compare(*sessions((), (Delay.at(tau=6e-5), pickup(0.2))), effects=True, candidates=FEW)


@pytest.mark.slow
def test_effects_of_one_recording_alone_have_their_sizes_there(came):
    assert {(e.effect, e.only_in) for e in came.effects} == {
        ("delay", "after"),
        ("pickup", "after"),
    }
    sizes = {size.name: size for e in came.effects for size in e.sizes}
    truth = {"Delay.tau": 6e-5, "Pickup.amplitude": 0.2, "Pickup.hertz": 150.0}
    assert all(within(sizes[name].interval, value) for name, value in truth.items())
    assert sizes["Pickup.hertz"].words == "frequency of the pickup"
    assert 0.01 < sizes["Pickup.amplitude"].stderr / NOISE < 0.05  # nothing of it is lost in a fit
    assert came.changed and not came.parameters_changed and not came.misfit_changed
    assert not came.failures and not came.notes and came.trusted
    assert not any("." in p.name for p in came.parameters)


@pytest.mark.slow
def test_the_change_of_the_response_has_the_effects_in_it(came):
    one, two = (
        np.concatenate(answers(drives(), e)) for e in ((), (Delay.at(tau=6e-5), pickup(0.2)))
    )
    truth = float(np.std(two - one))
    assert within(came.response, truth) and came.response.high < 1.02 * truth
    assert came.headline.startswith("A delay between drive and reading and pickup at a fixed ")
    assert "are there only after: the response changed by 1" in came.headline
    assert "No other parameter is seen to have changed beside them." in came.details
    assert re.search(r"frequency of the pickup 1(49.99|50.00)\d\d \(149.9", came.sentence)
    assert "hertz" not in came.summary()


@pytest.mark.slow
def test_an_effect_in_both_of_another_size_is_compared():
    """The phase of a tone is of the session: it differs without a change of the device."""
    found = compare(
        *sessions((pickup(0.15),), (pickup(0.2, phase=2.0),)), effects=True, candidates=FEW
    )
    (one,) = found.effects
    assert one.effect == "pickup" and one.only_in is None and not one.sizes
    assert found.set == ("Pickup.amplitude",) and within(found["Pickup.amplitude"].change, 0.05)
    assert found["Pickup.amplitude"].difference.high < 0.06
    assert "Pickup.phase" not in {p.name for p in found.parameters}
    assert found.headline.startswith("The amplitude of the pickup changed by +3")
    assert found.response.value == pytest.approx(0.05 / np.sqrt(2.0), rel=0.04)


@pytest.mark.slow
def test_two_sessions_without_an_effect_have_none():
    found = compare(*sessions((), ()), effects=True, candidates=FEW)
    assert found.effects == () and not found.changed
    assert found.headline.startswith("Nothing changed that these recordings show: ")


@pytest.mark.slow
def test_an_etalon_of_one_recording_alone_is_said():
    after = (Etalon(amplitude=0.1, spacing=6.5, phase=1.0),)
    found = compare(*sessions((), after), effects=True, candidates=FEW[::2])
    (one,) = found.effects
    assert one.effect == "etalon" and one.only_in == "after" and one.after_probability > 0.9
    amplitude = next(size for size in one.sizes if size.name == "Etalon.amplitude")
    assert abs(amplitude.interval.value) == pytest.approx(0.1, rel=0.05)
    assert found.changed and found.p_change < 1e-6
    assert found.headline.startswith("An etalon in the light path is there only after: ")
    assert not found.misfit_changed
    assert "is named only after" in found.sentence


def test_a_fit_that_ended_worse_than_it_began_is_said_in_place_of_its_numbers(monkeypatch):
    """As one did that left a tone of 20 nm which the model that it began from had in it."""
    monkeypatch.setattr(SharedErrors, "of_model", lambda self, ecdl: np.array([1e-3]))
    found = compare(*sessions((), ()), ecdl=paper_device())
    assert len(found.failures) == 2 and not found.parameters and not found.trusted
    assert found.headline.startswith("What changed is not known: the fit before leaves ")
    assert "where the model that it began from leaves 1 MHz." in found.headline
    assert found.details[0].startswith("The fit after leaves ")
    assert "response changed" not in found.summary() and "found from" not in found.summary()
    assert "Which parameters changed" not in found.page() and "not known" in found.page()


def test_one_model_that_leaves_more_than_its_test_foresees_is_said():
    fit = Mock(spec=FitResult, effective=1000.0)
    pair = Mock(spec=PairEstimates, names=("alpha",), results=(fit, fit))
    pair.values = np.zeros(1), np.zeros(1)
    own = (Mock(spec=SharedErrors, return_value=np.array([0.02])),) * 2
    near, far = (JointFit(np.zeros(1), np.zeros(1), (0.02, rms)) for rms in (0.02001, 0.03))
    assert failed_joint_fit(pair, own, near, "GHz") == []
    (text,) = failed_joint_fit(pair, own, far, "GHz")
    assert "30 MHz after, where its own leaves 20 MHz, though no parameter is seen to" in text
