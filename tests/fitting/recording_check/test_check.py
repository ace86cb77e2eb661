"""What is said of simulated recordings whose content, faults and noise are known."""

import dataclasses
import io
import json

import numpy as np
import pytest
from bad_input import clipped, data, good, put
from rich.console import Console

from fitting import check_recording
from fitting.cli import app
from fitting.commands.run import run as rapi
from fitting.report.recording_check._terminal import render_recording_check
from rapi_jax import Drive, Recording, Run, predict, sine, triangle
from rapi_jax.examples import paper_device
from rapi_jax.io import read_recording, write_recording

QUESTIONS = ("model", "noise", "rate", "swing", "other runs", "effect")


def recorded(*drives, noise=0.05, seed=0) -> Recording:
    """The paper's device under `drives`, with white noise."""
    rng = np.random.default_rng(seed)
    clean = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    return Recording.of(drives, [y + noise * rng.standard_normal(y.size) for y in clean])


def answers(recording: Recording) -> list[str]:
    """The answers, in the order of `QUESTIONS`."""
    return [question.answer for question in check_recording(recording).questions]


def wide(*frequencies, amplitude=4.0, periods=4):
    """A triangle at each of `frequencies`, Hz."""
    return triangle(
        [float(hz) for hz in frequencies],
        amplitude=amplitude,
        bias=3.0,
        samples=400 * periods,
        periods=periods,
    )


def test_everything_may_be_asked_of_three_rates_and_two_swings():
    found = check_recording(recorded(*wide(10, 20, 40), *wide(20, amplitude=2.0)))
    assert found.sound and found.faults == ()
    assert [question.answer for question in found.questions] == ["yes"] * 6
    assert all(question.record == "" for question in found.questions)


def test_rates_that_differ_by_less_than_a_hundredth_are_one():
    """As of records of one period, whose rates are read off their lengths."""
    told = [q.because for q in check_recording(recorded(*wide(10, 10.02, 40))).questions]
    assert "2 scan rates, 10 to 40 Hz." in told


def test_a_digitised_reading_without_noise_is_said_with_its_resolution():
    """From sample to sample it rests: that is the converter's doing, and no noise of 0."""
    (drive,) = wide(10, periods=1)
    read = np.round(np.asarray(predict(paper_device(), drive)) / 2.0) * 2.0  # GHz
    said = check_recording(Recording((Run(drive, read),))).summary()
    assert "noise below the reading's resolution of 2 GHz" in " ".join(said.split())
    said = check_recording(recorded(drive, noise=0.05)).summary()
    assert "MHz rms" in " ".join(said.split())


@pytest.mark.parametrize(
    ("drives", "expected", "words"),
    [
        (wide(10), "yes yes no partly partly partly", "Record two scan rates"),
        (wide(10, 20), "yes yes yes partly partly partly", "Record a second swing"),
        (wide(10, periods=1), "partly partly no partly partly partly", "one period only"),
        (wide(10, 20, 40, periods=2), "yes yes yes partly yes partly", "from 2 periods only"),
    ],
)
def test_what_is_missing_is_said_with_what_to_record(drives, expected, words):
    recording = recorded(*drives)
    assert answers(recording) == expected.split()
    assert words in json.dumps(check_recording(recording).to_dict())


def test_swings_that_are_nearly_one_are_one_swing_for_effects_too():
    found = check_recording(recorded(*wide(10, 20, 40), *wide(20, amplitude=3.9)))
    *_, swings, _, effects = found.questions
    assert swings.answer == effects.answer == "partly"
    assert "nearly one" in swings.because and "without at least two swings" in effects.because


def test_what_one_period_does_not_show_is_said_and_a_fit_is_not_refused():
    found = check_recording(recorded(*wide(10, periods=1)))
    model, noise, *_, held_out, _ = found.questions
    assert found.sound and "the run has one period only" in model.because
    for words in ("whether the device had settled", "its response repeats", "the rate is right"):
        assert words in model.because
    assert model.record == noise.record == "Record three periods or more of each drive."
    assert "periods cannot be compared" in noise.because
    assert "belongs to the same period as the rest" in held_out.because


