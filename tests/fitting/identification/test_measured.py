"""Measured recordings by others, where at hand; nothing of them is part of this project."""

import json

import numpy as np
import pytest

from fitting import fit
from fitting.cli import app
from fitting.commands.run import run
from rapi_jax import ECDL, RAPI
from rapi_jax.io import read_recording


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


@pytest.mark.slow
def test_picma_last_third_of_the_periods(shared_data, tmp_path):
    """A PICMA piezo at 1 Hz, fitted on two thirds of 39 periods, tested on the rest."""
    assert rapi("fit", shared_data / "picma_1hz", "-o", tmp_path, "--no-plots") == 0
    model = json.loads((tmp_path / "model.json").read_text())
    assert model["unit"] == "um"
    assert model["rmse_held_out"] <= 0.22
    assert model["held_out"]["last third"]["std"] <= 0.11
    assert any("lag" in note for note in model["verdict"]["notes"])


@pytest.mark.parametrize(
    "name", ["afm_z_open_loop", pytest.param("afm_z_closed_loop", marks=pytest.mark.slow)]
)
def test_afm_from_an_unconditioned_state(shared_data, name):
    """AFM z piezos whose first cycle starts anywhere: initial values freed, error below 2.2 %."""
    recording = read_recording(shared_data / name)
    got = fit(ECDL(RAPI.guess(recording)), recording, starts=2, hold_out=False, throw=False)
    assert max(run.rmse_fraction for run in got.runs) < 0.022
    assert not any("hop" in reason or "clipped" in reason for reason in got.verdict.reasons)


def test_servo_lag_is_noted_as_undecidable(shared_data):
    """A servo's lag looks like hysteresis at one rate: fitted, and the notes say so."""
    recording = read_recording(shared_data / "servo_lag")
    got = fit(ECDL(RAPI.guess(recording)), recording, starts=2, hold_out=False, throw=False)
    assert np.isfinite(got.rmse) and got.runs[0].rmse_fraction < 0.02
    assert any(
        "lag" in note and "cannot be told from hysteresis" in note for note in got.verdict.notes
    )
