"""A drive whose reading is noisy, and readings that hang."""

import dataclasses

import numpy as np
import pytest

from fitting import check_recording
from fitting.identification.data_checks._data_checks import find_faults
from fitting.identification.data_checks.drives._drive_noise import (
    find_drive_noise,
    find_swapped_columns,
)
from fitting.identification.data_checks.drives._drive_reading import describe_cure
from rapi_jax import Drive, Recording, Run, predict
from rapi_jax.io import read_recording, write_recording
from tests.support.spoiled import WAYS, healthy


def residuals(columns, clean):
    """Of the true device, driven as the columns say."""
    recording = columns.recording()
    errors = [np.asarray(predict(clean.device, run.drive)) - run.response for run in recording.runs]
    return recording, errors


def test_a_noisy_drive_is_named_with_its_noise():
    columns = healthy(51)
    WAYS["noisy drive"](columns)
    faults = find_drive_noise(*residuals(columns, columns))
    assert [fault.run for fault in faults] == ["run00", "run01", "run02", "run03"]
    assert all("0.02" in fault.message for fault in faults)  # 0.5 % of 4.5 V


def test_columns_may_be_swapped_where_only_the_drive_has_noise():
    columns = healthy(51)
    WAYS["noisy drive"](columns)
    faults = find_drive_noise(*residuals(columns, columns))
    assert {fault.kind for fault in faults} == {"noisy drive"}
    assert not any("swapped" in fault.message for fault in faults)
    recording, errors = residuals(columns, columns)
    sent = zip(recording.runs, healthy(51).drive, strict=True)
    runs = tuple(dataclasses.replace(run, response=20.0 * drive) for run, drive in sent)
    faults = find_drive_noise(dataclasses.replace(recording, runs=runs), errors)
    assert [fault.kind for fault in faults] == 4 * ["columns swapped"]
    smooth = tuple(
        dataclasses.replace(run, response=np.asarray(predict(columns.device, sent)))
        for run, sent in zip(recording.runs, healthy(51).recording().drives, strict=True)
    )  # simulated: as free of noise, and no plain waveform
    faults = find_drive_noise(dataclasses.replace(recording, runs=smooth), errors)
    assert [fault.kind for fault in faults] == 4 * ["noisy drive"]


def test_noise_of_the_reading_alone_is_none_of_the_drive():
    columns = healthy(52)
    WAYS["noise of 10 % of span"](columns)
    assert find_drive_noise(*residuals(columns, columns)) == []


def test_a_noise_free_world_has_none():
    columns = healthy(53)
    WAYS["no noise at all"](columns)
    columns.response = [1.01 * y for y in columns.response]  # a residual as smooth as the drive
    assert find_drive_noise(*residuals(columns, columns)) == []


def test_a_reading_that_hangs_is_named_with_its_samples():
    columns = healthy(54)
    columns.response[2][450:480] = columns.response[2][450]
    (fault,) = find_faults(columns.recording())
    assert fault.kind == "frozen reading" and fault.run == "run02"
    assert fault.samples == ((450, 479),)


def test_a_flat_part_of_a_loop_that_is_digitised_does_not_hang():
    """As where a polarisation or a magnetisation saturates: a step of the reading is long there."""
    columns = healthy(54)
    for row, drive in enumerate(columns.drive):
        steep = np.tanh(20.0 * (drive - drive.mean()) / np.ptp(drive)) + 0.02 * drive
        columns.response[row] = np.round(steep * 1024) / 1024
    kinds = [fault.kind for fault in find_faults(columns.recording())]
    assert "frozen reading" not in kinds
    columns.response[2][180:230] = columns.response[2][180]  # where it is steep
    faults = {fault.kind: fault for fault in find_faults(columns.recording())}
    ((first, last),) = faults["frozen reading"].samples
    assert first <= 180 and last == 229


def test_a_reading_that_is_digitised_coarsely_is_not_a_command():
    columns = healthy(51)
    WAYS["noisy drive"](columns)
    for row, response in enumerate(columns.response):
        step = np.ptp(response) / 40.0
        columns.response[row] = step * np.round(response / step)
    assert find_swapped_columns(columns.recording()) == []
    columns.response = healthy(51).drive
    assert len(find_swapped_columns(columns.recording())) == 4


def test_a_sine_of_few_samples_is_not_as_rough_as_a_measurement():
    """Put in place of noisy readings, over an integrated reading that is smooth."""
    t = np.arange(1200) / 400.0
    drive = Drive(t, 15.0 * np.sin(2 * np.pi * t), excitation_hz=1.0, waveform="sine")
    steps = np.round(np.cumsum(np.round(4.0 * np.cos(2 * np.pi * t - 0.3))), 6)
    (fault,) = find_swapped_columns(Recording.of([rough(drive)], [steps]))
    assert fault.kind == "columns swapped"
    assert find_swapped_columns(Recording.of([drive], [steps])) == []


def rough(drive: Drive) -> Drive:
    noise = 0.02 * np.random.default_rng(3).standard_normal(drive.size)
    return dataclasses.replace(drive, value=drive.value + noise)


def test_a_frequency_read_from_fringes_is_no_command(tmp_path):
    """It is smooth by construction, under a drive that an oscilloscope read."""
    columns = healthy(51)
    WAYS["noisy drive"](columns)
    columns.response = healthy(51).drive
    swapped = columns.recording()
    fringes = dataclasses.replace(swapped, provenance={"response_from": "fringes"})
    write_recording(fringes, tmp_path / "r")
    fringes = read_recording(tmp_path / "r")
    assert find_swapped_columns(fringes) == []
    assert {fault.kind for fault in check_recording(swapped).faults} == {"columns swapped"}
    assert "columns swapped" not in {fault.kind for fault in check_recording(fringes).faults}
    assert not any(note.startswith("columns:") for note in check_recording(fringes).notes)


def test_readings_that_rest_where_the_drive_rests_do_not_hang():
    columns = healthy(55, noise=0.0)
    for row in range(4):
        columns.drive[row][100:110] = columns.drive[row][100]
        columns.response[row][100:110] = columns.response[row][100]
    assert [f for f in find_faults(columns.recording()) if f.kind == "frozen reading"] == []


@pytest.mark.parametrize("way", ["frozen for 3 %", "frozen for 10 %"])
def test_a_noisy_reading_that_hangs_from_a_turn_on_is_frozen(way):
    columns = healthy(54)  # its second period begins at sample 400, where the drive turns
    WAYS[way](columns)
    (fault,) = find_faults(columns.recording())
    last = 400 + int(float(way.split()[2]) / 100.0 * 1200) - 1
    assert (fault.kind, fault.run, fault.samples) == ("frozen reading", "run02", ((400, last),))


def test_a_drive_that_was_averaged_already_is_not_averaged_again():
    rng = np.random.default_rng(4)
    u = np.cumsum(rng.normal(size=200))
    u -= np.linspace(0.0, u[-1], 200)
    noise = 0.01 * rng.normal(size=600)
    cures = []
    for value in (np.tile(u, 3), np.tile(u, 3) + noise):
        drive = Drive(np.arange(600) / 2000.0, value, 10.0, "multisine")
        cures.append(describe_cure(Run(drive, drive.value)))
    assert "averaged already" in cures[0] and "--drive-as averaged" in cures[1]
