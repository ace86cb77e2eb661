"""Drives of any shape that repeat are taken for periodic, and no others."""

import dataclasses

import numpy as np
import pytest

from fitting.diagnosis._repetition import with_repetition
from rapi_jax import Drive, Recording, Run, predict
from rapi_jax.examples import paper_device

RATE, SAMPLES = 10.0, 200  # Hz; a period


def trapezoid(periods: float, *, begin: float = 0.0, samples: int = SAMPLES) -> Drive:
    """It holds at both ends; `begin`: the part of a period at which the record begins."""
    phase = begin + np.arange(round(periods * samples)) / samples
    knots = [0.0, 0.1, 0.4, 0.6, 0.9, 1.0]
    value = np.interp(phase % 1.0, knots, [1.0, 1.0, 5.0, 5.0, 1.0, 1.0])
    return Drive(np.arange(phase.size) / (RATE * samples), value, RATE, "other")


def run_of(drive: Drive, *, steady: bool = True) -> Run:
    """The device's answer, with noise; not `steady`: its first period ends elsewhere."""
    periodic = dataclasses.replace(drive, waveform="multisine")
    response = np.asarray(predict(paper_device(), periodic))
    start = 0.0 if steady else 5.0 * np.exp(-drive.time * RATE * 3.0)
    noise = 0.02 * np.random.default_rng(0).standard_normal(drive.size)
    return Run(drive, response + start + noise, "run")


def waveform(run: Run) -> str:
    return with_repetition(Recording((run,))).runs[0].drive.waveform


@pytest.mark.parametrize("periods", [1, 2, 4, 2.5])
def test_what_repeats_is_periodic(periods):
    assert waveform(run_of(trapezoid(periods))) == "multisine"


def test_a_record_that_begins_within_a_period():
    assert waveform(run_of(trapezoid(3, begin=0.25))) == "multisine"


def test_periods_of_no_whole_number_of_samples():
    drive = trapezoid(4.0)
    odd = np.interp(np.arange(790) * 1.0093 / 200.0 / RATE, drive.time, drive.value)
    time = np.arange(790) * 1.0093 / 200.0 / RATE
    assert waveform(run_of(Drive(time, odd, RATE, "other"))) == "multisine"


def test_a_response_that_does_not_return_leaves_it_as_it_was():
    assert waveform(run_of(trapezoid(1), steady=False)) == "other"


def test_what_does_not_repeat_stays_so():
    drive = trapezoid(3)
    grows = dataclasses.replace(drive, value=drive.value * (1.0 + 0.02 * drive.time * RATE))
    assert waveform(run_of(grows)) == "other"
    half = trapezoid(0.6)
    assert waveform(Run(half, half.value, "run")) == "other"
    free = dataclasses.replace(drive, excitation_hz=None)
    assert waveform(Run(free, free.value, "run")) == "other"
    open_end = dataclasses.replace(trapezoid(1), value=np.linspace(1.0, 5.0, SAMPLES))
    assert waveform(Run(open_end, open_end.value, "run")) == "other"
