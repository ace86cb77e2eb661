"""Errors put at a known place are found there, and all parts sum to the whole."""

import dataclasses

import numpy as np
import pytest
from silent import session

from fitting.diagnosis.noise._periods import PeriodBlock, period_blocks
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.where._branches import branches
from fitting.diagnosis.where._cells import cells
from fitting.diagnosis.where._description import describe_localisation
from fitting.diagnosis.where._gap import measure_gap
from fitting.diagnosis.where._localisation import localise
from rapi_jax import Drive, Recording
from rapi_jax.sampling._batch import to_batch

WHITE = Spectrum.of_white(1.0)


def white(parts: list[PeriodBlock], seed: int = 0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.standard_normal(b.left.shape) for b in parts]


@pytest.mark.parametrize("own_origin", [False, True])
@pytest.mark.parametrize("masked", [False, True])
def test_parts_sum_to_the_whole(own_origin: bool, masked: bool):
    recording, parts = session()
    rng = np.random.default_rng(0)
    if masked:
        parts = [dataclasses.replace(b, use=(rng.random(b.use.shape) > 0.1) * 1.0) for b in parts]
    e = [
        (x + np.cos(2 * np.pi * b.phase)[None, :]) * b.use
        for x, b in zip(white(parts), parts, strict=True)
    ]
    whole = measure_gap(e, parts, WHITE, own_origin=own_origin, fitted=12)
    found = cells(e, parts, WHITE, recording, own_origin=own_origin, fitted=12)
    assert len(found) == 16
    assert sum(c.synchronous for c in found) == pytest.approx(whole.synchronous, rel=1e-9)
    if not own_origin:  # a mean taken out of a run is taken out of all its parts
        assert sum(c.structural for c in found) == pytest.approx(whole.structural2, rel=1e-9)
    assert sum(c.readings for c in found) == sum(b.use.sum() for b in parts)
    entries = localise(e, parts, WHITE, recording)
    assert sum(entry["share"] for entry in entries) == pytest.approx(1.0)
    assert [x["share"] for x in entries] == sorted((x["share"] for x in entries), reverse=True)


@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("region", ["edge", "middle"])
def test_an_error_is_found_where_it_is(direction: str, region: str):
    """Rms 3 in one part of the last run, a triangle that rises to phase 0.5, then falls."""
    recording, parts = session()
    e = white(parts)
    phase = parts[3].phase
    along = np.mod(2 * phase, 1.0)
    there = (phase < 0.5) == (direction == "up")
    there &= ((along < 0.1) | (along > 0.9)) == (region == "edge")
    e[3] = e[3] + 3.0 * there[None, :]
    top = localise(e, parts, WHITE, recording)[0]
    assert (top["run"], top["direction"], top["region"]) == (3, direction, region)
    # Three standard errors of an edge: 16 phases of 5 periods, so 1 / sqrt(80).
    assert top["rms"] == pytest.approx(3.0, abs=3 * 0.115)
    assert top["share"] > 0.6
    assert top["excitation_hz"] == 40.0
    text = describe_localisation([*localise(e, parts, WHITE, recording)], None)
    assert ("rising" if direction == "up" else "falling") in text
    assert "40 Hz" in text
    assert "repeats with the scan" in text


def test_branches_are_those_of_the_drive():
    """Also where the record begins in mid-branch, against the sign of the drive's own slope."""
    for shift in (0.0, 0.13, 0.5, 0.8):
        t = np.arange(800) / 8000.0
        u = 3.0 - np.abs(2.0 * np.mod(t * 40.0 + shift, 1.0) - 1.0) * 2.0
        drive = Drive(t, u, excitation_hz=40.0, waveform="triangle")
        recording = Recording.of([drive], [np.zeros(800)])
        (block,) = period_blocks(recording, to_batch(recording, lead=True))
        up, along = branches(drive, block)
        slope = np.gradient(block.drive[0])
        inner = (along > 0.03) & (along < 0.97)
        np.testing.assert_array_equal(up[inner], slope[inner] > 0)


def test_error_that_does_not_repeat_is_named_so():
    recording, parts = session()
    sign = np.array([1.0, -1.0, 1.0, -1.0, 0.0])[:, None]
    e = [x + 1.2 * sign for x in white(parts)]
    entries = localise(e, parts, WHITE, recording)
    assert all(entry["rms_not_locked"] > 2 * entry["rms"] for entry in entries)
    text = describe_localisation(
        entries, {"lines": [{"hz": 50.0, "amplitude": 1.0, "p_value": 0.0, "locked": False}]}
    )
    assert "evenly" in text
    assert "does not repeat" in text
    assert "50 Hz" in text


def test_noise_alone_lies_nowhere():
    recording, parts = session()
    entries = localise(white(parts), parts, WHITE, recording)
    assert all(entry["share"] == 0 for entry in entries)
    assert "No part of the residual exceeds the noise" in describe_localisation(entries, None)
    unknown = describe_localisation(entries, None, repeats=False)
    assert unknown.startswith("Nothing repeats, so the noise is not known")


def test_a_run_that_does_not_repeat_has_directions_and_regions():
    t = np.arange(900) / 1000.0
    u = np.interp(t, [0.0, 0.3, 0.5, 0.899], [1.0, 4.0, 2.0, 3.0])
    drive = Drive(t, u)
    recording = Recording.of([drive], [np.zeros(900)])
    parts = period_blocks(recording, to_batch(recording, lead=True))
    falling = (t > 0.3) & (t < 0.5)
    e = [np.random.default_rng(0).standard_normal((1, 900)) * 0.1 + 5.0 * falling[None, :]]
    entries = localise(e, parts, Spectrum.of_white(0.01, measured=False), recording)
    down = sum(x["share"] for x in entries if x["direction"] == "down")
    assert down > 0.98
    assert entries[0]["excitation_hz"] is None
    assert "falling" in describe_localisation(entries, None)
