"""Promises tried out on lasers that are exactly one of two models."""

import dataclasses
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from blind_entries import OurLaser, answer, prediction, session

from fitting.blind.realised._linearity_gain import linearity_gain
from fitting.blind.realised._model_response import model_response, to_drive
from fitting.blind.realised._new_scans import KINDS, new_scans
from fitting.blind.realised._realised_gap import realised_gap
from fitting.blind.scoring._outcome import Outcome
from fitting.blind.scoring._realised import evaluate_device, evaluate_realised, redraw
from fitting.blind.simulator._bank import bank
from fitting.blind.simulator._scan import scan_from_samples
from fitting.blind.simulator._simulated_device import draw_device
from rapi_jax import ECDL, predict
from rapi_jax.effects import AmplifierLowpass, Pickup
from rapi_jax.examples import paper_device
from rapi_jax.io import write_model

BASE = paper_device()
LAG = ECDL(BASE.operator, (AmplifierLowpass.at(tau=4e-4),))
PICKUP = ECDL(BASE.operator, (Pickup.at(amplitude=0.1, hertz=50.0, phase=0.0),))
SURE = {"foreseen": {"value": 0.99, "low": 0.98, "high": 1.0}, "straighter": None}


def test_unseen_scans_were_not_recorded():
    """Whatever the session: within its range, after its end, in order of time."""
    for seed in range(30):
        scans = [run.scan for run in draw_device(seed, "null").runs]
        new = new_scans(scans)
        assert tuple(new) == KINDS
        rates, swings = [s.rate_hz for s in scans], [s.swing for s in scans]
        assert min(abs(math.log(new["rate"].rate_hz / r)) for r in rates) > 0.03
        assert min(rates) <= new["rate"].rate_hz <= max(rates)
        assert min(abs(new["amplitude"].swing - s) for s in swings) > 0.1
        assert new["amplitude"].rate_hz in rates
        assert new["waveform"].swing == pytest.approx(max(swings))
        assert int(np.argmax(new["waveform"].drive[:400])) == 280
        every = [*scans, *new.values()]
        for before, after in zip(every, every[1:], strict=False):
            assert after.start_s >= before.start_s + before.duration_s


def test_one_scan_gives_the_answer_of_predict():
    (scan, *_) = session()
    np.testing.assert_allclose(
        model_response(LAG, [scan])[0], predict(LAG, to_drive(scan)), atol=1e-9
    )


def test_answers_are_on_the_clock_of_the_session():
    scans = session()
    more = [
        a - b
        for a, b in zip(model_response(PICKUP, scans), model_response(BASE, scans), strict=True)
    ]
    for scan, difference in zip(scans, more, strict=True):
        time = scan.start_s + scan.time_s
        np.testing.assert_allclose(difference, 0.1 * np.sin(2 * np.pi * 50 * time), atol=1e-8)


def test_drives_of_any_table_repeat():
    volts = 3 + np.sin(2 * np.pi * np.arange(100) / 100) + np.sin(4 * np.pi * np.arange(100) / 100)
    assert to_drive(scan_from_samples(volts, 10.0)).repeats


def test_where_the_model_is_the_truth_all_is_closed():
    found = realised_gap(OurLaser(LAG), session(), (LAG, BASE), SURE)
    for which in ("all", *KINDS):
        assert found[which]["closed"] == pytest.approx(1.0, abs=1e-12)
        assert found[which]["rms_base"] > 0.01
        assert (found[which]["inside"], found[which]["no_worse"]) == (True, True)


def test_where_the_base_is_the_truth_nothing_was_open():
    found = realised_gap(OurLaser(BASE), session(), (LAG, BASE), SURE)
    assert (found["all"]["closed"], found["all"]["inside"]) == (None, None)


@pytest.mark.parametrize(("amplitude", "closed"), [(0.05, 0.75), (0.3, -3.0)])
def test_what_is_closed_is_a_share_of_the_square(amplitude, closed):
    """Half the effect leaves a quarter; three times the effect does harm."""
    model = ECDL(BASE.operator, (Pickup.at(amplitude=amplitude, hertz=50.0, phase=0.0),))
    found = realised_gap(OurLaser(PICKUP), session(), (model, BASE), SURE)["all"]
    assert found["closed"] == pytest.approx(closed, abs=1e-6)
    assert (found["inside"], found["no_worse"]) == (False, False)


