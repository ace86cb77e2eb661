"""Rows for a fit, and weights of runs (Eq. 26)."""

import dataclasses

import numpy as np
import pytest
from periodic_drives import periodic

from fitting.identification._weights import hysteresis_fraction, hysteresis_weights, run_weights
from rapi_jax import Drive, Recording, Run, predict
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.sampling._batch import to_batch, usable


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
