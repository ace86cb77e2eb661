"""Single sweeps and holds: what is said of them, and that whole recordings are left alone."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lsim

from fitting.identification.data_checks.holds._sweeps import (
    count_branches,
    describe_creep,
    find_creep,
    find_holds,
    single_sweep,
)
from rapi_jax import ECDL, Drive, Recording, Run, predict, triangle
from rapi_jax.effects import Creep
from rapi_jax.examples import paper_device

SIZE, STEP = 2000, 1e-3
TIME = np.arange(SIZE) * STEP


def sweep(turns: float, **fields) -> Drive:
    """`turns` periods of a triangle from its minimum, without a rate."""
    return Drive(TIME, 1.0 - np.abs(2.0 * np.mod(turns * TIME / TIME[-1], 1.0) - 1.0), **fields)


def recording(*drives: Drive) -> Recording:
    return Recording.of(drives, [d.value for d in drives])


@pytest.mark.parametrize(
    ("turns", "branches", "words"),
    [
        (0.5, (1, 0), "only rises"),
        (0.98, (1, 1), "rises once and falls once"),
        (1.4, (2, 1), "rises twice and falls once"),
        (1.9, (2, 2), None),
        (6.0, (6, 6), None),
    ],
)
def test_branches_are_counted_and_a_single_sweep_is_named(turns, branches, words):
    drive = sweep(turns)
    assert count_branches(drive) == branches
    said = single_sweep(recording(drive))
    assert (said is None) == (words is None)
    if words:
        assert words in str(said) and "record three periods" in str(said)


def test_noise_of_the_drive_makes_no_branches():
    noisy = sweep(0.98).value + 0.01 * np.random.default_rng(0).standard_normal(SIZE)
    assert count_branches(Drive(TIME, noisy)) == (1, 1)


def test_two_sweeps_make_a_pair_and_a_repeating_run_is_no_sweep():
    assert single_sweep(recording(sweep(0.98), sweep(0.98))) is None
    assert "only rises" in str(single_sweep(recording(sweep(0.5), sweep(0.5))))
    drives = triangle(10.0, amplitude=1.0, bias=1.0, samples=300, periods=1)
    assert single_sweep(recording(*drives)) is None


def test_a_drive_that_never_moves_is_no_sweep():
    said = single_sweep(recording(Drive(TIME, np.full(TIME.size, -90.0))))
    assert said is not None and said.startswith("no drive: ") and "falls" not in said


def stepped(rest: float = 1.0) -> Drive:
    """Up, a rest at the top and down again."""
    u = np.interp(TIME, [0.0, 0.5, 0.5 + rest, TIME[-1] + STEP], [0.0, 3.0, 3.0, 0.0])
    return Drive(TIME, u)


def test_a_rest_is_found_to_the_sample_and_slow_waves_do_not_rest():
    ((first, last),) = find_holds(stepped())
    assert first == pytest.approx(500, abs=3) and last == pytest.approx(1500, abs=3)
    assert find_holds(stepped(rest=0.05)) == []
    for turns in (0.5, 1, 3, 20):
        wave = np.sin(2 * np.pi * turns * TIME / TIME[-1])
        assert find_holds(Drive(TIME, wave)) == [], turns
    assert find_holds(Drive(TIME, np.ones(SIZE))) == []


def test_creep_is_named_from_a_single_hold():
    """What it moves by between its first and last ten samples: 5 errors of their means."""
    device, drive = paper_device(), stepped()
    rng = np.random.default_rng(0)
    still = np.asarray(predict(device, drive))
    creeping = np.asarray(predict(ECDL(device.operator, (Creep(gain=jnp.asarray(0.02)),)), drive))
    noise = 0.02 * rng.standard_normal(SIZE)
    assert find_creep(Run(drive, still + noise)) == []
    (found,) = find_creep(Run(drive, creeping + noise))
    moved = creeping[found.last] - creeping[found.first + 15]
    assert found.change == pytest.approx(moved, abs=5 * 0.02 * np.sqrt(2 / 10))
    (said,) = describe_creep(Recording((Run(drive, creeping + noise),)))
    assert said.startswith("creep: while the drive rests in run 'run00'")
    assert "rapi diagnose" in said and "GHz a decade" in said


def second_order(hz: float, damping: float, drive: Drive) -> np.ndarray:
    """The response of `x'' + 2 damping w x' + w^2 x = w^2 u`, w = 2 pi `hz`, to `drive`."""
    w = 2.0 * np.pi * hz
    return lsim(([w**2], [1.0, 2.0 * damping * w, w**2]), drive.value, drive.time)[1]


@pytest.mark.parametrize(
    ("hz", "damping", "law"),
    [(0.6, 0.25, "ringing at 0.58"), (0.6, 0.5, "ringing at 0.52"), (1.0, 1.0, ""), (4.0, 3.0, "")],
)
def test_ringing_and_lags_in_a_hold_are_no_creep(hz, damping, law):
    """A resonance swings at `hz sqrt(1 - damping^2)`."""
    drive = Drive(TIME, np.interp(TIME, [0.5, 0.505, 1.5, 1.505], [0.0, 3.0, 3.0, 0.0]))
    noise = 1e-3 * np.random.default_rng(1).standard_normal(SIZE)
    run = Run(drive, second_order(hz, damping, drive) + noise)
    (said,) = describe_creep(Recording((run,), response_unit="um"))
    assert said.startswith("settling: while the drive rests in run 'run00'") and "not creep" in said
    assert (law or "settling within a time constant of 0.") in said


@pytest.mark.parametrize("ramp", [0.01, 0.5])
@pytest.mark.parametrize("gain", [0.005, 0.05])
def test_creep_that_began_while_the_drive_moved_is_no_settling(ramp, gain):
    drive = Drive(TIME, np.interp(TIME, [0.0, ramp, ramp + 1.0, 2.0], [0.0, 3.0, 3.0, 0.0]))
    device = ECDL(paper_device().operator, (Creep(gain=jnp.asarray(gain)),))
    noise = 1e-3 * np.random.default_rng(2).standard_normal(SIZE)
    (said,) = describe_creep(Recording((Run(drive, np.asarray(predict(device, drive)) + noise),)))
    assert said.startswith("creep: while the drive rests in run 'run00'")


def test_measured_recordings_do_not_rest(shared_data):
    from rapi_jax.io import read_recording

    for name in ("picma_1hz", "picma_small_loops", "servo_lag"):
        assert describe_creep(read_recording(shared_data / name)) == []
        assert single_sweep(read_recording(shared_data / name)) is None
