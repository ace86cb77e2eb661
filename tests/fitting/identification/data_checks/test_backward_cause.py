"""Loops that are passed the wrong way round, and which of three causes is named."""

import dataclasses

import numpy as np
import pytest

from fitting import fit
from fitting.identification.data_checks.runs._backward_cause import (
    describe_backward,
)
from rapi_jax import ECDL, RAPI, Drive, Recording, Run, predict, sine, triangle
from rapi_jax.examples import paper_device
from rapi_jax.internal import waveform_miss

SHAPES = {"triangle": triangle, "sine": sine}


def recorded(waveform: str, rates, noise: float = 0.0) -> Recording:
    """The paper's device, with white noise in GHz."""
    rng = np.random.default_rng(0)
    drives = SHAPES[waveform](list(rates), amplitude=4.5, bias=3.0, samples=900, periods=3)
    clean = [np.asarray(predict(paper_device(), drive)) for drive in drives]
    return Recording.of(drives, [y + noise * rng.standard_normal(y.size) for y in clean])


def exchanged(recording: Recording) -> Recording:
    """Drive and response in each other's place; the unit of the drive is then GHz, read as V."""
    return Recording(
        tuple(
            Run(dataclasses.replace(run.drive, value=run.response), run.drive.value, run.name)
            for run in recording.runs
        )
    )


def turned(recording: Recording) -> Recording:
    """All samples in reverse order."""
    return Recording(
        tuple(
            Run(
                Drive(run.drive.time, run.drive.value[::-1], run.drive.rate, run.drive.waveform),
                run.response[::-1], run.name,
            )
            for run in recording.runs
        )
    )  # fmt: skip


def negative(recording: Recording) -> Recording:
    runs = (dataclasses.replace(run, response=-run.response) for run in recording.runs)
    return Recording(tuple(runs))


WAYS = {
    "swapped": (exchanged, "columns swapped", "`drive` and `response` are swapped"),
    "reversed": (turned, "reversed time", "their order is reversed"),
    "sign": (negative, "reversed time", "the response has the wrong sign"),
}


@pytest.mark.parametrize("rates", [(10.0,), (10.0, 20.0), (5.0, 20.0, 80.0)])
@pytest.mark.parametrize("waveform", ["triangle", "sine"])
@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("way", list(WAYS))
def test_the_likelier_cause_is_named(way, noise, waveform, rates):
    change, kind, words = WAYS[way]
    said = describe_backward(change(recorded(waveform, rates, noise)), 0.99)
    assert said[0] == kind and words in said[1]


def test_where_neither_column_is_a_plain_waveform_both_are_named():
    (run,) = recorded("triangle", (10.0,)).runs
    bent = run.drive.value + 0.1 * np.sin(4 * np.pi * run.drive.time * 10.0)
    odd = Run(dataclasses.replace(run.drive, value=bent), run.response, "run00")
    kind, text = describe_backward(Recording((odd,)), 0.99)
    assert kind == "reversed time" and "Either the order" in text and "are swapped" in text


@pytest.mark.parametrize(
    ("way", "waveform", "rates", "noise"),
    [
        ("swapped", "triangle", (10.0, 20.0, 40.0), 0.0),
        ("swapped", "triangle", (20.0,), 0.02),
        ("swapped", "sine", (5.0, 50.0), 0.0),
        ("reversed", "triangle", (10.0, 20.0, 40.0), 0.02),
        ("sign", "triangle", (10.0, 20.0, 40.0), 0.02),
    ],
)
def test_a_fit_names_it(way, waveform, rates, noise):
    change, kind, words = WAYS[way]
    recording = change(recorded(waveform, rates, noise))
    model = ECDL(RAPI.guess(recording))
    result = fit(model, recording, starts=2, hold_out=False, throw=False)
    (fault,) = result.faults
    assert (fault.kind, fault.run) == (kind, "run00") and words in fault.message


def test_swapped_columns_with_noise_are_named_before_noise_of_the_drive():
    recording = exchanged(recorded("triangle", (10.0, 20.0, 40.0), 0.02))
    model = ECDL(RAPI.guess(recording))
    result = fit(model, recording, starts=1, hold_out=False, throw=False)
    assert {fault.kind for fault in result.faults} == {"columns swapped"}
    for fault in result.faults:
        first, other = "are swapped: exchange them", "If they are right: Import it again"
        assert first in fault.message and other in fault.message


def test_a_waveform_is_as_far_from_its_like_as_is_known():
    """By arithmetic: a sine plus a third harmonic of a tenth misses by a tenth over sqrt 2."""
    time = np.arange(3000) / 1000.0
    phase = 2 * np.pi * 10.0 * time + 0.3
    value = np.sin(phase) + 0.1 * np.sin(3.0 * phase + 1.2)
    run = Run(Drive(time, value, 10.0, "sine"), value, "run00")
    found = waveform_miss(run, value)
    np.testing.assert_allclose(
        found, 0.1 / np.sqrt(2.0) / np.ptp(value), rtol=1e-3
    )  # the last period lacks a sample
    assert waveform_miss(run, np.ones(3000)) == 0.0
    assert waveform_miss(run, np.sin(phase)) < 1e-12
