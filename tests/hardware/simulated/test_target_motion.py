"""Motions of a target: against what they are by definition, and the same however they are asked."""

import numpy as np
import pytest

from hardware.simulated import (
    ConstantVelocity,
    RandomVibration,
    SteppedStage,
    Target,
    ThermalDrift,
    Vibration,
)

MOTIONS = {
    "velocity": ConstantVelocity(0.05, 1.0, 1.5),
    "vibration": Vibration(20e-6, 1000.0, 0.3),
    "random": RandomVibration(1e-6, 5.0, 2000.0, seed=3),
    "drift": ThermalDrift(5e-6, seed=2),
    "stage": SteppedStage(dwell_s=0.4, move_s=0.1, nodes=4),
}


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize("sample_hz", [30e6, 1e6, 5e3])
@pytest.mark.parametrize("start_s", [0.3999, 0.99985, 1.2, 29.9999])
def test_the_distance_at_samples_is_right_to_a_picometre(motion, sample_hz, start_s):
    """1 pm is 2e-5 rad of phase at 780 nm, between nodes and about kinks."""
    target = Target(0.7) + motion
    count = 9_000
    found = target.displacement(start_s, sample_hz, count)
    expected = motion.at(start_s + np.arange(count) / sample_hz)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_motions_add_up():
    several = Target(0.5) + MOTIONS["velocity"] + MOTIONS["vibration"] + MOTIONS["drift"]
    time = np.array([0.2, 1.1, 40.0])
    parts = sum(MOTIONS[name].at(time) for name in ("velocity", "vibration", "drift"))
    np.testing.assert_allclose(several.distance(time), 0.5 + parts, rtol=0, atol=1e-15)
    assert Target(0.5).displacement(0.0, 1e6, 10) is None
    assert float(several.distance(1.1)) == several.distance(time)[1]


def test_a_velocity_begins_and_ends():
    found = ConstantVelocity(0.05, 1.0, 3.0).at(np.array([0.0, 1.0, 2.0, 3.0, 9.0]))
    np.testing.assert_allclose(found, [0.0, 0.0, 0.05, 0.1, 0.1])


def test_random_vibration_has_its_rms_and_its_band():
    time = np.arange(0.0, 2.0, 1e-3)
    power = np.zeros(time.size // 2 + 1)
    for seed in range(40):
        value = RandomVibration(1e-6, 50.0, 200.0, seed=seed).at(time)
        power += np.abs(np.fft.rfft(value * np.hanning(time.size))) ** 2
    hz = np.fft.rfftfreq(time.size, 1e-3)
    inside = (hz > 48) & (hz < 202)
    assert power[inside].sum() > 0.9999 * power.sum()
    halves = power[(hz > 50) & (hz < 125)].sum(), power[(hz > 125) & (hz < 200)].sum()
    assert halves[0] == pytest.approx(halves[1], rel=0.1)
    values = [RandomVibration(1e-6, 50.0, 200.0, seed=k).at(np.array([7.7]))[0] for k in range(400)]
    assert np.std(values) == pytest.approx(1e-6, rel=0.12)
    with pytest.raises(ValueError, match="band"):
        RandomVibration(1e-6, 200.0, 50.0)


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_a_motion_is_a_function_of_session_time_alone(motion):
    time = np.linspace(0.0, 100.0, 5000)
    whole = motion.at(time)
    parts = [motion.at(part) for part in np.array_split(time[::-1], 7)]
    np.testing.assert_allclose(np.concatenate(parts)[::-1], whole, rtol=0, atol=1e-15)


def test_a_drift_walks_as_the_square_root_of_time():
    ends = np.array([ThermalDrift(1e-6, seed).at(np.array([900.0, 3600.0])) for seed in range(600)])
    np.testing.assert_allclose(ends.std(axis=0), [0.5e-6, 1e-6], rtol=0.1)
    assert ThermalDrift(1e-6).at(np.array([-5.0, 0.0])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("distribution", "rms"), [("uniform", 0.12e-6 / 3**0.5), ("normal", 0.12e-6)]
)
def test_a_stage_rests_at_its_nodes(distribution, rms):
    stage = SteppedStage(nodes=800, distribution=distribution, seed=5)
    errors = stage.positions_m - 0.02 * np.arange(800)
    assert errors.std() == pytest.approx(rms, rel=0.1)
    assert abs(errors.mean()) < 4 * rms / 800**0.5
    if distribution == "uniform":
        assert np.abs(errors).max() <= 0.12e-6
    np.testing.assert_array_equal(stage.at(np.array([6.0, 8.0, 10.9])), stage.positions_m[1])
    assert stage.at(np.array([1e9]))[0] == stage.positions_m[-1]
    middle = stage.at(np.array([5.5]))[0]
    assert middle == pytest.approx(stage.positions_m[:2].mean(), abs=1e-12)
    longer = SteppedStage(nodes=3, distribution=distribution, seed=5)
    np.testing.assert_array_equal(longer.positions_m, stage.positions_m[:3])


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="distance_m"):
        Target(-0.1)
    with pytest.raises(ValueError, match="stage"):
        SteppedStage(nodes=0)
