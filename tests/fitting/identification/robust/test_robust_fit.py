"""Fits of data that cannot be cleaned: values, errors, verdict, and that nothing is left out."""

import dataclasses
import json
import runpy
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fitting import fit, fit_many, identify
from fitting.identification.robust import _reweighting
from rapi_jax import ECDL, RAPI, Recording
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import write_recording

TRUE = {"alpha": 0.2811, "zeta": 6.7126e-3, "lam": 1.6, "a": 0.6317, "d_1": 18.787}
SIGMA = 0.020


def contaminated(seed, share=0.05, size=10.0, samples=1000):
    """The paper's recording, of whose readings a share has so many times the noise."""
    recording, truth = paper_recording(samples=samples, noise=0.0)
    rng = np.random.default_rng(seed)
    responses = []
    for y in truth:
        error = SIGMA * rng.standard_normal(y.size)
        responses.append(y + error * np.where(rng.random(y.size) < share, size, 1.0))
    return Recording.of(recording.drives, responses)


@pytest.fixture(scope="module")
def gross():
    """A tenth of the readings are 30 times as noisy."""
    return contaminated(1, share=0.10, size=30.0)


@pytest.mark.parametrize("loss", ["huber", "student"])
def test_gross_errors_do_not_spoil_a_robust_fit(gross, loss):
    found = fit(ECDL(RAPI.guess(gross)), gross, loss=loss)
    assert found.loss == loss and found.verdict.trusted
    assert all((used == run.valid).all() for used, run in zip(found.used, gross.runs, strict=True))
    assert not any(fault.left_out for fault in found.faults)
    assert any(loss in note and "no reading is left out" in note for note in found.verdict.notes)
    for name, value in TRUE.items():
        assert abs(found[name].value - value) < 4.0 * found[name].stderr, name
    # Nearly as well known as without the gross errors, of whose readings nine in ten are good.
    clean, _ = paper_recording(samples=1000, noise=SIGMA, seed=5)
    usual = fit(ECDL(RAPI.guess(clean)), clean, hold_out=False, starts=2)
    for name in TRUE:
        assert found[name].stderr < 1.5 * usual[name].stderr, name
    assert found.claim is not None and found.claim.rms < 2.0 * SIGMA


def test_least_squares_says_that_so_many_are_no_accident(gross):
    found = fit(ECDL(RAPI.guess(gross)), gross, throw=False)
    assert found.loss == "squares" and not found.verdict.trusted


@pytest.mark.parametrize("loss", ["huber", "student"])
def test_clean_data_give_the_same_fit_as_squares(loss):
    data, _ = paper_recording(samples=1000, noise=SIGMA, seed=2)
    start = ECDL(RAPI.guess(data))
    plain, robust = (
        fit(start, data, loss=kind, starts=2, hold_out=("last third",))
        for kind in ("squares", loss)
    )
    for name in TRUE:
        assert abs(robust[name].value - plain[name].value) < 0.7 * plain[name].stderr, name
        assert 0.95 < robust[name].stderr / plain[name].stderr < 1.15, name
    assert robust.rmse == pytest.approx(plain.rmse, rel=1e-3)
    assert robust.rmse_held_out == pytest.approx(plain.rmse_held_out, rel=0.1)


def test_the_estimate_solves_hubers_equations(gross):
    found = fit(ECDL(RAPI.guess(gross)), gross, loss="huber", weights="uniform", hold_out=False)
    # A part of the model that is linear: its column is orthogonal to what the loss makes of errors.
    total, size = 0.0, 0.0
    for run, made, used in zip(gross.runs, found.predicted, found.used, strict=True):
        error = (made - run.response)[used]
        scale = 1.4826 * np.median(np.abs(error))
        psi = np.clip(error, -1.345 * scale, 1.345 * scale)
        total += float(psi @ run.drive.value[used])
        size += float(np.abs(psi) @ np.abs(run.drive.value[used]))
    assert abs(total) < 1e-4 * size


def test_weights_that_do_not_come_to_rest_are_no_trusted_fit(gross, monkeypatch):
    limits = dataclasses.replace(_reweighting.THRESHOLDS, reweighting_rounds=1)
    monkeypatch.setattr(_reweighting, "THRESHOLDS", limits)
    found = fit(ECDL(RAPI.guess(gross)), gross, loss="huber", hold_out=False, throw=False)
    assert not found.verdict.trusted
    assert any("rounds of weights for loss 'huber'" in reason for reason in found.verdict.reasons)


def test_an_unknown_loss_is_refused_before_a_fit(gross):
    with pytest.raises(ValueError, match="Argument `loss`"):
        fit(paper_device(), gross, loss="cauchy")


def test_many_and_identify_and_the_file_say_the_loss(gross, tmp_path):
    (many,) = fit_many(ECDL(RAPI.guess(gross)), [gross], loss="student")
    one = identify(gross, loss="student", each=(), hold_out=False)
    assert many.loss == one.loss == "student"
    for name in TRUE:
        assert many[name].value == pytest.approx(one[name].value, abs=0.05 * one[name].stderr)
    assert one.to_dict()["loss"] == "student" and "student" in one.summary()
    one.save(tmp_path, plots=False)
    assert json.loads((tmp_path / "model.json").read_text())["loss"] == "student"


def test_the_command_takes_a_loss(gross, tmp_path, capsys):
    from fitting.cli import app
    from fitting.commands.run import run

    write_recording(gross, tmp_path / "in")
    line = ["fit", str(tmp_path / "in"), "-o", str(tmp_path / "out"), "--loss", "huber"]
    assert run(app, [*line, "--each", "none", "--no-plots"]) == 0
    assert json.loads((tmp_path / "out" / "model.json").read_text())["loss"] == "huber"
    capsys.readouterr()


@pytest.mark.slow
@pytest.mark.parametrize("loss", ["huber", "student"])
@pytest.mark.parametrize("kind", ["student", "contaminated"])
def test_intervals_hold_the_truth_under_heavy_tails(kind, loss):
    """95 % intervals of 10 correlated parameters, in 40 replicates."""
    program = runpy.run_path(str(Path(__file__).parents[3] / "benchmarks" / "coverage.py"))
    noise = partial(program["heavy"], kind=kind, sigma=SIGMA)
    found, _ = program["coverage"](noise, 40, 1000, (7, len(kind)), loss)
    assert 0.90 < np.mean(list(found.values())) < 0.99
