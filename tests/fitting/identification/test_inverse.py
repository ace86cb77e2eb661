"""The paper's inverse, identified from noisy scans and sent to the device it was made for."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from fitting import UntrustedFit, fit, identify_inverse, swap
from fitting.identification.inverse._identify_inverse import fit_inverse, swapped_model
from fitting.identification.inverse._swap import smoothed
from rapi_jax import ECDL, RAPI, DataError, Drive, Recording, Run, predict
from rapi_jax._waveform import triangle
from rapi_jax.examples import FREQUENCIES, paper_device, paper_recording
from rapi_jax.inversion._identified import Identified

UP = 0.0758  # GHz: the paper's worst compensated up cell
DOWN = (0.271, 0.243, 0.179, 0.154)  # at 10, 20, 30, 40 Hz
QUICK: dict[str, Any] = dict(hold_out=False, throw=False)


def rms_about_a_line(t, y):
    """Of the middle 80 % of a branch's time, GHz."""
    middle = slice(round(0.1 * t.size), round(0.9 * t.size) + 1)
    t, y = t[middle] - t[0], y[middle]
    return np.std(y - np.polyval(np.polyfit(t, y, 1), t))


def scanned(inverse, rate, low, high, samples=4000):
    """The device's rms nonlinearity, up and down, for the drive to a straight scan of a span."""
    target = triangle(rate, amplitude=high - low, bias=(high + low) / 2, samples=samples)[0]
    drive = dataclasses.replace(target, value=np.asarray(predict(inverse, target)))
    y = np.asarray(predict(paper_device(), drive))
    half = samples // 2
    return [rms_about_a_line(drive.time[b], y[b]) for b in (slice(None, half), slice(half, None))]


def identified(seed, noise=0.020):
    recording, truth = paper_recording(seed=seed, noise=noise)
    forward = fit(ECDL(RAPI.guess(recording)), recording, **QUICK)
    return recording, truth, forward


@pytest.fixture(scope="module")
def first():
    recording, truth, forward = identified(seed=0)
    return recording, truth, forward, identify_inverse(recording, forward)


def check_scans(inverse, truth):
    for rate, y, down_limit in zip(FREQUENCIES, truth, DOWN, strict=True):
        up, down = scanned(inverse, rate, y.min(), y.max())
        assert up < UP and down < down_limit, (rate, up, down)


def test_it_is_trusted_and_names_the_papers_parameters(first):
    result = first[3]
    assert result.verdict.trusted, result.verdict.reasons
    names = [p.name for p in result.parameters]
    lam = [f"lam_{i}" for i in range(1, 11)]
    g = [f"g_{i}" for i in range(1, 5)]
    thresholds = ["s_1", "s_2", "s_3", "kappa", "sigma", "epsilon"]
    assert names == [*thresholds, *lam, "eta", *g, "g_0", "v_0"]
    assert [p.name for p in result.parameters if p.held] == ["v_0"]
    units = {p.name: p.unit for p in result.parameters}
    assert (units["s_1"], units["kappa"], units["sigma"]) == ("GHz", "GHz/Hz", "V/GHz")
    assert (units["g_2"], units["g_0"]) == ("V/GHz^2", "V")
    table = result.to_dict()
    assert (table["order"], table["unit"], table["drive_unit"]) == (4, "V", "GHz")
    assert "InverseRAPI" in result.summary()


def test_the_drive_is_given_back_to_a_few_mv(first):
    """Fig. 7: rmse at each rate, of a 4.5 V span."""
    assert max(run.rmse for run in first[3].runs) < 8e-3


def test_rates_left_out_are_predicted(first):
    """And only they are: the last third of one period is most of its falling branch."""
    result = first[3]
    assert {h.scheme for h in result.held_out} == {f"rate {f:g} Hz" for f in FREQUENCIES}
    assert max(h.rmse for h in result.held_out) < 0.012  # V, of 4.5


def test_all_thresholds_are_positive_at_all_rates(first):
    operator = first[3].ecdl.operator
    for rate in FREQUENCIES:
        assert np.asarray(operator.thresholds(jnp.asarray(rate))).min() >= 0


def test_compensated_scans_beat_the_papers(first):
    check_scans(first[3].ecdl, first[1])


@pytest.mark.parametrize("seed, noise", [(1, 0.020), (2, 0.002)])
def test_so_they_do_for_other_noise(seed, noise):
    recording, truth, forward = identified(seed, noise)
    check_scans(identify_inverse(recording, forward, **QUICK).ecdl, truth)


def test_one_lam_for_all_plays_is_not_enough(first):
    """What the paper's `lam_i` is for; and the check above can fail."""
    recording, truth, forward, _ = first
    shared = identify_inverse(recording, forward, each=(), starts=1, max_steps=80, **QUICK)
    with pytest.raises(AssertionError):
        check_scans(shared.ecdl, truth)


def test_an_inverse_from_the_model_alone(first):
    recording, truth, forward, _ = first
    swapped = swapped_model(forward.ecdl, Identified.of(recording), "GHz", "V")
    assert (swapped.drive_unit, swapped.response_unit) == ("GHz", "V")
    result = fit_inverse(swapped, forward.ecdl.operator, **QUICK)
    check_scans(result.ecdl, truth)