def test_more_than_promised_is_outside_and_no_worse():
    half = ECDL(BASE.operator, (Pickup.at(amplitude=0.05, hertz=50.0, phase=0.0),))
    low = {"foreseen": {"value": 0.6, "low": 0.5, "high": 0.7}}
    judged = realised_gap(OurLaser(PICKUP), session(), (half, BASE), low)["all"]
    assert (judged["inside"], judged["no_worse"]) == (False, True)


def test_a_promise_that_was_not_made_is_not_judged():
    found = realised_gap(OurLaser(LAG), session(), (LAG, BASE), {"foreseen": None})
    assert (found["all"]["inside"], found["all"]["no_worse"]) == (None, None)


def test_the_model_that_is_the_truth_scans_straight():
    promised = {"straighter": {"value": 50.0, "low": 10.0, "high": None}}
    found = linearity_gain(OurLaser(LAG), session(), (LAG, BASE), promised)
    assert found["refused"] is None
    assert found["after"] < 1e-4 * found["span"] < found["before"]
    assert found["foreseen"] == pytest.approx(found["before"], rel=1e-3)
    assert (found["down"], found["inside"]) == (True, True)
    assert found["ratio"] == pytest.approx(found["factor"] / 50.0)


def test_a_refused_compensation_is_said():
    found = linearity_gain(OurLaser(PICKUP), session(), (PICKUP, BASE), SURE)
    assert "NotInvertible" in found["refused"]
    assert "effect pickup cannot be undone" in found["refused"]


@pytest.fixture
def entry(tmp_path):
    for name, ecdl in (("model", LAG), ("base", BASE)):
        write_model(tmp_path / f"{name}.rapi", ecdl, response_unit="GHz", drive_unit="V")
    said = prediction("amplifier_lowpass", closed=0.95)
    return Outcome.of(answer("w", "listed", "amplifier_lowpass"), said, tmp_path)


def world(ecdl, *truth, size=10.0):
    runs = [SimpleNamespace(scan=scan) for scan in session()]
    return SimpleNamespace(runs=runs, truth=truth, size=size, simulate=OurLaser(ecdl).simulate)


def test_realised_counts_and_names(entry):
    found = evaluate_realised([entry], draw=lambda a: world(LAG, "amplifier_lowpass"))
    (record,) = found["worlds"]
    assert record["error"] is None
    assert record["unseen"]["all"]["closed"] == pytest.approx(1.0)
    inside = found["unseen"]["inside"]
    assert {name: (r["k"], r["n"]) for name, r in inside.items()} == dict.fromkeys(
        ("all", *KINDS), (1, 1)
    )
    assert found["compensated"]["down"]["k"] == 1


@pytest.mark.parametrize("other", [{}, {"any_session": True}, {"hysteresis": "classical"}])
def test_a_world_is_drawn_anew_from_its_answer(entry, other):
    """Also where the verdict was wrong: what it promised is tried all the same."""
    spec = dataclasses.replace(bank(1, 40)[3], **other)
    world = spec.draw()
    written = dataclasses.asdict(spec) | {
        "name": world.name, "truth": list(world.truth), "size": world.size
    }  # fmt: skip
    again = redraw(json.loads(json.dumps(written)))
    assert again.truth == world.truth
    for a, b in zip(again.runs, world.runs, strict=True):
        np.testing.assert_array_equal(a.response, b.response)
    record = evaluate_device(dataclasses.replace(entry, answer=written, correct="other"))
    assert record["error"] is None
    assert record["right"] is False
    assert record["unseen"]["all"]["rms_base"] > 0


def test_nothing_ends_the_check(entry, tmp_path):
    def broken(a):
        raise RuntimeError("no such world")

    assert evaluate_device(entry, broken)["error"] == "RuntimeError: no such world"
    other = evaluate_device(entry, lambda a: world(LAG, "creep"))["error"]
    assert "not what its answer says" in other
    other = evaluate_device(entry, lambda a: world(LAG, "amplifier_lowpass", size=7.0))["error"]
    assert "of size 7, which is not what its answer says" in other
    (tmp_path / "base.rapi").unlink()
    found = evaluate_realised([entry], draw=lambda a: world(LAG, "amplifier_lowpass"))
    assert "base.rapi" in found["worlds"][0]["error"]
    assert found["unseen"]["inside"]["all"]["n"] == 0
    nulls = Outcome.of(answer("n", "null"), prediction("none"))
    assert evaluate_realised([nulls], draw=broken)["named"] == 0