def test_the_one_run_of_one_period_is_named():
    found = check_recording(recorded(*wide(10, 20), *wide(40, periods=1)))
    assert "but run 'run02' has one period only" in found.questions[0].because
    assert "in 2 of 3 runs" in found.questions[1].because


def test_numbers_of_a_run_are_those_it_was_made_with():
    (drive,) = sine(25.0, amplitude=3.0, bias=2.0, samples=1500, periods=5)
    recording = recorded(drive, noise=0.08)
    (run,) = check_recording(recording).runs
    assert (run.excitation_hz, run.periods, run.samples, run.waveform) == (25.0, 5, 1500, "sine")
    np.testing.assert_allclose(run.sample_hz, 7500.0, rtol=1e-12)
    np.testing.assert_allclose((run.swing, run.bias), (3.0, 2.0), rtol=1e-12)
    np.testing.assert_allclose(run.samples_a_period, 300.0, rtol=1e-12)
    np.testing.assert_allclose(run.noise, 0.08, rtol=0.06)
    assert run.noise_from == "periods" and run.holds == 0


@pytest.mark.parametrize("begin", [1, 100, 250, 399])
def test_a_period_that_is_broken_is_no_noise(begin):
    """A record that begins anywhere: its broken periods have another mean, and the same noise."""
    (drive,) = wide(10, periods=6)
    (run,) = recorded(drive, noise=0.05).runs
    time, value = drive.time[:1600], drive.value[begin : begin + 1600]
    cut = Drive(time, value, drive.excitation_hz, drive.waveform)
    recording = Recording.of([cut], [run.response[begin : begin + 1600]])
    (found,) = check_recording(recording).runs
    np.testing.assert_allclose(found.noise, 0.05, rtol=0.1)


def test_noise_of_a_measured_drive_is_none_of_the_reading():
    recording = recorded(*wide(10), noise=0.05)
    run = recording.runs[0]
    shaken = run.drive.value + 0.02 * np.random.default_rng(1).standard_normal(run.drive.size)
    noisy = dataclasses.replace(run, drive=dataclasses.replace(run.drive, value=shaken))
    (found,) = check_recording(Recording((noisy,))).runs
    np.testing.assert_allclose(found.noise, 0.05, rtol=0.06)


def test_noise_of_one_period_is_what_changes_from_sample_to_sample():
    (run,) = check_recording(recorded(*wide(10, periods=1), noise=0.05)).runs
    assert run.noise_from == "samples"
    np.testing.assert_allclose(run.noise, 0.05, rtol=0.2)


def test_faults_are_those_of_the_data_checks(tmp_path):
    data(clipped(None, 0.8))(tmp_path / "r")
    found = check_recording(read_recording(tmp_path / "r"))
    assert [fault.kind for fault in found.faults] == ["clipped"]
    assert not found.sound and [q.answer for q in found.questions[::5]] == ["no", "partly"]
    assert "may only reflect the fault" in found.questions[5].because  # saturation looks the same


def test_a_response_that_is_a_triangle_under_a_drive_that_is_none_is_noted():
    """Both columns measured with noise, as by an oscilloscope, and exchanged."""
    rng = np.random.default_rng(5)
    right = recorded(*wide(10, 20, 40), noise=0.02)
    runs = []
    for run in right.runs:
        read = run.drive.value + 0.002 * rng.standard_normal(run.drive.size)
        swapped = dataclasses.replace(run.drive, value=run.response, waveform="multisine")
        runs.append(Run(swapped, read, run.name))
    told = [n for n in check_recording(Recording(tuple(runs))).notes if n.startswith("columns")]
    assert len(told) == 1 and "are swapped: exchange them" in told[0]
    assert not any(n.startswith("columns") for n in check_recording(right).notes)


def test_a_run_that_is_a_copy_of_another_is_a_fault():
    one, other = recorded(*wide(10, 40)).runs
    copy = dataclasses.replace(other, name="run02")
    (fault,) = check_recording(Recording((one, other, copy))).faults
    assert (fault.kind, fault.run) == ("copied run", "run02") and "'run01'" in fault.message