def test_it_says_where_it_is_not_to_be_trusted(first):
    recording, _, forward, _ = first
    with pytest.raises(UntrustedFit, match="one start"):
        identify_inverse(recording, forward, each=(), starts=1, max_steps=40, hold_out=False)


# --- the swapped recording


@pytest.mark.slow
def test_noise_on_the_input_is_taken_down_and_turns_kept(first):
    recording, truth, forward, _ = first
    swapped = swap(recording, forward)
    assert (swapped.drive_unit, swapped.response_unit) == ("GHz", "V")
    for run, y, sent in zip(swapped.runs, truth, recording.drives, strict=True):
        stride = y.size // run.drive.size
        error = run.drive.value - y[::stride]
        assert stride == 8 and np.std(error) < 0.15 * 0.020
        assert np.array_equal(run.response, sent.value[::stride])
        assert np.argmax(run.drive.value) == np.argmax(sent.value[::stride])
        assert abs(run.drive.value.max() - y.max()) < 0.010


def test_what_the_forward_model_lacks_stays_in(first):
    """A slow misfit of 0.3 GHz, which no forward model has, is in the swapped input."""
    recording, _, forward, _ = first
    runs, extra = [], []
    for run in recording.runs:
        extra.append(0.3 * np.sin(6 * np.pi * run.drive.time * run.drive.rate))
        runs.append(Run(run.drive, run.response + extra[-1], run.name))
    moved = swap(dataclasses.replace(recording, runs=tuple(runs)), forward)
    plain = swap(recording, forward)
    for one, other, wanted in zip(moved.runs, plain.runs, extra, strict=True):
        stride = wanted.size // one.drive.size
        gap = one.drive.value - other.drive.value - wanted[::stride]
        assert np.abs(gap).max() < 0.05 and np.std(gap) < 0.01


def test_run_origins_and_latency_are_taken_out():
    """Runs with an origin of their own and a late reading come back on one origin, in step."""
    device, lag = paper_device(), 2e-4
    drives = triangle((10.0, 40.0), amplitude=4.5, bias=3.0, samples=4000, periods=2)
    truth = [np.asarray(predict(device, drive)) for drive in drives]
    late = [np.asarray(predict(device, drive.delayed(lag))) for drive in drives]
    rng = np.random.default_rng(0)
    read = [y + c + 0.005 * rng.normal(size=y.size) for y, c in zip(late, (50, -80), strict=True)]
    recording = Recording.of(drives, read, response_origin="run", response_lag_s=lag)
    forward = fit(ECDL(RAPI.guess(recording)), recording, starts=2, **QUICK)
    swapped = swap(recording, forward)
    assert swapped.response_lag_s == 0 and swapped.response_origin == "session"
    shift = []
    for run, y, drive in zip(swapped.runs, truth, drives, strict=True):
        assert run.drive.periods == 1
        place = np.argsort(drive.value[: 2000 // 2])
        rising = np.diff(run.response, append=run.response[-1]) > 0
        expected = np.interp(run.response[rising], drive.value[place], y[place])
        gap = run.drive.value[rising] - expected
        shift.append(np.mean(gap[5:-5]))
        assert np.std(gap[5:-5]) < 0.02
    assert abs(shift[0] - shift[1]) < 0.1  # of offsets that are 130 GHz apart


def test_masked_readings_stay_masked(first):
    recording, _, forward, _ = first
    run = recording.runs[0]
    hole = run.response.copy()
    hole[304:384] = np.nan
    recording = dataclasses.replace(recording, runs=(Run(run.drive, hole), *recording.runs[1:]))
    swapped = swap(recording, forward).runs[0]
    assert np.isfinite(swapped.drive.value).all()
    assert np.isnan(swapped.response).sum() == 10
    assert swapped.drive.size == 500


def test_a_fit_of_another_recording_is_refused(first):
    other, _ = paper_recording(samples=2000)
    with pytest.raises(DataError, match="another recording"):
        swap(other, first[2])


def test_smoothing_leaves_lines_alone_and_gaps_out():
    line = np.arange(50.0)
    out = smoothed(line, 5)
    np.testing.assert_allclose(out[5:-5], line[5:-5])
    line[20] = np.nan
    np.testing.assert_allclose(smoothed(np.where(np.isnan(line), np.nan, 3.0), 5), 3.0)
    assert smoothed(np.full(9, np.nan), 3).tolist() == [0.0] * 9


def test_free_drives_are_swapped_whole():
    """A drive that does not repeat keeps its length and order."""
    rng = np.random.default_rng(1)
    turns = 3.0 + 2.0 * rng.uniform(-1, 1, 12)
    value = np.interp(np.arange(1200) / 100.0, np.arange(12), turns)
    drive = Drive(np.arange(1200) * 1e-3, value, 10.0, "other")
    y = np.asarray(predict(paper_device(), drive)) + 0.01 * rng.normal(size=1200)
    recording = Recording.of([drive], [y])
    forward = fit(paper_device(), recording, starts=1, guess=False, max_steps=40, **QUICK)
    run = swap(recording, forward).runs[0]
    assert np.array_equal(run.response, value)
    assert (run.drive.waveform, run.drive.rate) == ("other", 10.0)
    assert np.std(run.drive.value - y) < 0.02
