"""Drives as a scope reads them: foreseen before a fit, and harmless once they are cleaned."""

import dataclasses

import numpy as np
import pytest
from scope_files import scanned

from fitting import check_recording, fit
from rapi_jax import ECDL, RAPI, Recording, Run, multisine, predict, sine, triangle
from rapi_jax.examples import paper_device
from rapi_jax.io import ImportOptions, import_recording

SHAPES = {"triangle": triangle, "sine": sine, "multisine": multisine}
TRUTH = {
    "alpha": 0.28110, "zeta": 6.7126e-3, "lam": 1.6, "eta": 1.0, "a": 0.63170, "b": 0.1,
    "d_1": 18.787, "d_2": -1.0789, "d_3": 0.010040, "d_0": 0.0,
}  # fmt: skip
PARTS = (10.0, 3, 4.5), (20.0, 3, 4.5), (40.0, 3, 4.5)
VOLTS = ImportOptions(drive_unit="V", response_unit="GHz")


def digitised(volts, bits: int, noise: float, rng, full: float):
    """As a converter of `bits` over `full` V reads it, with noise in V."""
    step = full / 2**bits
    return np.round((volts + noise * rng.standard_normal(volts.size)) / step) * step


def recorded(
    waveform: str,
    drive_noise: float,
    noise: float,
    bits: int = 0,
    *,
    rates=(10.0, 20.0),
    samples=1200,
    periods=3,
    seed=1,
) -> Recording:
    """Runs with noise of the drive's reading, V, and of the response, GHz."""
    rng = np.random.default_rng(seed)
    runs, shape = [], {"samples": samples, "periods": periods}
    for drive in SHAPES[waveform](list(rates), amplitude=4.5, bias=3.0, **shape):
        response = np.asarray(predict(paper_device(), drive)) + noise * rng.standard_normal(samples)
        value = drive.value + drive_noise * rng.standard_normal(samples)
        value = digitised(value, bits, 0.0, rng, 10.0) if bits else value
        runs.append(Run(dataclasses.replace(drive, value=value), response, f"run{len(runs):02d}"))
    return Recording(tuple(runs))


def blamed(faults) -> list[str]:
    return [fault.run for fault in faults if fault.kind == "noisy drive"]


@pytest.mark.parametrize(
    ("waveform", "drive_noise", "noise", "bits", "refused"),
    [
        ("triangle", 2e-3, 0.02, 8, True),
        ("triangle", 2e-3, 0.02, 12, True),
        ("triangle", 5e-4, 0.02, 0, False),
        ("triangle", 3e-3, 0.05, 0, False),
        ("triangle", 1e-2, 0.2, 0, False),
        ("triangle", 5e-3, 0.05, 0, True),
        ("sine", 2e-3, 0.02, 10, True),
        ("sine", 1e-2, 0.3, 0, False),
        ("multisine", 2e-3, 0.02, 10, True),
        ("multisine", 0.0, 0.02, 0, False),
    ],
)
def test_a_check_foresees_what_a_fit_refuses(waveform, drive_noise, noise, bits, refused):
    recording = recorded(waveform, drive_noise, noise, bits)
    foreseen = check_recording(recording)
    model = ECDL(RAPI.guess(recording))
    result = fit(model, recording, starts=1, hold_out=False, throw=False)
    assert blamed(foreseen.faults) == blamed(result.faults) == ["run00", "run01"] * refused
    assert foreseen.sound is not refused
    if refused:
        way = "averaged" if waveform == "multisine" else "fitted"
        for fault in (foreseen.faults[0], result.faults[0]):
            assert f"Import it again with `--drive-as {way}`" in fault.message


def imported(folder, time, drive, response, **options) -> Recording:
    np.savez(folder / "a.npz", time=time, drive=drive, response=response)
    return import_recording(folder / "a.npz", dataclasses.replace(VOLTS, **options)).recording


def estimates(recording: Recording) -> dict[str, tuple[float, float]]:
    """Value and standard error of each parameter, of a fit that is trusted."""
    result = fit(ECDL(RAPI.guess(recording)), recording, starts=2, hold_out=False, throw=False)
    assert result.verdict.trusted, result.verdict.reasons
    return {one.name: (one.value, one.stderr) for one in result.parameters if one.name in TRUTH}


