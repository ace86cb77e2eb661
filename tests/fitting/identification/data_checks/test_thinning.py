"""Long recordings are thinned for a fit, which says so; others are left as they are."""

import dataclasses

import numpy as np
import pytest

from fitting import fit
from fitting.identification.data_checks import _thinning
from fitting.identification.data_checks._thinning import thin, turns_densely
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Drive, Recording, Run, predict, triangle
from rapi_jax.examples import paper_device


def of(*drives: Drive) -> Recording:
    return Recording(tuple(Run(d, 2.0 * d.value, f"run{i}") for i, d in enumerate(drives)))


def triangles(samples: int, periods: int = 3, rates=(10.0, 20.0)) -> Recording:
    return of(*triangle(rates, amplitude=4.0, bias=3.0, samples=samples, periods=periods))


def test_what_is_short_enough_is_left_alone():
    recording = triangles(3000)
    same, note = thin(recording)
    assert same is recording and note is None


def test_a_long_recording_keeps_whole_periods_and_true_samples():
    recording = triangles(900_000)  # two runs of three periods of 300 000
    thinned, note = thin(recording)
    total = sum(run.drive.size for run in thinned.runs)
    assert total <= THRESHOLDS.fitted_samples and total > THRESHOLDS.fitted_samples / 2
    assert f"of 1800000 samples the fit used {total}, one in" in str(note)
    for run, whole in zip(thinned.runs, recording.runs, strict=True):
        every = round(run.drive.step_s / whole.drive.step_s)
        assert 300_000 % every == 0 and run.drive.whole_period == 300_000 // every
        assert np.array_equal(run.response, whole.response[::every])
        assert np.array_equal(run.drive.time, whole.drive.time[::every])


def test_many_short_periods_are_cut_and_not_thinned_below_500_a_period():
    recording = triangles(600_000, periods=1000)  # 600 samples a period
    thinned, note = thin(recording)
    assert sum(run.drive.size for run in thinned.runs) <= 1.01 * THRESHOLDS.fitted_samples
    assert "of the first periods of each run" in str(note)
    for run, whole in zip(thinned.runs, recording.runs, strict=True):
        assert run.drive.whole_period == 600 and 2 <= run.drive.periods < 1000
        assert np.array_equal(run.response, whole.response[: run.drive.size])


def test_a_drive_that_does_not_repeat_is_thinned_alike():
    time = np.arange(1_000_000) / 1e5
    thinned, note = thin(of(Drive(time, np.sin(time))))
    assert thinned.runs[0].drive.size <= THRESHOLDS.fitted_samples
    assert "one in 3." in str(note)


def test_the_fit_of_a_thinned_recording_says_so_and_names_the_data_it_was_given(monkeypatch):
    small = dataclasses.replace(THRESHOLDS, fitted_samples=2500)
    monkeypatch.setattr(_thinning, "THRESHOLDS", small)
    device = paper_device()
    drives = triangle((10.0, 40.0), amplitude=4.0, bias=3.0, samples=6000, periods=3)
    rng = np.random.default_rng(0)
    answers = [np.asarray(predict(device, d)) + 0.02 * rng.standard_normal(d.size) for d in drives]
    recording = Recording.of(drives, answers)
    result = fit(device, recording, starts=1, hold_out=False, throw=False)
    assert result.verdict.notes[0].startswith("long recording: of 12000 samples the fit used ")
    assert result.to_dict()["data_sha256"] == recording.sha256()
    assert sum(run.drive.size for run in result.recording.runs) < 6000
    assert [p.size for p in result.predicted] == [run.drive.size for run in result.recording.runs]
    assert result.rmse == pytest.approx(0.02, rel=0.1)


def test_a_drive_with_noise_is_thinned_more_and_said_to_turn_densely():
    still = triangles(30_000)
    rng = np.random.default_rng(0)
    noisy = of(
        *(
            dataclasses.replace(
                run.drive, value=run.drive.value + 2e-3 * rng.standard_normal(run.drive.size)
            )
            for run in still.runs
        )
    )
    assert not turns_densely(still) and turns_densely(noisy)
    assert thin(still)[1] is None
    thinned, note = thin(noisy)
    assert sum(run.drive.size for run in thinned.runs) <= THRESHOLDS.dense_fitted_samples
    assert str(note).startswith("drive that turns every few samples: of 60000 samples")


def test_few_samples_of_a_noisy_drive_are_all_searched():
    rng = np.random.default_rng(0)
    time = np.arange(4000) / 1e4
    noisy = of(Drive(time, np.sin(60.0 * time) + 1e-2 * rng.standard_normal(4000)))
    assert not turns_densely(noisy) and thin(noisy)[1] is None
