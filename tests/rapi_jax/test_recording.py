"""Drives, runs and recordings; periods, branches and regions; waveforms; rows; weights."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting.identification._weights import hysteresis_fraction, hysteresis_weights, run_weights
from rapi_jax import DataError, Drive, Recording, Run, predict
from rapi_jax._waveform import multisine, sine, step_and_hold, triangle
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.io import read_recording
from rapi_jax.sampling._batch import to_batch, usable
from rapi_jax.sampling._phase import fold, turning_samples

# Turning points are found in bins of a period, 200 of them where there are samples enough: phases
# are right to a bin, and branches to one bin at either turn.
BIN = 1.0 / 200


def triangle_at(cycles, minimum=0.0):
    """A triangle of 1 to 5 V with its minimum at phase `minimum`."""
    return 3.0 + 2.0 * (1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles - minimum, 1.0)))


def periodic(samples, per_period, minimum=0.0, hz=10.0, noise=0.0):
    cycles = np.arange(samples) / per_period
    value = triangle_at(cycles, minimum) + noise * np.random.default_rng(1).normal(size=samples)
    return Drive(cycles / hz, value, hz, "triangle")


# --- periods and branches of a drive that repeats


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


# --- the settling period


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


# --- drives that do not repeat


def brute_turns(value, dead):
    """Turning samples by their meaning: alternate extremes, each left by more than `dead`."""
    turns, at = [], 0
    way = 0
    for i in range(value.size):
        part = value[at : i + 1]
        fell, rose = part.max() - value[i] > dead, value[i] - part.min() > dead
        if way >= 0 and fell:
            turns += [at + int(part.argmax())] if way else []
            at, way = (at + int(part.argmax()) if way else i), -1
        elif way <= 0 and rose:
            turns += [at + int(part.argmin())] if way else []
            at, way = (at + int(part.argmin()) if way else i), 1
    return turns


@settings(max_examples=100)
@given(st.lists(st.integers(-20, 20), min_size=3, max_size=40))
def test_turning_samples_are_the_extremes_between_real_moves(numbers):
    value = np.array(numbers, dtype=float)
    turns = turning_samples(value, 0.2)
    expected = {0, value.size - 1, *brute_turns(value, 0.2 * np.ptp(value))}
    assert sorted(expected) == list(turns)


def test_turning_samples_of_a_wave_and_of_noise_on_it():
    wave = -np.cos(2 * np.pi * np.arange(1001) / 200)
    assert list(turning_samples(wave)) == list(range(0, 1001, 100))
    noisy = wave + 0.003 * np.random.default_rng(0).uniform(-1, 1, 1001)
    # Near an extreme a cosine is flat to the noise over 0.011 of its period.
    assert np.abs(turning_samples(noisy) - np.arange(0, 1001, 100)).max() <= 5
    assert list(turning_samples(np.ones(9))) == [0, 8]


def test_branches_of_a_decaying_drive():
    time = np.arange(3000) / 1000
    value = np.exp(-time) * -np.cos(2 * np.pi * 2 * time)
    drive = Drive(time, value)
    slope = np.gradient(value)
    clear = np.abs(slope) > 0.1 * np.abs(slope).max()
    assert np.array_equal(drive.up[clear], slope[clear] > 0)
    place = Run(drive, value).along
    assert place.min() == 0.0 and place.max() == 1.0
    for begin, end in ((0, 240), (250, 490)):  # it turns at 243.7 and 493.7
        assert (np.diff(place[begin:end]) > 0).all()


def test_phase_of_a_free_drive_follows_its_branches():
    time = np.arange(301) / 100
    drive = Drive(time, np.abs(time - 1.0))  # down for 1 s, up for 2 s
    assert np.allclose(drive.phase[50], 0.75) and np.allclose(drive.phase[200], 0.25)
    assert not drive.up[50] and drive.up[200]


@pytest.mark.parametrize(
    "name", ["picma_1hz", "picma_small_loops", "afm_z_open_loop", "afm_z_closed_loop", "servo_lag"]
)
def test_branches_of_measured_drives(shared_data, name):
    """Wherever a measured drive clearly moves, it is on the branch of that direction."""
    for run in read_recording(shared_data / name).runs:
        value = run.drive.value
        width = max(3, value.size // 400)
        kernel = np.ones(2 * width + 1) / (2 * width + 1)
        slope = np.gradient(np.convolve(np.pad(value, width, "edge"), kernel, "valid"))
        clear = np.abs(slope) > 0.2 * np.abs(slope).max()
        # A mean over 1/200 of the record smears each turn by about as much.
        assert np.mean((slope > 0) == run.drive.up, where=clear) > 0.98
        assert 0.75 < run.roi.mean() < 0.85


# --- regions of interest


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_the_region_of_interest_is_between_the_responses_turning_points(lag):
    drive = periodic(1600, 400.0)
    cycles = np.arange(1600) / 400 - lag
    run = Run(drive, 7.0 * triangle_at(cycles))
    along = np.mod(cycles, 0.5) / 0.5
    clear = (np.abs(along - 0.1) > 4 * BIN) & (np.abs(along - 0.9) > 4 * BIN)
    inside = (along > 0.1) & (along < 0.9)
    assert np.array_equal(run.roi[clear], inside[clear])
    assert run.roi.mean() == pytest.approx(0.8, abs=4 * BIN)
    assert run.span == pytest.approx(28.0)


def test_masked_readings_do_not_move_the_region():
    drive = periodic(1600, 400.0)
    response = 7.0 * drive.value
    masked = np.where(np.arange(1600) % 7 == 3, np.nan, response)
    assert np.array_equal(Run(drive, masked).roi, Run(drive, response).roi)
    assert Run(drive, masked).valid.sum() == np.isfinite(masked).sum() < 1600


def test_a_region_without_any_reading_is_refused():
    with pytest.raises(DataError, match="run 'empty'.*no reading"):
        _ = Run(periodic(800, 400.0), np.full(800, np.nan), "empty").roi


def test_folding_carries_over_bins_without_samples():
    phase = np.array([0.05, 0.15, 0.55])
    assert np.isfinite(fold(phase, np.array([1.0, 2.0, 3.0]), 10)).all()
    assert np.allclose(fold(phase, np.array([4.0, np.nan, 4.0]), 10), 4.0)


# --- refusals of a drive, run and recording

TIME = np.arange(20) * 0.01


def changed(index, value, base=TIME):
    return np.concatenate([base[:index], [value], base[index + 1 :]])


BAD_DRIVES = {
    "NaN drive": (dict(value=changed(7, np.nan)), r"`drive` has 1 value.*nan.*sample 7"),
    "infinite drive": (dict(value=changed(3, np.inf)), r"`drive`.*inf.*sample 3"),
    "NaN clock": (dict(time=changed(4, np.nan)), r"`time_s` has 1 value.*sample 4"),
    "doubled": (dict(time=changed(5, 0.04)), r"`time_s` repeats at sample 5"),
    "unsorted": (dict(time=changed(5, 0.035)), r"`time_s` goes back at sample 5"),
    "reversed": (dict(time=TIME[::-1]), r"`time_s` goes back at sample 1"),
    "jitter": (dict(time=changed(9, 0.094)), r"jitters: the step after sample 8"),
    "gap": (
        dict(time=np.delete(np.arange(23) * 0.01, [12, 13, 14])),
        r"about 3 sample.*after sample 11.*1 gap",
    ),
    "two rates": (
        dict(time=np.r_[TIME, 0.19 + np.arange(1, 31) * 0.02], value=np.ones(50)),
        r"several sampling rates: every 0.01 s from 0 s, then every 0.02 s from 0.19 s.*no jitter",
    ),
    "three rates, the first again": (
        dict(time=np.cumsum(np.r_[0.0, np.repeat([0.01, 0.013, 0.01], 40)]), value=np.ones(121)),
        r"several sampling rates: .*every 0.013 s from 0.4 s, then every 0.01 s from 0.92 s",
    ),
    "late start": (dict(time=TIME + 5.0), r"starts at 5 s"),
    "early start": (dict(time=TIME - 5.0), r"starts at -5 s"),
    "two columns": (dict(value=np.ones((20, 2))), r"`drive` must be one column.*\(20, 2\)"),
    "unequal": (dict(value=np.ones(19)), r"`time_s` has 20 samples, but `drive` has 19"),
    "short": (dict(time=TIME[:2], value=TIME[:2]), r"at least 3 samples"),
    "zero rate": (dict(excitation_hz=0.0), r"`excitation_hz`.*0"),
    "negative rate": (dict(excitation_hz=-5.0), r"`excitation_hz`.*-5"),
    "NaN rate": (dict(excitation_hz=float("nan")), r"`excitation_hz`.*nan"),
    "infinite rate": (dict(excitation_hz=float("inf")), r"`excitation_hz`.*inf"),
    "NaN start": (dict(start_s=float("nan")), r"`start_s`"),
}


@pytest.mark.parametrize("name", BAD_DRIVES)
def test_a_drive_that_cannot_be_used_is_refused_with_its_place(name):
    change, message = BAD_DRIVES[name]
    with pytest.raises(DataError, match=message):
        Drive(**{**dict(time=TIME, value=np.sin(TIME)), **change})


def test_small_jitter_and_rounded_times_are_accepted():
    jitter = 0.0008 * np.random.default_rng(0).uniform(-1, 1, 20) * (np.arange(20) > 0)
    assert Drive(TIME + jitter, np.sin(TIME)).size == 20
    rounded = np.round(np.arange(3000) / 30000, 6)  # 33.33 us with six digits
    assert Drive(rounded, rounded).size == 3000


def test_gaps_between_even_stretches_are_gaps():
    time = np.delete(np.arange(90) * 0.01, [30, 31, 60])
    with pytest.raises(DataError, match=r"about 2 sample.*after sample 29.*2 gap"):
        Drive(time, np.sin(time))


def test_a_run_must_match_its_drive():
    drive = periodic(50, 50.0)
    with pytest.raises(DataError, match=r"run 'r7'.*49 samples.*50"):
        Run(drive, np.ones(49), "r7")
    with pytest.raises(DataError, match="one column"):
        Run(drive, np.ones((50, 1)))


def test_a_recording_must_be_consistent():
    run = Run(periodic(50, 50.0), np.ones(50), "one")
    with pytest.raises(DataError, match="at least one run"):
        Recording(())
    with pytest.raises(DataError, match="same name.*one"):
        Recording((run, run))
    with pytest.raises(DataError, match="response_lag_s"):
        Recording((run,), response_lag_s=-1.0)
    with pytest.raises(ValueError, match="shorter"):
        Recording.of([run.drive, run.drive], [np.ones(50)])


def test_a_ragged_recording():
    drives = [periodic(n, n / 2, hz=hz) for n, hz in ((60, 20.0), (100, 10.0), (84, 10.0))]
    half = dataclasses.replace(drives[1], value=0.5 * drives[1].value)
    recording = Recording.of([*drives, half], [2.0 * d.value for d in [*drives, half]])
    assert [run.name for run in recording.runs] == ["run00", "run01", "run02", "run03"]
    assert recording.rates == [10.0, 20.0]
    assert recording.amplitudes == pytest.approx([2.0, 4.0], rel=0.02)
    assert [d.size for d in recording.drives] == [60, 100, 84, 100]


def test_the_hash_sees_every_number_and_its_meaning():
    recording = Recording.of([periodic(60, 30.0)], [np.arange(60.0)])
    again = Recording.of([periodic(60, 30.0)], [np.arange(60.0)])
    assert recording.sha256() == again.sha256()
    run = recording.runs[0]
    drive = run.drive
    runs = [
        dataclasses.replace(run, response=changed(5, 5.0 + 1e-12, run.response)),
        dataclasses.replace(run, name="other"),
        *(
            dataclasses.replace(run, drive=dataclasses.replace(drive, **change))
            for change in (
                dict(value=changed(5, 1.0, drive.value)),
                dict(time=1.01 * drive.time),
                dict(excitation_hz=10.5),
                dict(waveform="sine"),
                dict(start_s=1.0),
            )
        ),
    ]
    others = [dataclasses.replace(recording, runs=(r,)) for r in runs]
    fields = (
        dict(response_unit="um"),
        dict(drive_unit="um"),
        dict(response_origin="run"),
        dict(response_lag_s=1e-3),
    )
    others += [dataclasses.replace(recording, **change) for change in fields]
    assert len({r.sha256() for r in [recording, *others]}) == 1 + len(others)


# --- lag


@pytest.mark.parametrize("lag", [0.3, 1.0, 2.5, 20.0, 100.0, 130.0])
@pytest.mark.parametrize("minimum", [0.0, 0.23])
@pytest.mark.parametrize("periods", [1, 3])
def test_a_periodic_drive_is_delayed_round_its_period(lag, minimum, periods):
    """`lag` in samples, 100 a period; an interpolated triangle is exact but next to its turns."""
    drive = periodic(100 * periods, 100.0, minimum)
    if lag >= 50.0 * periods:
        with pytest.raises(DataError, match="`response_lag_s`"):
            drive.delayed(lag * drive.step_s)
        return
    delayed = drive.delayed(lag * drive.step_s)
    cycles = (np.arange(100 * periods) - lag) / 100.0
    turns = np.abs(np.mod(2 * (cycles - minimum) + 0.5, 1.0) - 0.5) < 0.021
    error = np.abs(delayed.value - triangle_at(cycles, minimum))
    assert error[~turns].max() <= 1e-12
    assert error.max() <= 0.5 * 8.0 / 100.0  # half of one sample's step
    assert (delayed.rate, delayed.waveform) == (drive.rate, drive.waveform)
    assert np.array_equal(delayed.time, drive.time)


def test_a_free_drive_is_delayed_from_where_it_rested():
    drive = Drive(TIME, TIME**2)
    delayed = drive.delayed(0.03)
    assert np.allclose(delayed.value, np.maximum(TIME - 0.03, 0.0) ** 2, atol=1e-15)
    assert drive.delayed(0.0) is drive
    for lag in (-0.01, 0.2):
        with pytest.raises(DataError, match="`response_lag_s`"):
            drive.delayed(lag)


def test_the_lag_is_not_taken_from_what_is_kept():
    drive = periodic(100, 100.0)
    recording = Recording.of([drive], [drive.value], response_lag_s=0.002)
    assert np.array_equal(recording.runs[0].drive.value, drive.value)


# --- waveforms


@pytest.mark.parametrize("samples, periods", [(4000, 1), (999, 3), (1000, 3)])
@pytest.mark.parametrize("make", [triangle, sine, multisine])
def test_waveforms_start_at_their_minimum_and_have_the_range_asked_for(make, samples, periods):
    drives = make((5.0, 20.0), amplitude=3.0, bias=-1.0, samples=samples, periods=periods)
    assert [d.rate for d in drives] == [5.0, 20.0]
    assert [d.start_s for d in drives] == [0.0, periods / 5.0]  # one after the other
    for drive in drives:
        assert drive.waveform == make.__name__ and drive.size == samples
        assert drive.step_s == pytest.approx(periods / drive.rate / samples)
        # The multisine's extremes are known from 8192 points of its period: to 1e-4 of its range.
        tolerance = 1e-12 if make is not multisine else 3e-4
        assert drive.value[0] == pytest.approx(-2.5, abs=tolerance)
        assert drive.value.min() >= -2.5 - tolerance
        assert drive.value.max() <= 0.5 + tolerance
        # A sample lies within half a step of the top: a triangle is steepest of the three there,
        # 2 amplitude / per_period a step, or a multisine by its curvature, less than that.
        assert drive.value.max() >= 0.5 - 3.0 * periods / samples
        assert drive.periods == periods


def test_waveforms_hold_the_frequencies_they_say():
    spectrum = [
        np.abs(np.fft.rfft(make(10.0, amplitude=2.0, bias=0.0, samples=800)[0].value)) / 400
        for make in (sine, triangle, multisine)
    ]
    assert spectrum[0][1] == pytest.approx(1.0) and np.delete(spectrum[0], 1).max() < 1e-12
    # The series of a triangle, with aliases of some 1 / 800^2.
    assert np.allclose(spectrum[1][1:8:2], 8 / np.pi**2 / np.arange(1, 8, 2) ** 2, atol=1e-5)
    lines = spectrum[2]
    assert np.allclose(lines[[1, 2, 3, 5]], lines[1]) and lines[1] > 0.1
    assert np.delete(lines, [0, 1, 2, 3, 5]).max() < 1e-12


def test_the_papers_drives():
    drives = paper_drives()
    assert [d.rate for d in drives] == [10.0, 20.0, 30.0, 40.0]
    assert all(d.u_pp == 4.5 and d.value.min() == 0.75 and d.waveform == "triangle" for d in drives)


def test_step_and_hold_holds_and_ramps():
    (drive,) = step_and_hold((1.0, 4.0, 2.0), hold_s=0.5, rise_s=0.1, step_s=0.01)
    assert drive.waveform == "step" and drive.rate == 0.0 and drive.step_s == pytest.approx(0.01)
    levels = {0.0: 1.0, 0.49: 1.0, 0.55: 2.5, 0.6: 4.0, 1.09: 4.0, 1.15: 3.0, 1.2: 2.0, 1.69: 2.0}
    for t, level in levels.items():
        assert drive.value[round(t / 0.01)] == pytest.approx(level, abs=1e-9)
    assert drive.time[-1] < 1.7 <= drive.time[-1] + 0.0101


@pytest.mark.parametrize("make", [triangle, sine, multisine])
@pytest.mark.parametrize(
    "change, name",
    [
        (dict(samples=7), "samples"),
        (dict(samples=100, periods=13), "samples"),
        (dict(periods=0), "periods"),
        (dict(frequencies=0.0), "frequencies"),
        (dict(frequencies=(10.0, -1.0)), "frequencies"),
    ],
)
def test_waveforms_refuse(make, change, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        make(**{**dict(frequencies=10.0, amplitude=1.0, bias=0.0), **change})


@pytest.mark.parametrize(
    "change", [dict(levels=(1.0,)), dict(hold_s=0.0), dict(rise_s=-1.0), dict(step_s=0.0)]
)
def test_step_and_hold_refuses(change):
    with pytest.raises(ValueError, match="`step_and_hold`"):
        step_and_hold(**{**dict(levels=(0.0, 1.0), hold_s=1.0, rise_s=1.0, step_s=0.1), **change})


# --- rows for a fit


@pytest.mark.parametrize("lead", [False, True])
def test_rows_hold_the_lead_in_the_run_and_padding(lead):
    short = periodic(130, 50.0, minimum=0.2, hz=20.0)  # broken periods at both ends
    long = periodic(600, 200.0, hz=5.0)
    free = dataclasses.replace(periodic(90, 40.0), waveform="other")
    responses = [3.0 * d.value for d in (short, long, free)]
    responses[1][[7, 100]] = np.nan
    recording = Recording.of((short, long, free), responses)
    rows = to_batch(recording, lead=lead)
    assert rows.u.shape[0] == 3 and rows.u.shape[1] % 256 == 0
    assert lead or rows.u.shape == (3, 768)
    for k, run in enumerate(recording.runs):
        inside = np.flatnonzero(rows.sample[k] >= 0)
        before = int((rows.time[k] < run.drive.start_s - 1e-9).sum())
        assert before >= (50, 200, 0)[k] * lead and (lead or before == 0)
        if not lead:  # corners on samples; with effects more nodes stand behind them
            assert np.array_equal(inside, np.arange(run.drive.size))
        assert np.array_equal(rows.sample[k, inside], np.arange(run.drive.size))
        # One period stands for all: later ones differ from it by rounding.
        np.testing.assert_allclose(rows.u[k, inside], run.drive.value, rtol=0, atol=1e-12)
        around = np.append(run.drive.time, run.drive.time[-1] + run.drive.step_s)
        again = np.interp(
            rows.time[k, :before],
            around - 1 / (run.drive.rate or 1),
            [*run.drive.value, run.drive.value[0]],
        )
        np.testing.assert_allclose(rows.u[k, :before], again, atol=1e-12)
        assert (rows.u[k, inside[-1] :] == rows.u[k, inside[-1]]).all()
        good = np.isfinite(run.response)
        assert np.array_equal(rows.y[k, inside][good], run.response[good])
        assert np.isfinite(rows.y[k]).all()
        assert not rows.use[k][rows.sample[k] < 0].any()
        assert not rows.use[k, inside][~good].any()
        assert np.allclose(rows.time[k, inside], run.drive.session_time)
        steps = np.diff(rows.time[k, : inside[-1] + 1])
        assert (steps > 0).all() and (lead or np.allclose(steps, run.drive.step_s))
        assert (rows.time[k, inside[-1] :] == rows.time[k, inside[-1]]).all()
        assert rows.freq[k] == run.drive.rate and rows.u_pp[k] == run.drive.u_pp
        assert rows.u_min[k] == run.drive.value.min()
    assert rows.use[0].sum() == pytest.approx(100, abs=1) and rows.use[1].sum() == 598
    assert rows.use[2].sum() == 90
    batch = rows.device()
    spread = np.take_along_axis(np.asarray(batch.node_u), np.asarray(batch.place), axis=1)
    assert np.array_equal(spread, rows.u) and np.array_equal(batch.freq, rows.freq)
    assert np.array_equal(batch.time, rows.time)
    assert np.array_equal(batch.history.period_s > 0, [lead, lead, False])


def test_rows_with_lag():
    drive = periodic(300, 100.0)
    lag = 3 * drive.step_s
    recording = Recording.of([drive], [drive.value], response_lag_s=lag)
    rows = to_batch(recording)
    inside = np.flatnonzero(rows.sample[0] >= 0)
    assert np.allclose(rows.u[0, inside], np.roll(drive.value, 3), atol=1e-12)
    assert not rows.use[0, inside[:2]].any() and rows.use[0, inside[4:]].all()
    assert rows.u_pp[0] == drive.u_pp and rows.u_min[0] == drive.value.min()


# --- hysteresis weights (Eq. 26)


def loop(drive, half):
    """A loop that is open by `2 half` everywhere: 10 V^-1 times the drive, shifted by branch."""
    rising = np.gradient(drive.value) > 0
    return 10.0 * drive.value + np.where(rising, -half, half)


@pytest.mark.parametrize("half", [0.4, 2.0])
@pytest.mark.parametrize("repeats", [True, False])
def test_the_opening_of_a_known_loop(half, repeats):
    drive = periodic(2400, 800.0)
    drive = drive if repeats else dataclasses.replace(drive, waveform="other")
    run = Run(drive, loop(drive, half))
    # Openings are differences of means over 1/100 of the range, 0.4 GHz: within a sample's step of
    # the drive (0.1 GHz) they see `2 half`.
    assert hysteresis_fraction(run) == pytest.approx(2 * half / run.span, abs=0.1 / run.span)


def test_noise_and_a_known_lag_hardly_open_a_loop():
    drive = periodic(4000, 800.0)
    noise = 0.02 * np.random.default_rng(0).normal(size=4000)
    assert hysteresis_fraction(Run(drive, 10.0 * drive.value + noise)) < 0.005
    late = Run(drive, 10.0 * np.roll(drive.value, 8))
    assert hysteresis_fraction(late) > 0.03
    assert hysteresis_fraction(late, 8 * drive.step_s) < 0.005


def test_weights_are_proportional_to_the_opening_with_mean_one():
    drives = [periodic(1600, 800.0, hz=hz) for hz in (10.0, 20.0, 40.0)]
    recording = Recording.of(
        drives, [loop(d, h) for d, h in zip(drives, (1.0, 2.0, 3.0), strict=True)]
    )
    weights = hysteresis_weights(recording)
    # Spans grow with the opening: 40 + 2 half, but for the two samples at the turns.
    openings = [2 * h / run.span for h, run in zip((1.0, 2.0, 3.0), recording.runs, strict=True)]
    np.testing.assert_allclose(weights, openings / np.mean(openings), rtol=0.04)
    assert weights.mean() == pytest.approx(1.0, rel=1e-12)
    assert np.array_equal(run_weights(recording, "hysteresis"), weights)
    assert np.array_equal(run_weights(recording, "uniform"), np.ones(3))
    np.testing.assert_allclose(run_weights(recording, (1.0, 2.0, 3.0)), [0.5, 1.0, 1.5])


def test_no_run_is_left_out_by_its_weight():
    drives = [periodic(1600, 800.0, hz=hz) for hz in (10.0, 20.0, 40.0)]
    flat = Drive(drives[2].time, np.full(1600, 3.0), 40.0, "other")
    recording = Recording.of(
        [*drives[:2], flat], [loop(drives[0], 3.0), 10.0 * drives[1].value, np.ones(1600)]
    )
    assert np.isnan(hysteresis_fraction(recording.runs[2]))
    weights = hysteresis_weights(recording)
    assert (
        weights.mean() == pytest.approx(1.0, rel=1e-12) and (weights >= 0.05 * weights.max()).all()
    )
    assert weights[0] > weights[2] > weights[1]
    still = Recording.of([flat], [np.ones(1600)])
    assert np.array_equal(hysteresis_weights(still), [1.0])


@pytest.mark.parametrize("weights", ["best", (1.0,), (1.0, -1.0), (1.0, np.nan), (1.0, 0.0)])
def test_weights_are_refused(weights):
    drives = [periodic(100, 50.0), periodic(100, 50.0)]
    recording = Recording.of(drives, [d.value for d in drives])
    with pytest.raises(ValueError, match="`weights`"):
        run_weights(recording, weights)


def test_usable_samples():
    drive = periodic(130, 50.0, minimum=0.2)
    response = drive.value.copy()
    response[40] = np.nan
    use = usable(Run(drive, response), 0.0)
    assert not use[40] and not use[:8].any() and use[12:40].all() and not use[113:].any()
    assert usable(Run(drive, response), 0.05).sum() < use.sum()


def test_the_papers_loops_open_more_the_faster_they_are():
    drives = paper_drives(samples=2000)
    recording = Recording.of(drives, [predict(paper_device(), d) for d in drives])
    weights = hysteresis_weights(recording)
    assert (np.diff(weights) > 0).all() and 0.8 < weights[0] < weights[-1] < 1.2
