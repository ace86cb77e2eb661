"""A signature shows a known error over the axis on which it is regular, without it and with it."""

import dataclasses
import json

import numpy as np
import pytest
from silent import session
from worlds import TRUTHS

from fitting.diagnosis.which.signature._signature import describe_signatures
from rapi_jax.effects import (
    ALL,
    Creep,
    Delay,
    Drift,
    Etalon,
    GainDrift,
    Pickup,
    Quantisation,
    RateLaw,
)

NOISE = 0.01


@pytest.fixture
def recorded():
    """A silent session, and its noise."""
    recording, parts = session()
    rng = np.random.default_rng(0)
    noise = [NOISE * rng.standard_normal(b.left.shape) for b in parts]
    return recording, parts, noise


def with_response(noise, parts, gain=10.0):
    """The parts with readings such that the model's response is the drive, `gain` GHz a volt."""
    return [
        dataclasses.replace(b, data=gain * b.drive - e) for b, e in zip(parts, noise, strict=True)
    ]


def signature(effect, recorded, lacking, **more):
    """The signature of `effect` where the model lacks `lacking` (one array a run)."""
    recording, parts, noise = recorded
    without = [e - s for e, s in zip(noise, lacking, strict=True)]
    (found,) = describe_signatures((effect,), [without], noise, parts, recording, **more)
    json.dumps(found, allow_nan=False)
    assert found["effect"] == effect.name and found["axis"] == type(effect).signature_axis
    return found


def column(row, key):
    return np.array([np.nan if v is None else v for v in row[key]])


def check(found, expected, tolerance=5.0):
    """Each mean is within its error, and 6 % of the largest: a bin bends what it averages.

    The origin of the response is free, so the truth is taken about its mean.
    """
    truths = [expected(column(r, "x"), r["row"]) for r in found["rows"]]
    readings = [column(r, "readings") for r in found["rows"]]
    origin = np.average(np.concatenate(truths), weights=np.concatenate(readings))
    origin *= found["axis"] != "gain"
    size = max(np.abs(truth).max() for truth in truths)
    for row, whole in zip(found["rows"], truths, strict=True):
        truth, stderr = whole - origin, column(row, "stderr")
        known = np.isfinite(stderr)
        off = column(row, "without") - truth
        assert (np.abs(off) < tolerance * stderr + 0.06 * size)[known].all(), row["row"]
        assert (np.abs(column(row, "with")) < tolerance * stderr)[known].all(), row["row"]
    assert found["rms_without"] > 5.0 * found["rms_with"]


def test_what_repeats_in_time_is_folded(recorded):
    effect = Pickup(amplitude=0.2, hertz=50.0, phase=0.4)
    wave = [0.2 * np.sin(2 * np.pi * 50.0 * b.time) for b in recorded[1]]
    found = signature(effect, recorded, wave)
    assert found["period"] == pytest.approx(0.02) and found["unit"] == "s"
    check(found, lambda x, row: 0.2 * np.sin(2 * np.pi * 50.0 * x))


def test_what_repeats_with_the_drive_is_folded(recorded):
    step = 0.05
    steps = [0.2 * (np.mod(b.drive, step) / step - 0.5) for b in recorded[1]]
    found = signature(Quantisation(step=step), recorded, steps)
    assert found["period"] == pytest.approx(step) and found["unit"] == "V"
    assert [row["row"] for row in found["rows"]] == ["up", "down"]
    check(found, lambda x, row: 0.2 * (x / step - 0.5))


def test_a_long_period_is_not_folded(recorded):
    wave = [0.2 * np.sin(b.drive) for b in recorded[1]]
    found = signature(Quantisation(step=1.5), recorded, wave)  # 2 V of drive hold one
    assert found["period"] is None
    assert min(found["rows"][0]["x"]) == pytest.approx(2.0, abs=0.05)
    check(found, lambda x, row: 0.2 * np.sin(x))


def test_a_lag_shows_over_the_time_since_the_turn_at_each_rate(recorded):
    recording, parts, _ = recorded
    lag = []
    for run, b in zip(recording.runs, parts, strict=True):
        since = np.mod(b.phase, 0.5) / run.drive.excitation_hz
        lag.append(
            np.broadcast_to(np.where(b.phase < 0.5, 1, -1) * np.exp(-since / 5e-3), b.time.shape)
        )
    found = signature(Delay(tau=1e-4), recorded, lag)
    rates = [f"{hz:.4g} Hz" for hz in (10.0, 20.0, 30.0, 40.0)]
    assert {r["row"] for r in found["rows"]} == {
        f"{turn} turn, {rate}" for turn in ("low", "high") for rate in rates
    }
    sign = {"low": 1.0, "high": -1.0}
    check(found, lambda x, row: sign[row.split()[0]] * np.exp(-x / 5e-3))


