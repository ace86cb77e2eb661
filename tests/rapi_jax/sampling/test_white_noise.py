"""The rms of white noise: right beside a smooth course, a few faults, and with nothing to judge."""

import numpy as np
import pytest

from rapi_jax.sampling._white_noise import white_noise_rms

PHASE = np.linspace(0.0, 6.0 * np.pi, 3000)
COURSES = {"none": 0.0 * PHASE, "sine": np.sin(PHASE), "triangle": np.arcsin(np.sin(PHASE))}


def noise(seed, size=3000):
    return np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize("course", COURSES)
def test_it_is_found_beside_a_course_a_thousand_times_as_large(course):
    found = [white_noise_rms(1000.0 * COURSES[course] + noise(k)) for k in range(40)]
    assert np.mean(found) == pytest.approx(1.0, abs=0.01)  # 40 means of a scatter of 2.5 %


def test_its_scatter_is_what_is_said_of_1000_samples():
    found = [white_noise_rms(noise(k, 1000)) for k in range(1000)]
    assert np.std(found) == pytest.approx(0.046, abs=0.004)  # of 1000: good to 2 % itself


def test_a_few_outliers_and_steps_do_not_count():
    values = noise(1) + np.where(np.arange(3000) > 1500, 500.0, 0.0)
    values[::100] += 1e4
    assert white_noise_rms(values) == pytest.approx(1.0, abs=0.1)


def test_of_fewer_than_four_readings_it_is_zero():
    assert white_noise_rms(np.array([1.0, -3.0, 7.0])) == 0.0
