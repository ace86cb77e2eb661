"""How often faults of a recording are found, and how seldom a healthy one is blamed.

The model here is a four-line loop with three plays, fitted by linear least squares: poor on
purpose, so that residuals bend where the drive turns and where plays take hold.
"""

import dataclasses
import json

import numpy as np
import pytest

from fitting.cli import app
from fitting.commands.run import run as rapi
from fitting.identification.data_checks._data_checks import check_usable, find_faults
from fitting.identification.data_checks._mode_hops import find_mode_hops
from rapi_jax import DataError, predict
from rapi_jax._waveform import multisine, sine, triangle
from rapi_jax.examples import AMPLITUDE, BIAS, paper_device
from rapi_jax.io import read_recording, write_recording
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._run import Run

WAVES = {"triangle": triangle, "sine": sine, "multisine": multisine}
SPAN = 76.0  # GHz, about
FINE = (
    (1000, 1),
    (2000, 2),
    (4000, 1),
)  # samples and periods; a hop stands above one sample's move
SIZES = ((240, 1), (240, 2), (1000, 1), (2000, 10), (4000, 1))


def play(u: np.ndarray, r: float) -> np.ndarray:
    out = np.empty_like(u)
    out[0] = u[0] + r  # as after a long fall
    for i in range(1, u.size):
        out[i] = max(u[i] - r, min(u[i] + r, out[i - 1]))
    return out


def residual(run: Run, order: int = 2, shares: tuple[float, ...] = (0.05, 0.15, 0.3)) -> np.ndarray:
    """Poor model less reading, everywhere."""
    u = run.drive.value
    plays = [play(u, share * run.drive.u_pp) for share in shares]
    columns = np.stack([np.ones_like(u), *(u**k for k in range(1, order + 1)), *plays], axis=1)
    good = run.valid
    return columns @ np.linalg.lstsq(columns[good], run.response[good])[0] - run.response


_DEVICE: dict[tuple[str, int, int], tuple[Drive, np.ndarray]] = {}


def clean(wave: str, samples: int, periods: int) -> tuple[Drive, np.ndarray]:
    """A drive at 10 Hz and the paper's device's answer without noise."""
    key = (wave, samples, periods)
    if key not in _DEVICE:
        options = {"amplitude": AMPLITUDE, "bias": BIAS, "samples": samples, "periods": periods}
        (drive,) = WAVES[wave](10.0, **options)
        _DEVICE[key] = drive, np.asarray(predict(paper_device(), drive))
    return _DEVICE[key]


def drawn(rng: np.random.Generator, noise: float) -> tuple[Drive, np.ndarray]:
    """A drive and the reading of it, with `noise` of the span, white or slow."""
    drive, truth = clean(str(rng.choice(list(WAVES))), *SIZES[rng.integers(len(SIZES))])
    white = rng.standard_normal(truth.size)
    if rng.random() < 0.3:  # correlated from sample to sample by 0.9
        for i in range(1, white.size):
            white[i] = 0.9 * white[i - 1] + np.sqrt(0.19) * white[i]
    return drive, truth + noise * SPAN * white


def digitised(reading: np.ndarray, bits: int) -> np.ndarray:
    step = 90.0 / 2**bits
    return np.round(reading / step) * step


def rolled(drive: Drive, reading: np.ndarray, by: int) -> Recording:
    """The same steady state, recorded from another phase on."""
    moved = Drive(drive.time, np.roll(drive.value, by), drive.excitation_hz, drive.waveform)
    return Recording((Run(moved, np.roll(reading, by)),))


def found(recording: Recording, **options) -> list[str]:
    errors = [residual(run, **options) for run in recording.runs]
    return [fault.kind for fault in find_faults(recording) + find_mode_hops(recording, errors)]