def test_a_drift_shows_over_the_session_a_mean_a_period(recorded):
    drift = [0.1 * b.time for b in recorded[1]]
    found = signature(Drift(amplitude=0.3), recorded, drift)
    (row,) = found["rows"]
    assert len(row["x"]) == 20 and row["x"] == sorted(row["x"])
    check(found, lambda x, row: 0.1 * x)
    assert signature(Drift(amplitude=0.3), recorded, drift, own_origin=True)["rms_without"] < (
        0.5 * found["rms_without"]
    )


def test_the_origin_of_a_fit_is_no_residual(recorded):
    ripple = [0.2 * np.sin(2 * np.pi * 50.0 * b.time) for b in recorded[1]]
    effect = Pickup(amplitude=0.2, hertz=50.0)
    about, off = (signature(effect, recorded, [w + c for w in ripple]) for c in (0.0, 0.6))
    (one,), (other,) = about["rows"], off["rows"]
    assert column(other, "without") == pytest.approx(column(one, "without"), abs=1e-12)
    assert off["rms_without"] == pytest.approx(0.2 / np.sqrt(2), rel=0.02)


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_no_mean_residual_exceeds_the_residual(recorded, cls):
    """Means of few readings, as of those just behind a turn, count for no more than these."""
    recording, parts, noise = recorded
    if cls.signature_axis == "gain":
        pytest.skip("its means are slopes")
    early = [0.5 * np.exp(-np.mod(b.phase, 0.5) / 0.02) + 0.0 * b.time for b in parts]
    found = signature(TRUTHS[cls.name], recorded, early)
    errors = np.concatenate([(e - s).ravel() for e, s in zip(noise, early, strict=True)])
    assert found["rms_without"] <= np.std(errors) and found["rms_with"] <= NOISE * 1.05


def test_a_gain_that_drifts_shows_as_the_slope_by_the_response(recorded):
    recording, parts, noise = recorded
    parts = with_response(noise, parts)
    lacking = [0.01 * b.time * 10.0 * b.drive for b in parts]
    found = signature(GainDrift(rate=0.01), (recording, parts, noise), lacking)
    check(found, lambda x, row: 0.01 * x)


def test_a_law_shows_over_the_phase_of_each_run(recorded):
    bow = [np.broadcast_to(0.2 * np.sin(2 * np.pi * b.phase), b.time.shape) for b in recorded[1]]
    found = signature(RateLaw(exponent=0.5), recorded, bow)
    assert [r["row"] for r in found["rows"]] == [run.name for run in recorded[0].runs]
    check(found, lambda x, row: 0.2 * np.sin(2 * np.pi * x))


def test_an_etalon_shows_over_the_response_of_the_model(recorded):
    recording, parts, noise = recorded
    parts = with_response(noise, parts)
    ripple = [0.2 * np.cos(2 * np.pi * 10.0 * b.drive / 3.0) for b in parts]
    effect = Etalon(amplitude=0.2, spacing=3.0, phase=0.0)
    found = signature(effect, (recording, parts, noise), ripple)
    assert found["period"] == 3.0 and found["unit"] == recording.response_unit
    check(found, lambda x, row: 0.2 * np.cos(2 * np.pi * x / 3.0))


def test_effects_that_show_alike_have_one_signature_and_masked_readings_count_for_nothing(recorded):
    recording, parts, noise = recorded
    masked = []
    for b in parts:
        use, data = b.use.copy(), b.data.copy()
        use[:, 3::7] = 0.0
        data[:, 3::7] = np.nan
        masked.append(dataclasses.replace(b, use=use, data=data))
    errors = [np.where(b.use > 0, e, 1e6) for e, b in zip(noise, masked, strict=True)]
    effects = (Delay(tau=1e-4), Creep(gain=0.01), Drift(amplitude=0.1))
    found = describe_signatures(effects, [errors] * len(effects), errors, masked, recording)
    assert [f["effect"] for f in found] == ["delay", "drift"]
    assert all(f["rms_without"] < NOISE for f in found)


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_every_effect_has_a_signature_of_a_session(recorded, cls):
    recording, parts, noise = recorded
    (found,) = describe_signatures((TRUTHS[cls.name],), [noise], noise, parts, recording)
    assert found["rows"] and all(len(r["x"]) == len(r["with"]) > 3 for r in found["rows"])
    assert found["rms_without"] == found["rms_with"] > 0.0