def test_a_single_sweep_and_swapped_columns():
    (drive,) = wide(10)
    half = dataclasses.replace(
        drive, time=drive.time[:200], value=drive.value[:200], excitation_hz=None, waveform="other"
    )
    question = check_recording(recorded(half)).questions[0]
    assert question.answer == "no" and "single sweep" in question.because
    made = recorded(drive)
    swapped = dataclasses.replace(drive, value=made.runs[0].response)
    other = Recording((Run(swapped, drive.value),))
    assert "columns swapped" in [fault.kind for fault in check_recording(other).faults]


def test_holds_and_an_uncycled_start_are_noted():
    time = np.arange(1200) / 1000.0
    value = 3.0 + 2.0 * np.sin(2 * np.pi * np.clip(time, 0.0, 0.8) / 0.4)
    value[800:] = value[800]
    notes = " ".join(check_recording(recorded(Drive(time, value))).notes)
    assert "holds: the drive rests (1 in run 'run00')" in notes
    assert "uncycled start: run 'run00' does not repeat" in notes
    assert check_recording(recorded(*wide(10, 20))).notes == ()


def test_an_unusable_run_and_a_wrong_argument():
    (drive,) = wide(10)
    slow = dataclasses.replace(drive, excitation_hz=1.0)
    found = check_recording(recorded(slow))
    assert found.faults[0].kind == "unusable run" and "excitation_hz" in found.faults[0].message
    with pytest.raises(TypeError, match="Argument `recording` must be a Recording"):
        check_recording("recording")  # pyright: ignore[reportArgumentType]


def test_tiny_charges_have_a_unit_that_reads_well():
    recording = recorded(*wide(10.0))
    runs = tuple(dataclasses.replace(r, response=1e-6 * r.response) for r in recording.runs)
    charges = dataclasses.replace(recording, runs=runs, response_unit="uC")
    text = io.StringIO()
    Console(file=text, width=120).print(render_recording_check(check_recording(charges), "charges"))
    head, _, units, *_ = text.getvalue().splitlines()
    assert "response in uC; noise " in head and head.endswith(" fC rms")
    assert units.split()[-3:-1] == ["pC", "fC"]


def test_command_in_words_and_as_json(tmp_path, capsys):
    write_recording(good(), tmp_path / "r")
    assert rapi(app, ["check", str(tmp_path / "r")]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for word in ("4 run(s)", "run03", "40", "nothing speaks against a fit", "one swing, 4.5 V"):
        assert word in text, word
    assert rapi(app, ["check", str(tmp_path / "r"), "--json"]) == 0
    table = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert table["schema"] == "rapi.check/1" and table["sound"] is True
    assert [one["excitation_hz"] for one in table["runs"]] == [10.0, 20.0, 30.0, 40.0]
    assert table["data_sha256"] == read_recording(tmp_path / "r").sha256()
    assert list((tmp_path).iterdir()) == [tmp_path / "r"]


def test_exit_codes_of_faulty_missing_and_several(tmp_path, capsys):
    data(clipped(None, 0.8))(tmp_path / "faulty")
    write_recording(good(), tmp_path / "good")
    assert rapi(app, ["check", str(tmp_path / "faulty")]) == 4
    assert "x clipped" in capsys.readouterr().out
    assert rapi(app, ["check", str(tmp_path / "none")]) == 3
    both = [str(tmp_path / name) for name in ("none", "faulty", "good")]
    assert rapi(app, ["check", *both, "--json"]) == 3
    said = capsys.readouterr()
    assert [one["sound"] for one in json.loads(said.out)] == [False, True]
    assert "no such file" in said.err


def test_missing_readings_are_refused_or_masked(tmp_path, capsys):
    data(put(1, 2, slice(50, 53), float("nan")))(tmp_path / "r")
    assert rapi(app, ["check", str(tmp_path / "r")]) == 3
    assert "--nan mask" in capsys.readouterr().err
    assert rapi(app, ["check", str(tmp_path / "r"), "--nan", "mask"]) == 0
    assert "3 of run 'run01'" in " ".join(capsys.readouterr().out.split())