@pytest.mark.parametrize(
    ("bits", "way"), [(8, "averaged"), (8, "fitted"), (10, "fitted"), (12, "averaged")]
)
def test_parameters_with_a_cleaned_drive_are_those_with_the_exact_one(tmp_path, bits, way):
    """Both channels read by one scope: 2 mV of noise on the drive, 4 mV on the response."""
    rng = np.random.default_rng(1)
    time, sent, clean = scanned(*PARTS, sample_hz=8e3, noise=0.0)
    drive = digitised(sent, bits, 2e-3, rng, 10.0)
    response = 4.5 * digitised(clean / 4.5, bits, 4e-3, rng, 20.0)
    noisy = imported(tmp_path, time, drive, response)
    cleaned = imported(tmp_path, time, drive, response, drive_as=way)
    assert check_recording(cleaned).sound
    assert not check_recording(noisy).sound
    exact = estimates(imported(tmp_path, time, sent, response))
    for name, (value, error) in estimates(cleaned).items():
        assert abs(value - TRUTH[name]) < 4.0 * error, name
        assert abs(value - exact[name][0]) < 4.0 * exact[name][1], name
        assert error < 1.2 * exact[name][1], name


def drive_notes(recording) -> list[str]:
    return [note for note in check_recording(recording).notes if note.startswith("drive noise")]


@pytest.mark.parametrize(
    ("drive_noise", "noise", "bits", "size", "made"),
    [
        (2e-3, 0.05, 0, 2e-3, 0.034),
        (5e-3, 0.1, 0, 5e-3, 0.085),
        (0.0, 0.02, 12, 10 / 2**12 / np.sqrt(12), 0.012),
    ],
)
def test_noise_of_a_drive_below_what_is_refused_is_told_before_a_fit(
    drive_noise, noise, bits, size, made
):
    """With its size, what a model makes of it, and the command that is rid of it."""
    checked = check_recording(recorded("triangle", drive_noise, noise, bits))
    assert checked.faults == ()
    (note,) = (text for text in checked.notes if text.startswith("drive noise"))
    assert float(note.split("carries noise of ")[1].split()[0]) == pytest.approx(size, rel=0.25)
    told = float(note.split("A model turns it into ")[1].split()[0])  # MHz
    assert told == pytest.approx(1e3 * made, rel=0.25)
    assert "`--drive-as fitted`" in note and "2 runs, most in " in note


def test_noise_of_a_drive_that_is_small_or_followed_is_not_told():
    """A drive that shakes and a device that follows it is no reading; nor is a clean command."""
    assert not drive_notes(recorded("triangle", 0.0, 0.05))
    assert not drive_notes(recorded("triangle", 5e-4, 0.05))
    shaken = recorded("triangle", 5e-3, 0.0)
    rng = np.random.default_rng(3)
    runs = [
        dataclasses.replace(
            run,
            response=np.asarray(predict(paper_device(), run.drive))
            + 0.05 * rng.standard_normal(1200),
        )
        for run in shaken.runs
        for followed in [np.asarray(predict(paper_device(), run.drive))]
    ]
    assert not drive_notes(Recording(tuple(runs)))


def test_the_steps_of_a_slowly_read_drive_are_told():
    """Eight bits at 8000 samples a period: most neighbours are the same code."""
    rng, runs = np.random.default_rng(1), []
    for drive in triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=16000, periods=2):
        y = np.asarray(predict(paper_device(), drive)) + 0.02 * rng.standard_normal(16000)
        value = digitised(drive.value, 8, 0.0, rng, 10.0)
        runs.append(Run(dataclasses.replace(drive, value=value), y, f"run{len(runs):02d}"))
    (note,) = drive_notes(Recording(tuple(runs)))
    assert "carries noise of 0.011 V rms" in note


@pytest.mark.slow
def test_a_poor_fit_of_a_noisy_drive_is_blamed_on_it():
    """Noise of the response hides it from the check of samples: at 0.65 of their correlation."""
    more = {"rates": (10.0, 20.0, 40.0), "samples": 4000, "periods": 4, "seed": 0}
    noisy = recorded("triangle", 0.15, 2.7, **more)
    assert not check_recording(noisy).faults and drive_notes(noisy)
    result = fit(ECDL(RAPI.guess(noisy)), noisy, throw=False, starts=2)
    (reason,) = (text for text in result.verdict.reasons if "beyond noise" in text)
    assert reason.startswith("noisy drive: ") and "carries noise of 0.15 V rms" in reason
    assert "`--drive-as fitted`" in reason and "rapi diagnose" not in reason
