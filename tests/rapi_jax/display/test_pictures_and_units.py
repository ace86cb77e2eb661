"""Units in which sizes are read, and what pictures of many readings show."""

import dataclasses

import numpy as np
import pytest

from rapi_jax import Recording, plot, sine, triangle
from rapi_jax.internal import quantity, readable_unit


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.004, "uC", "4 nC"),
        (8.86e-7, "uC", "886 fC"),
        (2e-12, "uC", "0.002 fC"),
        (0.0427, "GHz", "42.7 MHz"),
        (3e-9, "V", "3 nV"),
        (5e-7, "um", "0.5 pm"),
        (12.0, "K", "12 K"),
        (0.0, "uC", "0 uC"),
    ],
)
def test_a_size_has_one_to_three_digits_before_the_point(value, unit, text):
    assert quantity(value, unit) == text


def test_one_unit_for_several_sizes():
    assert readable_unit("um", (0.2, float("nan"), 0.003)) == ("nm", pytest.approx(1e3))


def recorded(drive, factor=1.0, unit="GHz"):
    response = factor * (10.0 * drive.value + 3.0 * np.sin(drive.value))
    return dataclasses.replace(Recording.of([drive], [response]), response_unit=unit)


def labels(picture):
    return [text.get_text() for text in picture.axes[0].get_legend().get_texts()]


def test_many_readings_of_a_loop_are_a_median_and_a_band():
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=20_000)
    axis = plot.loops(recorded(drive)).axes[0]
    assert len(axis.collections) == 2  # a band for each branch
    assert labels(axis.figure) == ["measured, with 95 % band"]
    assert max(line.get_xdata().size for line in axis.lines) < 1000


def test_few_readings_and_loops_inside_loops_are_points():
    (drive,) = sine(10.0, amplitude=4.0, bias=3.0, samples=400)
    assert labels(plot.loops(recorded(drive))) == ["measured"]
    (drive,) = sine(10.0, amplitude=4.0, bias=3.0, samples=6000)
    several = dataclasses.replace(drive, waveform="multisine")
    assert labels(plot.loops(recorded(several))) == ["measured, one of 10 readings"]


def test_a_loop_of_a_tiny_charge_has_its_unit():
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=400)
    axis = plot.loops(recorded(drive, 1e-6, "uC")).axes[0]
    assert axis.get_ylabel() == "response less a straight line (pC)"
