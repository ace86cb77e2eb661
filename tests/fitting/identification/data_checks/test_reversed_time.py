"""Recordings in reverse order are named; what a model leaves for another reason is not."""

import numpy as np
import pytest

from fitting import fit
from fitting.identification.data_checks.runs._exchanged_runs import backwards
from tests.support.spoiled import WAYS, healthy


def found(columns):
    options = {"starts": 2, "hold_out": False, "throw": False}
    return [fault.kind for fault in fit(columns.device, columns.recording(), **options).faults]


def test_a_recording_that_runs_backwards_is_named():
    columns = healthy(61)
    WAYS["time reversed"](columns)
    assert found(columns) == ["reversed time"]


@pytest.mark.parametrize("way", ["clipped softly", "rectified"])
def test_a_poor_fit_of_another_cause_is_not(way):
    columns = healthy(61)
    WAYS[way](columns)
    assert "reversed time" not in found(columns)


def test_backwards_twice_is_the_recording():
    recording = healthy(61).recording()
    for one, other in zip(backwards(backwards(recording)).runs, recording.runs, strict=True):
        np.testing.assert_allclose(one.drive.time, other.drive.time, rtol=0, atol=1e-12)
        assert np.array_equal(one.drive.value, other.drive.value)
        assert np.array_equal(one.response, other.response)
