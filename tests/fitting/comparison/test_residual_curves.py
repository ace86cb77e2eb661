"""What one model leaves of two recordings: against what was put into one of them."""

import numpy as np
import pytest
from edge_worlds import drives, record

from fitting.comparison._residual_curves import residual_curves
from fitting.comparison._response_change import ModelErrors
from fitting.report.comparison._figure import draw_residuals
from fitting.report.diagnosis._numbers import SPACE, Scale
from rapi_jax import Recording
from rapi_jax.examples import paper_device

MHZ = Scale.of("GHz", [0.4])
CONTENT = {"unit": "GHz", "drive_unit": "V", "gap": None}


def shifted(recording: Recording, size: float) -> Recording:
    """With `size` GHz more in the first half of each period, as the drive rises, and an origin."""
    out = []
    for run in recording.runs:
        phase = np.mod(run.drive.time * run.drive.excitation_hz, 1.0)
        out.append(run.response + size * (phase < 0.5) + 3.0)
    return Recording.of(recording.drives, out)


def curves(before: Recording, after: Recording) -> list[dict]:
    """Of the paper's device."""
    left = ModelErrors.of(paper_device(), before), ModelErrors.of(paper_device(), after)
    return residual_curves(left, (before, after))


def test_curves_are_data_less_model_without_their_own_mean():
    before = record(drives(samples=400), noise=0.0)
    rows = curves(before, shifted(before, 0.4))
    assert [(row["excitation_hz"], row["amplitude"]) for row in rows] == [(10.0, 3.0), (40.0, 3.0)]
    for row in rows:
        rising = np.asarray(row["period"]) < 0.5
        assert np.asarray(row["before"]) == pytest.approx(np.zeros(rising.size), abs=1e-9)
        assert np.asarray(row["after"]) == pytest.approx(np.where(rising, 0.2, -0.2), abs=1e-6)


def test_drives_that_one_lacks_are_left_out_and_the_largest_change_is_shown():
    before = record(drives((10.0, 20.0, 40.0)), noise=0.0)
    after = shifted(record(drives((20.0, 30.0)), noise=0.0), 0.4)
    rows = curves(before, after)
    assert [row["excitation_hz"] for row in rows] == [20.0]
    figure = draw_residuals(CONTENT | {"residuals": rows}, MHZ)
    assert figure is not None and len(figure.panels) == 1
    shows = figure.shows.replace(SPACE, " ")
    assert "At 20 Hz, swing 3 V" in shows and "200 MHz after" in shows
    other = record(drives((15.0,)), noise=0.0)
    assert curves(before, other) == []
    assert draw_residuals(CONTENT | {"residuals": []}, MHZ) is None


def test_parts_of_a_period_without_a_reading_are_missing():
    before = record(drives((10.0,), samples=40), noise=0.0)
    (row,) = curves(before, before)
    known = np.isfinite(row["after"])
    assert 20 < known.sum() < known.size
    figure = draw_residuals(CONTENT | {"residuals": [row]}, MHZ)
    assert figure is not None and "nan" not in str(figure.table.rows)
