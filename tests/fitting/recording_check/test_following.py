"""Columns that have nothing to do with each other are told; weak and drifting responses are not."""

import numpy as np
import pytest

from fitting import check_recording
from fitting.recording_check._following import find_unrelated, following_p
from rapi_jax import Drive, Recording, Run, predict, triangle
from rapi_jax.examples import paper_device


def responses(periods: int, rates=(10.0, 20.0)):
    drives = triangle(rates, amplitude=4.0, bias=3.0, samples=300 * periods, periods=periods)
    return [(drive, np.asarray(predict(paper_device(), drive))) for drive in drives]


def walk(rng: np.random.Generator, size: int) -> np.ndarray:
    total = np.cumsum(rng.standard_normal(size))
    return total / np.std(total)


NOISE = {"white": lambda rng, size: rng.standard_normal(size), "walk": walk}


def alarms(recordings) -> int:
    return sum(bool(find_unrelated(one)) for one in recordings)


@pytest.mark.parametrize("kind", NOISE)
@pytest.mark.parametrize("periods", [2, 3, 6])
def test_a_response_below_noise_of_a_tenth_of_it_and_drift_is_no_other_column(kind, periods):
    rng, clean = np.random.default_rng(periods), responses(periods)

    def one() -> Recording:
        runs = []
        for drive, y in clean:
            drift = 0.3 * rng.standard_normal() * np.linspace(0.0, 1.0, y.size) ** 2
            noise = 0.1 * NOISE[kind](rng, y.size)
            runs.append(Run(drive, y + np.ptp(y) * (drift + noise), f"run{len(runs):02d}"))
        return Recording(tuple(runs))

    assert alarms(one() for _ in range(40)) == 0


@pytest.mark.parametrize("kind", [*NOISE, "slow"])
@pytest.mark.parametrize("periods", [2, 3, 6])
def test_a_column_that_does_not_follow_the_drive_is_told(kind, periods):
    rng, clean = np.random.default_rng(periods), responses(periods)

    def reading(time: np.ndarray) -> np.ndarray:
        if kind == "slow":  # a temperature, deg C
            slow = 0.2 * np.sin(time + 10.0 * rng.random())
            return 24.0 + slow + 0.01 * rng.standard_normal(time.size)
        return NOISE[kind](rng, time.size)

    def one() -> Recording:
        return Recording(tuple(Run(d, reading(d.time), f"r{k}") for k, (d, _) in enumerate(clean)))

    assert alarms(one() for _ in range(40)) >= 36


def test_the_check_says_so_before_a_fit():
    rng = np.random.default_rng(0)
    (drive, _), (other, _) = responses(4)
    found = check_recording(
        Recording.of([drive, other], [rng.standard_normal(one.size) for one in (drive, other)])
    )
    assert not found.sound
    (fault,) = found.faults
    assert fault.kind == "unrelated columns" and "does not follow the drive" in fault.message
    assert "another column" in fault.message


def test_a_drive_that_does_not_repeat():
    rng = np.random.default_rng(0)
    time = np.arange(4000) / 1e3
    swing = np.sin(9.0 * time) * np.linspace(0.2, 1.0, 4000)
    good = Run(Drive(time, swing), 5.0 * swing + rng.standard_normal(4000), "run00")
    folded = Run(Drive(time, swing), swing**2 + 0.01 * rng.standard_normal(4000), "run00")
    wrong = Run(Drive(time, 24.0 + 0.01 * rng.standard_normal(4000)), 5.0 * swing, "run00")
    assert alarms(Recording((run,)) for run in (good, folded, wrong)) == 1
    assert (p := following_p(wrong)) is not None and p > 0.01


def test_what_cannot_be_told_is_not_told():
    (drive, y) = responses(1)[0]
    noise = np.random.default_rng(0).standard_normal(y.size)
    assert find_unrelated(Recording((Run(drive, noise),))) == []  # one period
    (drive, y) = responses(3)[0]
    assert find_unrelated(Recording((Run(drive, np.full(y.size, 2.0)),))) == []  # it rests
