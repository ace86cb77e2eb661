"""The signature that a diagnosis shows is of the residual that it states, whatever the base."""

from unittest.mock import Mock

import numpy as np
import pytest

from fitting import diagnose
from fitting.diagnosis._content import describe_signature
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedErrors, WhitenedModel
from fitting.diagnosis.which._base import FittedBase
from fitting.diagnosis.which._candidate import Candidate
from rapi_jax import ECDL, RAPI, Recording, predict, triangle
from rapi_jax.effects import Delay, Etalon
from rapi_jax.examples import paper_device, paper_drives


def scan(seed, ripple):
    """A laser on a Bouc-Wen actuator, which no operator here is; `ripple`: of an etalon, GHz."""
    rng = np.random.default_rng(seed)
    drives = paper_drives(samples=1600, periods=4)[:2]
    responses = []
    for drive in drives:
        state, states = 0.0, []
        settled = np.concatenate([drive.value, drive.value])
        for step in np.diff(settled, prepend=settled[0]):
            bent = abs(state) ** 0.2 * (0.55 * abs(step) * state + 0.25 * step * abs(state))
            state += step - bent
            states.append(state)
        volts = drive.value + 0.012 * (drive.value - 3.0) ** 2
        response = 14.0 * (volts - 0.15 * np.array(states[drive.size :]))
        response += ripple * np.sin(2.0 * np.pi * response / 7.0)
        responses.append(response + rng.normal(0.0, 0.02, drive.size))
    return Recording.of(drives, responses)


@pytest.mark.parametrize("brought", [False, True])
def test_the_effect_shows_and_no_more_than_the_residual(brought):
    model = ECDL(RAPI.initial_guesses(scan(0, 0.0), count=1)[0]) if brought else None
    content = diagnose(model, scan(1, 0.3), candidates=(Etalon,), scan=False).content
    (found,) = content["signature"]
    total = content["gap"]["total"]
    assert found["effect"] == "etalon" and found["rms_with"] < found["rms_without"] <= total
    assert found["rms_without"] > 0.7 * 0.3 / np.sqrt(2)
    for row in found["rows"]:
        shown = np.array(row["without"])
        assert abs(shown.mean()) < 0.1 and 0.4 < np.ptp(shown) < 0.8
    assert all(run["before"] <= total for run in content["shrinkage"]["by_run"])


def state(errors, left, *effects):
    """The end of a refit that leaves `errors`, and `left` times what noise does."""
    chi2 = np.full(100, np.sqrt(left))
    return Mock(
        spec=State,
        errors=WhitenedErrors(errors, chi2, chi2),
        synchronous=100.0 * left,
        nonsynchronous=100.0,
        effects=effects,
    )


@pytest.mark.parametrize("brought", [None, 0.8, 1.5])
def test_without_the_effect_the_picture_is_of_what_the_model_leaves(brought):
    """Not of a flexible base, which takes up the effect and leaves an origin that noise hides.

    `brought`: the errors of a model that was, in those of the base refitted.
    """
    whitened = WhitenedModel.of(scan(0, 0.0))
    effect = Etalon.at(amplitude=0.3, spacing=7.0)
    ripple = [0.3 * np.sin(2.0 * np.pi * b.data / 7.0) for b in whitened.blocks]
    flexible = [0.1 * r + 0.55 for r in ripple]
    nothing = [0.0 * r for r in ripple]
    none, top = Mock(spec=Candidate), Mock(spec=Candidate, effects=(effect,))
    none.on_base = state(ripple, 50.0)
    none.on_flexible_operator = Mock(spec=Refit), state(flexible, 5.0)
    top.on_base = state(ripple, 50.0, effect)
    top.on_flexible_base = state(nothing, 1.0, effect)
    top.on_flexible_operator = Mock(spec=Refit), state(nothing, 1.0, effect)
    fitted = Mock(spec=FittedBase, refit=Mock(spec=Refit), given=None)
    if brought is not None:
        fitted.given = [brought * r + 0.2 for r in ripple]
    (found,) = describe_signature(whitened, fitted, none, top)
    size = min(brought or 1.0, 1.0) * 0.3
    assert found["rms_without"] == pytest.approx(size / np.sqrt(2.0), rel=0.05)
    assert all(np.ptp(row["without"]) > 1.9 * size for row in found["rows"])


def test_of_two_effects_each_is_shown_beside_the_other():
    """An etalon's ripple without the lag of a delay, which parts the two branches by 0.2 GHz."""
    true = (Delay.at(tau=6e-5), Etalon.at(amplitude=0.06, spacing=7.0))
    laser = ECDL(paper_device().operator, true)
    drives = triangle([10.0, 40.0], amplitude=4.5, bias=3.0, samples=2400, periods=3)
    rng = np.random.default_rng(3)
    told = [
        np.asarray(predict(laser, one)) + 0.02 * rng.standard_normal(one.size) for one in drives
    ]
    found = diagnose(None, Recording.of(drives, told), candidates=(Delay, Etalon), scan=False)
    assert found.verdict.name == "delay+etalon"
    shown = {one["effect"]: one for one in found.content["signature"]}
    ripple = shown["etalon"]
    assert ripple["rms_without"] == pytest.approx(0.06 / np.sqrt(2.0), rel=0.1)
    rows = [np.array(row["without"]) for row in ripple["rows"]]
    assert all(0.9 * 0.12 < np.ptp(row) < 1.4 * 0.12 for row in rows)
    # The delay shifts a triangle's fast branch by 60 us of 40 Hz, less what hysteresis takes up.
    assert shown["delay"]["rms_without"] > 2.0 * shown["delay"]["rms_with"]
