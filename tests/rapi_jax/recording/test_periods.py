"""Periods and branches of drives that repeat, and what leads in to them."""

import dataclasses

import numpy as np
import pytest
from periodic_drives import BIN, periodic

from rapi_jax import Drive, Run


@pytest.mark.parametrize("per_period", [400.0, 400.37, 51.3])
@pytest.mark.parametrize("minimum", [0.0, 0.2, 0.5, 0.83])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_periods_begin_at_the_minimum_and_broken_ends_are_left_out(per_period, minimum, noise):
    samples = round(4.6 * per_period)
    drive = periodic(samples, per_period, minimum, noise=noise)
    cycles = np.arange(samples) / per_period - minimum
    # Means over a bin have noise of 0.01 V (per_period = 51: 0.02 V); the drive moves by 0.04 V
    # (0.16 V) over one.
    slack = (2.0 if noise == 0.0 else 3.0) * max(BIN, 1.0 / per_period)
    clear = np.abs(cycles - np.round(cycles)) > slack
    # complete: 0 to 4 of 4.6 cycles, or from the first minimum on
    complete = np.floor(4.6 - minimum)
    expected = np.where((cycles >= 0) & (cycles < complete), np.floor(cycles), -1)
    assert drive.periods == complete
    assert np.array_equal(drive.period[clear], expected[clear])
    phase = np.mod(drive.phase - cycles + 0.5, 1.0) - 0.5
    assert np.abs(phase).max() <= slack
    turning = np.abs(np.mod(cycles, 0.5) - 0.25) > 0.25 - slack
    up = np.mod(cycles, 1.0) < 0.5
    assert np.array_equal(drive.up[~turning], up[~turning])
    assert turning.mean() < 0.3


@pytest.mark.parametrize("minimum", [0.0, 0.37])
def test_exactly_one_period_is_complete_wherever_it_starts(minimum):
    drive = periodic(400, 400.0, minimum)
    assert drive.periods == 1 and (drive.period == 0).all()


def test_less_than_one_period_is_none():
    drive = periodic(300, 400.0)
    assert drive.periods == 0 and (drive.period == -1).all()


def test_rising_and_falling_branches_need_not_be_equal():
    """A slow ramp and a flyback of a tenth of the period."""
    cycles = np.arange(2000) / 500
    phase = np.mod(cycles, 1.0)
    value = np.where(phase < 0.9, phase / 0.9, (1.0 - phase) / 0.1)
    drive = Drive(cycles / 5.0, value, 5.0, "other")
    repeating = dataclasses.replace(drive, waveform="triangle")
    for d in (drive, repeating):
        clear = (np.abs(phase - 0.9) > 0.01) & (phase > 0.01) & (phase < 0.99)
        assert np.array_equal(d.up[clear], (phase < 0.9)[clear])
        along = np.where(phase < 0.9, phase / 0.9, (phase - 0.9) / 0.1)
        # A bin of the period is a twentieth of the flyback.
        assert np.abs(Run(d, value).along - along)[clear].max() <= 0.06


def test_a_rate_with_waveform_other_does_not_repeat():
    drive = Drive(np.arange(100) / 100, np.linspace(0, 1, 100), 10.0, "other")
    assert drive.rate == 10.0 and not drive.repeats and drive.periods == 0
    assert (drive.period == -1).all() and drive.lead_in().size == 0
    still = Drive(np.arange(100) / 100, np.linspace(0, 1, 100))
    assert still.rate == 0.0 and not still.repeats


def test_numbers_of_a_drive():
    value = np.array([1.0, 3.0, 2.0, -1.0, 0.0])
    drive = Drive(np.arange(5) * 0.25, value, 1.0, "sine", start_s=7.0)
    assert (drive.size, drive.step_s, drive.u_pp) == (5, 0.25, 4.0)
    assert np.array_equal(drive.session_time, [7.0, 7.25, 7.5, 7.75, 8.0])
    with pytest.raises(ValueError, match="read-only"):
        drive.value[0] = 2.0


def test_the_callers_array_stays_the_callers():
    mine = np.arange(5.0)
    drive = Drive(mine, mine)
    mine[2] = 100.0
    assert drive.value[2] == 2.0 and mine.flags.writeable


@pytest.mark.parametrize("minimum", [0.1, 0.25, 0.6, 0.95])
@pytest.mark.parametrize("per_period", [80.0, 80.4])
def test_the_lead_in_runs_from_the_minimum_to_the_record(per_period, minimum):
    drive = periodic(200, per_period, minimum)
    lead = drive.lead_in()
    assert lead.size == round(per_period) - round(minimum * per_period)
    # Continues into the record: no step is larger than the triangle's own (1.5 of them at the seam
    # where the sampling does not divide the period).
    joined = np.concatenate([lead, drive.value[:2]])
    assert np.abs(np.diff(joined)).max() <= 1.5 * 8.0 / per_period
    assert lead[0] == drive.value[: round(per_period)].min()
    assert lead.max() <= drive.value.max()


def test_a_record_from_its_minimum_needs_no_lead_in():
    assert periodic(200, 80.0).lead_in().size == 0
