"""Drives as a model sees them: corners between samples, one period of nodes, lead-in, gaps."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rapi_jax import DataError, Drive, Recording, predict
from rapi_jax._ecdl import ECDL, respond
from rapi_jax.effects import AbstractOpticalEffect
from rapi_jax.examples import paper_device
from rapi_jax.sampling._batch import batch, on_device, to_batch
from rapi_jax.sampling._corners import corners
from rapi_jax.sampling._sampling_grid import row_of

TIME = np.arange(400) * 1e-4


class Idle(AbstractOpticalEffect):
    """An effect that does nothing, but for asking for a lead-in."""

    name: ClassVar[str] = "idle"

    def __call__(self, t, nu):
        del t
        return nu

    @classmethod
    def initial_guesses(cls, evidence):
        return []


def zigzag(time, knots, heights):
    return np.interp(time, knots, heights)


def wave(cycles):
    """From -1 at whole cycles to 1 between."""
    return 1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles, 1.0))


def scan(samples, per_period, *, start=0.0, hz=20.0, start_s=0.0, amplitude=1.5, bias=3.0):
    """A triangle from phase `start`; `per_period` samples a period, whole or not."""
    cycles = np.arange(samples) / per_period + start
    return Drive(
        np.arange(samples) / per_period / hz, bias + amplitude * wave(cycles), hz, "triangle",
        start_s,
    )  # fmt: skip


# --- corners


@settings(max_examples=60)
@given(
    st.lists(st.floats(8.0, 60.0), min_size=3, max_size=8),
    st.lists(st.floats(0.3, 5.0), min_size=9, max_size=9),
    st.floats(-3.0, 3.0),
)
def test_corners_of_a_zigzag_are_exact(lengths, rises, start):
    """Branches of any length (in samples) and slope, so corners anywhere between samples."""
    knots = np.cumsum([0.0, *lengths])
    heights = start + np.cumsum([0.0] + [r * (-1) ** k for k, r in enumerate(rises)])
    heights = heights[: knots.size]
    time = np.arange(int(knots[-1]) + 1) * 1.0
    at, value = corners(zigzag(time, knots, heights))
    inner, tops = knots[1:-1], heights[1:-1]
    off = np.abs(inner - np.round(inner))
    seen = (off > 1e-5) & (inner < time[-1] - 3)
    surely = np.isin(np.round(at, 6), np.round(inner[seen], 6)).sum() == seen.sum()
    assert surely and seen.sum() <= at.size <= inner.size
    for one, height in zip(at, value, strict=True):
        k = int(np.argmin(np.abs(inner - one)))
        assert one == pytest.approx(inner[k], abs=1e-6)
        assert height == pytest.approx(tops[k], abs=1e-6 * np.ptp(heights))


@pytest.mark.parametrize(
    "value",
    [
        np.random.default_rng(0).normal(size=400),
        np.sin(2 * np.pi * 77.3 * TIME),
        np.floor(TIME / 0.013),
        np.where(TIME > 0.01234, 1.0, 0.0) - np.where(TIME > 0.03, 2.0, 0.0),
        np.ones(400),
        4.0 * TIME,
        wave(np.arange(400) / 100.0),  # its corners are samples
        wave(np.arange(400) / 73.3) + 0.01 * np.random.default_rng(1).normal(size=400),
    ],
    ids=["noise", "sine", "stairs", "steps", "constant", "line", "on samples", "measured"],
)
def test_nothing_is_added_where_no_sharp_corner_is_known(value):
    assert corners(value)[0].size == 0


@pytest.mark.parametrize("behind", [2, 3, 5, 40])
@pytest.mark.parametrize("way", [1, -1])
def test_a_corner_near_an_end_of_the_record_is_exact(behind, way):
    """Two samples tell a line; with one the corner cannot be told, and none is made up."""
    step, corner = np.arange(60.0), 59.0 - behind + 0.4
    value = np.where(step < corner, 0.1 * step, 0.1 * corner - 0.3 * (step - corner))[::way]
    at, height = corners(value)
    np.testing.assert_allclose(at, [corner if way > 0 else 59.0 - corner], atol=1e-9)
    np.testing.assert_allclose(height, [0.1 * corner], atol=1e-9)


@pytest.mark.parametrize("behind", range(1, 7))
def test_a_smooth_turn_near_an_end_of_the_record_is_no_corner(behind):
    step = np.arange(60.0)
    assert corners(np.cos(2.0 * np.pi * (step - 59.4 + behind) / 40.0))[0].size == 0


def test_a_corner_midway_between_two_samples_is_one_corner():
    at, value = corners(np.tile(wave(np.arange(79) / 79), 3))
    np.testing.assert_allclose(at, 39.5 + 79 * np.arange(3), rtol=0, atol=1e-8)
    np.testing.assert_allclose(value, 1.0, rtol=0, atol=1e-9)


# --- rows of drives that repeat


@settings(max_examples=40)
@given(st.integers(60, 130), st.floats(0.0, 0.999), st.integers(150, 400), st.booleans())
def test_a_row_is_the_drive_at_every_phase(per_period, start, samples, lead):
    """Whole samples a period, any phase, broken periods at the end: nodes are one period."""
    drive = scan(samples, per_period, start=start, start_s=1.5)
    row = row_of(drive, 0.0, lead=lead)
    inside = row.sample >= 0
    assert np.array_equal(row.sample[inside], np.arange(samples))
    u = row.node_u[row.place]
    np.testing.assert_allclose(row.time[inside], drive.session_time, rtol=0, atol=1e-12)
    np.testing.assert_allclose(u[inside], drive.value, rtol=0, atol=1e-12)
    # At every instant of the row, corners and lead-in included, it is the triangle itself.
    phase = (row.time - 1.5) * drive.rate + start
    np.testing.assert_allclose(u, 3.0 + 1.5 * wave(phase), rtol=0, atol=1e-6)
    assert (np.diff(row.time) > 0).all() and (np.diff(row.node_time) > 0).all()
    # Nodes: one period from the minimum, before it another as lead-in.
    one = row.node_u.size // (2 if lead else 1)
    # Corners, and with effects, which may lag, finer places and what follows closely behind turns.
    finer = per_period * int(np.ceil(300 / per_period))
    assert per_period <= one <= (finer + 48 if lead else per_period) + 2
    assert not lead or one >= 300
    assert row.node_u[0] == row.node_u.min()
    assert np.ptp(row.node_time[-one:]) < 1 / drive.rate
    assert row.node_lead == (one if lead else 0)
    assert row.period_s == (pytest.approx(1 / drive.rate) if lead else 0.0)
    if lead:
        assert np.array_equal(row.node_u[:one], row.node_u[one:])
        begin = row.time[row.lead]
        assert begin == pytest.approx(1.5, abs=1e-12)
        assert row.time[0] == pytest.approx(1.5 - 1 / drive.rate, abs=1.01 * drive.step_s)
        since = np.mod(phase[None, :] - np.array([[0.0], [0.5]]), 1.0) / drive.rate / drive.step_s
        assert (np.sort(since, axis=1)[:, 1] < 1.0 / 16).all()
        assert (row.sample[: row.lead] == -1).all() and row.sample[row.lead] == 0
    else:
        assert row.lead == 0 and row.time[0] >= 1.5 - 1e-9


@pytest.mark.parametrize("lead", [False, True])
@pytest.mark.parametrize("per_period", [101, 100.37])
def test_extremes_are_those_of_the_triangle(per_period, lead):
    """No sample lies on a corner, yet the row reaches both ends of the range."""
    drive = scan(500, per_period, start=0.1234)
    u = row_of(drive, 0.0, lead=lead).node_u
    assert u.min() == pytest.approx(1.5, abs=1e-6) and u.max() == pytest.approx(4.5, abs=1e-6)
    assert drive.value.min() > 1.5005


@pytest.mark.parametrize("lead", [False, True])
def test_periods_of_broken_samples_and_noise_keep_the_whole_run(lead):
    """Then the nodes are the run itself, after what brings the operator to its periodic state."""
    noisy = scan(400, 100, start=0.3)
    noise = 1e-3 * np.random.default_rng(2).normal(size=400)
    for drive in (
        scan(400, 100.37, start=0.3),
        dataclasses.replace(noisy, value=noisy.value + noise),
    ):
        row = row_of(drive, 0.0, lead=lead)
        inside = row.sample >= 0
        assert np.array_equal(row.node_u[row.place][inside], drive.value)
        assert np.array_equal(row.sample[inside], np.arange(400))
        assert row.node_time.size >= 400 + row.node_lead
        assert row.period_s == (100 * drive.step_s if lead else 0.0)
        assert (row.place == np.arange(row.time.size) + row.node_lead).all()
        if lead:
            assert row.sample[row.lead] == 0
            assert row.time[row.lead] == pytest.approx(0.0, abs=1e-12)


def test_a_drive_that_does_not_repeat_has_nothing_before_it():
    drive = Drive(TIME, np.interp(TIME, [0.0, 0.01003, 0.04], [1.0, 3.0, 2.0]), 20.0, "other")
    for lead in (False, True):
        row = row_of(drive, 0.0, lead=lead)
        assert (row.lead, row.node_lead, row.period_s) == (0, 0, 0.0)
        assert row.sample[0] == 0 and (row.sample == -1).sum() == 1
        corner = int(np.flatnonzero(row.sample == -1)[0])
        assert row.time[corner] == pytest.approx(0.01003, abs=1e-10)
        assert row.node_u[corner] == pytest.approx(3.0, abs=1e-7)


# --- lag


@pytest.mark.parametrize("lag_steps", [0.0, 0.25, 3.0, 7.6, 49.0])
@pytest.mark.parametrize("start", [0.0, 0.123])
def test_a_delayed_reading_sees_the_drive_of_before(lag_steps, start):
    drive = scan(300, 100, start=start)
    lag = lag_steps * drive.step_s
    row = row_of(drive, lag, lead=False)
    inside = row.sample >= 0
    want = 3.0 + 1.5 * wave((row.time - lag) * drive.rate + start)
    np.testing.assert_allclose(row.node_u[row.place], want, rtol=0, atol=1e-6)
    assert np.array_equal(row.sample[inside], np.arange(300))


def test_a_lag_that_is_not_short_is_refused():
    drive = Drive(TIME, np.sin(100 * TIME))
    with pytest.raises(DataError, match="`response_lag_s`"):
        row_of(drive, 0.03, lead=False)


# --- what a model answers


@pytest.mark.parametrize("start", [0.0, 0.1234, 0.77])
@pytest.mark.parametrize("per_period", [97, 97.4])
@pytest.mark.parametrize("idle", [False, True])
def test_coarse_samples_give_the_response_of_a_fine_clock(per_period, start, idle):
    """The operator sees the same turning points, so at the same instants it answers the same."""
    device = paper_device()
    device = ECDL(device.operator, (Idle(),) if idle else ())
    samples = 400
    coarse = scan(samples, per_period, start=start)
    fine = scan(64 * samples, 64 * per_period, start=start)
    # u_pp is taken from the samples (Eq. 11): the coarse clock misses a little of it.
    answers = []
    for drive in (coarse, fine):
        row = row_of(drive, 0.0, lead=idle)
        fields = batch([drive], [row])
        fields |= {"u_pp": np.array([3.0]), "u_min": np.array([1.5]), "bias": np.array([3.0])}
        full = np.asarray(respond(device, on_device(fields)))[0, : row.sample.size]
        answers.append(full[row.sample >= 0])
    # Corners are known to 1e-7 of the range, 100 GHz.
    first = int(np.ceil(per_period))
    off = np.abs(answers[0] - answers[1][::64])
    assert off[first:].max() <= 1e-5
    assert off.max() <= 1e-5 if isinstance(per_period, int) else off.max() <= 1e-2


def test_predict_gives_one_answer_for_each_sample():
    drive = scan(250, 97, start=0.4)
    answer = np.asarray(predict(paper_device(), drive))
    assert answer.shape == (250,)
    np.testing.assert_allclose(answer[97:], answer[:-97], rtol=0, atol=1e-12)


# --- batches


def test_gaps_between_runs():
    """From the last sample to the next first; none where clocks overlap."""
    drives = [
        scan(200, 100, start_s=0.0),  # until 0.0995
        scan(200, 100, start_s=0.1),
        scan(400, 100, hz=40.0, start_s=0.4),
        scan(200, 100, start_s=0.0),
        scan(200, 100, start_s=0.05),
    ]
    for lead in (False, True):
        rows = [row_of(d, 0.0, lead=lead) for d in drives]
        gaps = batch(drives, rows)["gap_s"]
        np.testing.assert_allclose(gaps[:3], [np.inf, 5e-4, 0.4 - 0.1995], atol=1e-9)
        assert np.isinf(gaps[3:]).all()


def test_rows_of_different_lengths_are_padded_with_their_last():
    drives = [scan(700, 97, start=0.2), scan(100, 50, start=0.7, start_s=3.0)]
    rows = [row_of(d, 0.0, lead=True) for d in drives]
    fields = batch(drives, rows)
    assert fields["time"].shape == fields["place"].shape
    assert fields["time"].shape[1] % 256 == 0 and fields["node_u"].shape[1] % 256 == 0
    for k, row in enumerate(rows):
        size, nodes = row.time.size, row.node_u.size
        assert np.array_equal(fields["time"][k, :size], row.time)
        assert (fields["time"][k, size:] == row.time[-1]).all()
        assert (fields["place"][k, size:] == row.place[-1]).all()
        assert (fields["node_u"][k, nodes:] == row.node_u[-1]).all()
        assert fields["lead"][k] == row.lead and fields["node_lead"][k] == row.node_lead
    # The triangle's own swing, with the turns that no sample of the first meets.
    assert drives[0].u_pp < 2.98
    assert fields["u_pp"] == pytest.approx([3.0, 3.0])
    assert fields["u_min"] == pytest.approx([1.5, 1.5])
    assert fields["bias"] == pytest.approx([3.0, 3.0])


def test_a_constant_drive_and_the_shortest_one():
    still = Drive(TIME, np.full(400, 2.0), 20.0, "triangle")
    short = Drive(np.arange(3) * 1e-3, np.array([1.0, 2.0, 1.5]))
    for drive in (still, short):
        for lead in (False, True):
            row = row_of(drive, 0.0, lead=lead)
            inside = row.sample >= 0
            assert np.array_equal(row.node_u[row.place][inside], drive.value)
    recording = Recording.of([still, short], [still.value, short.value])
    rows = to_batch(recording, lead=True)
    assert np.isfinite(rows.u).all() and jnp.isfinite(rows.device().node_u).all()
