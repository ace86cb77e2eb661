"""Responses that turn back in mid-branch: folded readings and butterfly loops, and what is none."""

import numpy as np
import pytest
from scipy.signal import lsim

from fitting.identification.data_checks._data_checks import find_faults
from fitting.identification.data_checks.readings._reversals import find_reversals
from rapi_jax import Drive, Recording, Run, triangle
from tests.support.spoiled import WAYS, healthy


def bipolar(rate: float = 1.0, periods: int = 4) -> Drive:
    (drive,) = triangle((rate,), amplitude=300.0, bias=0.0, samples=400 * periods, periods=periods)
    return drive


def butterfly(drive: Drive, coercive: float = 60.0, width: float = 8.0) -> np.ndarray:
    """Strain of a ferroelectric: the field times the polarisation, which switches late."""
    late = np.where(drive.up, coercive, -coercive)
    return 0.01 * drive.value * np.tanh((drive.value - late) / width)


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("width", [0.5, 8.0, 30.0])
def test_a_butterfly_loop_is_named_with_its_coercive_drives(width, noise):
    drive = bipolar()
    reading = butterfly(drive, width=width)
    reading = reading + noise * np.random.default_rng(0).standard_normal(drive.size)
    recording = Recording((Run(drive, reading),), response_unit="um")
    (fault,) = find_faults(recording)
    assert fault.kind == "response turns back" and "butterfly" in fault.message
    assert all(20.0 < abs(drive.value[first]) < 100.0 for first, _ in fault.samples)


def test_a_rectified_reading_is_named_in_each_run():
    columns = healthy(75)
    WAYS["rectified"](columns)
    faults = find_faults(columns.recording())
    assert [fault.kind for fault in faults] == ["response turns back"] * 4
    assert "rectified" in faults[0].message


@pytest.mark.parametrize("lag", [0.02, 0.1, 0.2, 0.25, 0.3])
def test_a_lag_turns_as_often_as_its_drive(lag):
    """`lag`: of a period."""
    drive = bipolar(periods=6)
    late = np.interp(drive.time - lag, drive.time, drive.value, period=6.0)
    assert find_reversals(Run(drive, late)) == []


def test_ringing_after_steps_is_no_reversal():
    time = np.arange(4000) * 1e-3
    drive = Drive(time, np.where(np.mod(time, 1.0) < 0.5, 0.0, 1.0), 1.0, "step")
    w = 2.0 * np.pi * 10.0
    ringing = lsim(([w**2], [1.0, 0.05 * w, w**2]), drive.value, time)[1]
    assert find_reversals(Run(drive, ringing)) == []


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.2])
def test_healthy_runs_do_not_turn_back(noise):
    rng = np.random.default_rng(0)
    for run in healthy(76).recording().runs:
        noisy = run.response + noise * run.span * rng.standard_normal(run.drive.size)
        assert find_reversals(Run(run.drive, noisy)) == []
