"""Readings of few levels and drives of two are named; digitised ones and a single one are not."""

import numpy as np
import pytest

from fitting.identification.data_checks._data_checks import find_faults
from rapi_jax import Recording
from tests.support.spoiled import WAYS, healthy


def kinds(columns):
    return [(fault.kind, fault.run) for fault in find_faults(columns.recording())]


def test_a_reading_of_three_bits_is_coarse():
    columns = healthy(1)
    WAYS["three bits"](columns)
    assert kinds(columns) == [("coarse reading", run.name) for run in columns.recording().runs]


@pytest.mark.parametrize("bits", [5, 8, 12])
def test_a_digitised_reading_is_not(bits):
    columns = healthy(1)
    step = np.ptp(columns.response[0]) / 2**bits
    columns.response = [np.round(y / step) * step for y in columns.response]
    assert [kind for kind, _ in kinds(columns) if kind == "coarse reading"] == []


def test_drives_that_only_switch_are_named_once():
    columns = healthy(1)
    WAYS["a square drive"](columns)
    assert kinds(columns) == [("switched drive", "run00")]


@pytest.mark.parametrize("noise", [1e-3, 0.02])  # of the swing
def test_a_square_drive_with_noise_and_edges_is_named(noise):
    columns, rng = healthy(1), np.random.default_rng(2)
    WAYS["a square drive"](columns)
    for k, drive in enumerate(columns.drive):
        u = np.convolve(drive, np.ones(3) / 3.0, "same")
        u[[0, -1]] = drive[[0, -1]]
        columns.drive[k] = u + noise * np.ptp(u) * rng.standard_normal(u.size)
    assert ("switched drive", "run00") in kinds(columns)


@pytest.mark.parametrize("hold", [0.0, 0.35])  # of the period, at each end
def test_a_trapezoid_is_no_switch(hold):
    columns = healthy(1)
    for k, drive in enumerate(columns.drive):
        middle, half = (drive.max() + drive.min()) / 2.0, np.ptp(drive) / 2.0
        columns.drive[k] = middle + half * np.clip(
            (drive - middle) / half / (1.0 - 2 * hold), -1, 1
        )
    assert "switched drive" not in [kind for kind, _ in kinds(columns)]


def test_one_switched_drive_beside_others_is_no_fault():
    columns, square = healthy(1), healthy(1)
    WAYS["a square drive"](square)
    runs = (*columns.recording().runs[:3], square.recording().runs[3])
    assert find_faults(Recording(runs)) == []
