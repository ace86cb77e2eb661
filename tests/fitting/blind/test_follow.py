"""Second sessions: the first one and one more run of the same device on the same clock."""

import dataclasses

import numpy as np
import pytest

from fitting.blind.prediction._follow_up import (
    CLOSED,
    KINDS,
    append_run,
    closed_follow_ups,
    draw_random_scan,
    files_by_key,
    read_advised_scan,
    select_ambiguous,
)
from fitting.blind.protocol._answers import read_answer, read_spec
from fitting.blind.protocol._folder import BankFolder, write_json
from fitting.blind.simulator._scan import Scan
from rapi_jax import Identified, sine, step_and_hold, triangle
from rapi_jax.io import read_recording, write_drive

LIKE = Scan(80.0, 2.0, 3.0, "triangle", 4, 300)


@pytest.fixture(scope="module")
def device(made_once):
    """A world and its recording."""
    name = made_once.entries[0][0]
    value, _ = read_answer(made_once, name)
    return read_spec(value).draw(), read_recording(made_once.recordings / name)


def end(world):
    last = world.runs[-1].scan
    return last.start_s + last.duration_s


def test_a_random_scan_keeps_to_the_limits_of_an_advised_one(device):
    _, recording = device
    limits, rates = Identified.of(recording).limits(), recording.rates
    seen = set()
    for k in range(40):
        runs = (dataclasses.replace(recording.runs[0], name=f"other{k}"), *recording.runs[1:])
        scan = draw_random_scan(dataclasses.replace(recording, runs=runs), LIKE)
        seen.add((scan.waveform, scan.rate_hz, scan.swing, scan.bias))
        drive = scan.drive
        assert limits.low_v - 1e-9 <= drive.min() and drive.max() <= limits.high_v + 1e-9
        assert np.abs(np.diff(drive)).max() / scan.step_s <= limits.slew_v_per_s * (1 + 1e-9)
        assert rates[0] / 2 <= scan.rate_hz <= 10 * rates[-1]
        assert (scan.periods, scan.samples) == (4, 300)
    assert len(seen) == 40 and {waveform for waveform, *_ in seen} == {"triangle", "sine"}


def test_a_random_scan_follows_from_the_recording_alone(device):
    world, recording = device
    one, two = draw_random_scan(recording, LIKE), draw_random_scan(recording, LIKE)
    assert dataclasses.astuple(one)[:-1] == dataclasses.astuple(two)[:-1]
    lead = max(2, np.ceil(0.1 * one.rate_hz)) / one.rate_hz
    assert one.start_s - lead - end(world) == pytest.approx(60.0, abs=1e-3)


DRIVES = {
    "triangle": triangle(90.0, amplitude=1.5, bias=3.0, samples=1275, periods=5),
    "sine": sine(200.0, amplitude=2.5, bias=3.1, samples=1280, periods=4),
    "step": step_and_hold((2.0, 4.0, 2.0), hold_s=3.0, rise_s=0.1, step_s=0.01),
}


@pytest.fixture
def advice(tmp_path):
    """Write a next scan as a prediction does; give it back as the laboratory plays it."""

    def write(drive, **said):
        folder = BankFolder(tmp_path)
        (folder.predictions / "world-1").mkdir(parents=True)
        write_drive(drive, folder.predictions / "world-1" / "next_drive.csv")
        scan = {"waveform": drive.waveform, "excitation_hz": drive.excitation_hz, **said}
        return folder, {"diagnosis": {"next_scan": scan}}

    return write


@pytest.mark.parametrize("waveform", DRIVES)
def test_the_advised_drive_is_the_one_that_is_played(device, advice, waveform):
    world, recording = device
    (drive,) = DRIVES[waveform]
    low, high = float(drive.value.min()), float(drive.value.max())
    folder, said = advice(drive, amplitude=high - low, bias=(high + low) / 2)
    scan = read_advised_scan(folder, "world-1", said, world)
    second = append_run(recording, world, scan, 1)
    assert [run.name for run in second.runs[:-1]] == [run.name for run in recording.runs]
    for one, two in zip(recording.runs, second.runs[:-1], strict=True):
        np.testing.assert_array_equal(one.response, two.response)
    last = second.runs[-1]
    np.testing.assert_allclose(last.drive.value, drive.value, atol=1e-9)
    np.testing.assert_allclose(last.drive.time, drive.time, atol=1e-9)
    assert (last.drive.excitation_hz, last.drive.waveform) == (drive.excitation_hz, waveform)
    assert last.name == f"run{len(recording.runs):02d}"
    lead = max(2, np.ceil(0.1 * scan.rate_hz)) / scan.rate_hz
    assert last.drive.start_s - lead - end(world) == pytest.approx(60.0, abs=1e-3)
    clean = world.simulate([*(run.scan for run in world.runs), scan])[-1]
    left = last.response - clean
    assert 0.5 * world.noise.rms < np.sqrt(np.mean(left**2)) < 2 * world.noise.rms


def test_a_sharp_triangle_keeps_its_corners_between_samples(device, advice):
    """255 samples a period: no sample lies on the upper corner."""
    world, _ = device
    (drive,) = DRIVES["triangle"]
    folder, said = advice(drive, amplitude=1.5, bias=3.0)
    scan = read_advised_scan(folder, "world-1", said, world)
    top = scan.voltage(np.array([0.5 / 90.0]))
    assert top == pytest.approx(3.75, abs=1e-9) and drive.value.max() < 3.75 - 1e-4


def test_a_bent_triangle_is_played_from_its_table(device, advice):
    world, _ = device
    (drive,) = DRIVES["sine"]
    bent = dataclasses.replace(drive, waveform="triangle")
    folder, said = advice(bent, amplitude=2.5, bias=3.1)
    scan = read_advised_scan(folder, "world-1", said, world)
    np.testing.assert_allclose(scan.drive, drive.value, atol=1e-9)


def test_which_devices_are_measured_again(tmp_path):
    def said(names, files=("next_drive.csv",), withheld=None):
        return {
            "diagnosis": {"verdict": {"set": names}},
            "files": {file: "" for file in files},
            "withheld": withheld,
        }

    two = ["creep", "drift"]
    predictions = {f"world-{k}": said(two) for k in range(60)}
    predictions["world-1"] = said(["creep"])
    predictions["world-2"] = said(two, files=())
    predictions["world-3"] = said(two, withheld="creep")
    predictions["world-4"] = {"error": "ValueError: no", "files": {}, "withheld": None}
    names = select_ambiguous(predictions)
    assert len(names) == 56 and names[:2] == ["world-0", "world-5"] and names[-1] == "world-59"
    # Of these, those that were measured again are the ones that were closed.
    folder = BankFolder(tmp_path)
    folder.follow.mkdir(parents=True)
    promised = {f"{kind}/{name}": "" for kind in KINDS for name in names[:3]}
    write_json(folder.follow / CLOSED, {"sha256": promised})
    found = closed_follow_ups(folder, predictions)
    assert [pair.name for pair in found] == names[:3]
    assert set(files_by_key(found)) == set(promised)
