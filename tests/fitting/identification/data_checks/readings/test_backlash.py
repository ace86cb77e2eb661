"""A joint with backlash under a sine, and its slow sensor: neither clipped nor frozen."""

import numpy as np
import pytest

from fitting.identification.data_checks._data_checks import find_faults
from fitting.identification.data_checks.readings._held import find_hold
from rapi_jax import Drive, Recording, Run
from rapi_jax.io.imports._decimate import decimate

RATE, STEP_S, SIZE = 0.2, 1e-3, 12_000  # 2.4 periods
WIDTH, STEP = 12.0, 0.02  # of the play and of the sensor; the drive swings by 100


def joint(hold: int = 1, jitter: int = 0, seed: int = 0) -> Run:
    """A play that creeps a little once the drive has turned, read every `hold` samples."""
    time = np.arange(SIZE) * STEP_S
    u = 50.0 * np.sin(2.0 * np.pi * RATE * time)
    y, at, rested = np.zeros(SIZE), 0.0, 0
    for k, value in enumerate(u):
        moved = min(max(at, value - WIDTH / 2.0), value + WIDTH / 2.0)
        rested = rested + 1 if moved == at and k > 500 else 0
        at = moved
        y[k] = at + 0.1 * np.sign(value) * (1.0 - np.exp(-rested / 300.0))
    y = STEP * np.round(y / STEP)
    rng = np.random.default_rng(seed)
    begins = np.arange(0, SIZE, hold)
    begins = np.unique(np.clip(begins + rng.integers(-jitter, jitter + 1, begins.size), 0, SIZE))
    begins[0] = 0
    held = y[begins[np.searchsorted(begins, np.arange(SIZE), side="right") - 1]]
    return Run(Drive(time, u, RATE, "sine"), held)


def kinds(run: Run) -> list[str]:
    return [fault.kind for fault in find_faults(Recording((run,)))]


def with_reading(run: Run, response: np.ndarray) -> Run:
    return Run(run.drive, response)


def test_a_play_rests_after_each_turn_of_its_drive():
    assert kinds(joint()) == []


@pytest.mark.parametrize(("hold", "jitter"), [(24, 1), (24, 2), (15, 1)])
def test_a_reading_that_is_held_is_said_to_be_that_and_the_cure_works(hold, jitter):
    run = joint(hold, jitter)
    (fault,) = find_faults(Recording((run,)))
    assert fault.kind == "held reading"
    assert f"updated only every {hold} samples" in fault.message
    assert f"`--decimate {hold}`" in fault.message
    (cured,), _ = decimate([run], hold, 10**6)
    assert kinds(cured) == []


@pytest.mark.parametrize("hold", [1, 24])
def test_a_play_that_is_clipped_is_found(hold):
    run = joint(hold)
    clipped = with_reading(run, np.clip(run.response, -30.0, 100.0))
    (fault,) = [one for one in find_faults(Recording((clipped,))) if one.kind == "clipped"]
    assert "stays at -30 " in fault.message
    assert len(fault.samples) == 2  # it stays there through each of two turns


def test_a_play_whose_reading_hangs_in_mid_branch_is_found():
    run = joint()
    y = run.response.copy()
    y[2300:2500] = y[2300]
    (fault,) = find_faults(Recording((with_reading(run, y),)))
    assert fault.kind == "frozen reading"
    ((first, last),) = fault.samples
    assert 2290 <= first <= 2300 and 2499 <= last <= 2510


def test_readings_that_change_with_every_sample_or_by_single_steps_are_not_held():
    rng = np.random.default_rng(0)
    slow = np.linspace(0.0, 1.0, 5000)
    assert find_hold(slow + 1e-3 * rng.standard_normal(5000)) == 0
    assert find_hold(np.round(slow * 200.0)) == 0  # a step every 25 samples
    assert find_hold(joint().response) == 0


def test_a_play_whose_encoder_was_resampled_rests_without_hanging():
    """Resampling hides the steps of an encoder: values repeat all along, where it rests longer."""
    run = joint()
    coarse = Run(run.drive, 0.3 * np.round(run.response / 0.3))
    time = np.arange(0.0, run.drive.time[-1], 0.0237)
    drive = Drive(time, np.interp(time, run.drive.time, run.drive.value), RATE, "sine")
    near = np.searchsorted(run.drive.time, time)
    rng = np.random.default_rng(1)
    moved = np.where(rng.random(time.size) < 0.5, 1e-9 * rng.standard_normal(time.size), 0.0)
    assert kinds(Run(drive, coarse.response[near] + moved)) == []