def healthy(seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    noise = float(rng.choice([0.0, 2.7e-4, 5e-3, 0.05]))
    drive, reading = drawn(rng, noise)
    if (bits := int(rng.choice([0, 8, 10, 12, 14]))) > 0:
        reading = digitised(reading, bits)
    if rng.random() < 0.3:
        reading[rng.integers(0, reading.size, 5)] = np.nan
    return rolled(drive, reading, int(rng.integers(drive.size)) if rng.random() < 0.5 else 0)


def test_healthy_readings_are_not_blamed():
    blamed = {seed: kinds for seed in range(600) if (kinds := found(healthy(seed)))}
    assert blamed == {}


@pytest.mark.parametrize("waveform", WAVES)
@pytest.mark.parametrize(
    ("noise", "bits", "periods"),
    [(0.0, 14, 1), (2.7e-4, 8, 2), (2.7e-4, 12, 10), (0.01, 10, 4), (0.05, 14, 2)],
)
def test_healthy_readings_are_not_blamed_by_a_fit(tmp_path, waveform, noise, bits, periods):
    rng = np.random.default_rng(periods)
    runs = []
    for i, rate in enumerate((10.0, 40.0)):
        (drive,) = WAVES[waveform](
            rate, amplitude=AMPLITUDE, bias=BIAS, samples=240, periods=periods
        )
        reading = np.asarray(predict(paper_device(), drive))
        reading = digitised(reading + noise * SPAN * rng.standard_normal(reading.size), bits)
        runs.append(Run(drive, reading, f"run{i}"))
    write_recording(Recording(tuple(runs)), tmp_path / "r")
    options = ["--each", "none", "--starts", "2", "--no-plots"]
    code = rapi(app, ["fit", str(tmp_path / "r"), "-o", str(tmp_path), *options])
    model = json.loads((tmp_path / "model.json").read_text())
    assert model["faults"] == []
    if noise <= 0.01 and bits > 8:
        assert (code, model["verdict"]["reasons"]) == (0, [])


@pytest.mark.parametrize(
    "name",
    ["picma_1hz", "picma_small_loops", "afm_z_closed_loop", "afm_z_open_loop", "servo_lag"],
)
def test_measured_recordings_are_not_blamed(shared_data, name):
    recording = read_recording(shared_data / name)
    check_usable(recording)
    for order in (1, 3):
        assert found(recording, order=order) == []


def hopped(seed: int, noise: float, sizes=FINE) -> tuple[Recording, list[int]]:
    """0.4 to 4 GHz on 76 GHz: once, there and back, or wherever the frequency passes one place."""
    rng = np.random.default_rng(seed)
    drive, truth = clean(str(rng.choice(list(WAVES))), *sizes[rng.integers(len(sizes))])
    period = drive.size // max(drive.periods, 1)
    moved = np.zeros(drive.size, dtype=bool)
    kind = rng.integers(3)
    if kind == 0:
        moved[rng.integers(drive.size // 10, 9 * drive.size // 10) :] = True
    elif kind == 1:
        first = rng.integers(drive.size // 20, 3 * drive.size // 4)
        moved[first : first + int(period * rng.uniform(0.1, 0.2))] = True
    else:
        place = (truth - truth.min()) / np.ptp(truth) - rng.uniform(0.25, 0.75)
        for i in range(1, drive.size):  # hysteretic, as a mode is kept while it can be
            moved[i] = place[i] > 0.02 or (moved[i - 1] and place[i] > -0.02)
    size = float(rng.uniform(0.4, 4.0) * rng.choice([-1, 1]))
    reading = truth + size * moved + noise * rng.standard_normal(truth.size)
    return Recording((Run(drive, reading),)), list(np.flatnonzero(np.diff(moved.astype(int))) + 1)


@pytest.mark.slow
def test_mode_hops_are_found_where_they_are():
    caught, right, listed = 0, 0, 0
    trials = 500
    for seed in range(trials):
        recording, places = hopped(seed, 0.020)
        kinds = find_mode_hops(recording, [residual(run) for run in recording.runs])
        caught += bool(kinds)
        for first, last in kinds[0].samples if kinds else ():
            assert first == last
            listed += 1
            right += min(abs(first - place) for place in places) <= 1
    assert caught >= 0.995 * trials and right >= 0.99 * listed


def test_mode_hops_are_mostly_found_in_coarse_recordings():
    """Where the frequency moves by more than a hop from one sample to the next, not all can be."""
    coarse = [hopped(seed, 0.020, SIZES)[0] for seed in range(300)]
    caught = sum(bool(find_mode_hops(one, [residual(run) for run in one.runs])) for one in coarse)
    assert caught >= 0.8 * len(coarse)


@pytest.mark.parametrize("samples", [1, 2])
def test_where_the_drive_jumps_a_step_is_no_jump_of_the_sensor(samples):
    """A rest, and a step of 1200 V in one sample or two, to which a model answers with nothing."""
    t = np.arange(4000) / 200.0
    u = np.interp(np.arange(4000), [0, 1999, 1999 + samples, 4000], [72.0, 72.0, 1272.0, 1272.0])
    noise = 0.3 * np.random.default_rng(1).standard_normal(4000)
    missed = np.where(u > 700.0, 300.0, 0.0) + noise
    slipped = missed + np.where(np.arange(4000) >= 3000, 40.0, 0.0)
    found = []
    for error in (missed, slipped):
        recording = Recording((Run(Drive(t, u), t - error),), response_unit="nm")
        found.append(find_mode_hops(recording, [error]))
    assert found[0] == []
    (fault,) = found[1]
    assert fault.kind == "jump" and fault.samples == ((3000, 3000),)


def test_a_single_wrong_sample_is_no_hop():
    drive, truth = clean("triangle", 4000, 1)
    noise = np.random.default_rng(0).standard_normal(truth.size)
    reading = truth + 0.02 * noise
    reading[[700, 1500, 3100]] += 3.0
    recording = Recording((Run(drive, reading),))
    assert find_mode_hops(recording, [residual(recording.runs[0])]) == []


@pytest.mark.parametrize(
    ("unit", "kind", "words"),
    [("GHz", "mode hop", "fringes miscounted"), ("um", "jump", "contact"), ("V", "jump", "range")],
)
def test_a_jump_is_a_mode_hop_of_an_optical_frequency_only(unit, kind, words):
    recording, _ = hopped(3, 0.020)
    other = dataclasses.replace(recording, response_unit=unit)
    (fault,) = find_mode_hops(other, [residual(run) for run in other.runs])
    assert fault.kind == kind and words in fault.message
    assert ("mode hop" in fault.message) == (unit == "GHz")


def test_clipped_readings_are_found():
    missed = []
    for seed in range(500):
        rng = np.random.default_rng(seed)
        drive, reading = drawn(rng, float(rng.choice([0.0, 2.7e-4, 5e-3])))
        limit = reading.min() + np.ptp(reading) * rng.uniform(0.5, 0.9)
        reading = np.minimum(reading, limit) if rng.random() < 0.5 else np.maximum(reading, limit)
        if (bits := int(rng.choice([0, 8, 10, 12, 14]))) > 0:
            reading = digitised(reading, bits)
        found = {fault.kind: fault for fault in find_faults(rolled(drive, reading, 0))}
        if "clipped" not in found or not all(
            np.ptp(reading[a : b + 1]) == 0 for a, b in found["clipped"].samples
        ):
            missed.append(seed)
    assert missed == []


def test_wrong_periods_are_found_and_right_ones_named():
    missed = []
    for seed in range(500):
        rng = np.random.default_rng(seed)
        drive, reading = drawn(rng, 2.7e-4)
        factor = float(rng.choice([0.25, 0.5, 2.0, 3.0, 100.0, 1000.0, 0.8, 0.9, 1.1, 1.25, 1.6]))
        if factor < 1 / max(drive.periods, 1):
            continue  # no complete period: refused, see below
        value = drive.value + 1e-3 * rng.standard_normal(drive.size)
        wrong = Drive(drive.time, value, 10.0 * factor, drive.waveform)
        kinds = {fault.kind: fault for fault in find_faults(Recording((Run(wrong, reading),)))}
        if "wrong period" not in kinds:
            missed.append((seed, drive.waveform, drive.size, drive.periods, factor))
        elif drive.periods > 1 and drive.waveform != "multisine":
            message = kinds["wrong period"].message
            if "repeats at about 10 Hz" not in message and "repeats at about 9.9" not in message:
                missed.append((seed, message))
    assert missed == []


def test_no_complete_period_and_no_reading_are_refused():
    drive, truth = clean("triangle", 240, 1)
    slow = Drive(drive.time, drive.value, 1.0, "triangle")
    with pytest.raises(DataError, match="run 'run00' holds no complete period of 1 Hz"):
        check_usable(Recording((Run(slow, truth),)))
    with pytest.raises(DataError, match="run 'run00' has no valid reading"):
        check_usable(Recording((Run(drive, np.full_like(truth, np.nan)),)))
    with pytest.raises(DataError, match="`response_lag_s` = 3 s must be short"):
        check_usable(Recording((Run(drive, truth),), response_lag_s=3.0))


def test_readings_that_rest_for_a_reason_are_not_clipped():
    """A held drive, and a play that has not taken hold after the drive turned."""
    drive, truth = clean("triangle", 1000, 1)
    held = np.minimum(drive.value, BIAS)
    recording = Recording((Run(Drive(drive.time, held, 10.0, "triangle"), 12.0 * held),))
    assert find_faults(recording) == []
    two = np.tile(drive.value, 2)
    time = np.arange(two.size) * drive.step_s
    settled = Run(Drive(time, two, 10.0, "triangle"), 12.0 * play(two, 0.4))
    assert find_faults(Recording((settled,))) == []
