"""Learning control on a device with physics that RA-PI has no term for."""

import numpy as np
import pytest

from hardware import SimulatedBench
from rapi_jax import Drive, Run, compensate, linear_scan, triangle
from rapi_jax.examples import paper_device
from rapi_jax.inversion._learning import learn

NOISE = 1.5e-3  # GHz: of a reading from fringes, see test_fringes.py
RESONANCE, DAMPING, AMPLIFIER = 1200.0, 0.12, 1500.0


def bench_and_reading():
    """The bench's own physics with noise of a reading's size: fringes take seconds a scan."""
    bench = SimulatedBench.like_paper(unmodelled=True, latency_s=1e-4)
    rng = np.random.default_rng(2)

    def measure(drive):
        return Run(drive, bench.truth(drive) + NOISE * rng.standard_normal(drive.size))

    return bench, measure


def response(hertz):
    s = 2j * np.pi * hertz
    mirror = s / (2 * np.pi * RESONANCE)
    return 1 / (1 + 2 * DAMPING * mirror + mirror**2) / (1 + s / (2 * np.pi * AMPLIFIER))


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "reached"), [(10.0, 0.01), (40.0, 0.03)])
def test_from_nothing(rate, reached):
    """The ideal scan itself, in volts. What stays at 40 Hz rings above the bandwidth."""
    bench, measure = bench_and_reading()
    (target,) = linear_scan(rate, span=75.0, samples=4096, corner=0.1)
    start = Drive(target.time, 0.75 + 4.5 * target.value / 75.0, rate, "triangle")
    course = learn(measure, target, start, limits=bench.limits, iterations=12)
    both = np.hypot(*course.rms_ghz.T)
    assert course.stopped == "done"
    assert np.all(np.diff(both[:6]) < 0)
    assert both[course.best] < reached < 0.1 * both[0]


@pytest.mark.slow
def test_a_resonance_within_the_bandwidth_is_noticed():
    bench, measure = bench_and_reading()
    (target,) = linear_scan(40.0, span=75.0, samples=4096, corner=0.1)
    start = Drive(target.time, 0.75 + 4.5 * target.value / 75.0, 40.0, "triangle")
    course = learn(
        measure, target, start, limits=bench.limits, iterations=30, gain=0.9, bandwidth_hz=1500.0
    )
    assert course.stopped in ("diverged", "limits")
    assert len(course.runs) < 31
    both = np.hypot(*course.rms_ghz.T)
    assert course.best == np.argmin(both)


def test_with_the_response_of_amplifier_and_mirror_known():
    """The bandwidth may then pass the resonance, and the reading's noise is reached."""
    bench, measure = bench_and_reading()
    (target,) = linear_scan(10.0, span=75.0, samples=4096)
    (start,) = triangle(10.0, amplitude=4.5, bias=3.0)
    course = learn(
        measure,
        target,
        start,
        limits=bench.limits,
        iterations=12,
        bandwidth_hz=1000.0,
        lead_s=1e-4,
        response=response,
    )
    assert course.rms_ghz[course.best].max() < 1.5 * NOISE


@pytest.mark.slow
def test_from_a_models_drive():
    """The model leaves the resonance, the amplifier and the etalon; learning takes out the rest."""
    bench, measure = bench_and_reading()
    (target,) = linear_scan(10.0, span=75.0, samples=4096)
    model = compensate(paper_device(), target, limits=bench.limits, bias=3.0).drive
    course = learn(measure, target, model, limits=bench.limits, iterations=6, bandwidth_hz=150.0)
    both = np.hypot(*course.rms_ghz.T)
    assert both[0] < 0.2
    assert both[course.best] < 0.7 * both[0]


@pytest.mark.slow
def test_through_fringes():
    """The whole bench in the loop, each reading from raw records."""
    bench = SimulatedBench.like_paper(seed=3, unmodelled=True, latency_s=1e-4)
    (target,) = linear_scan(40.0, span=75.0, samples=4096, corner=0.1)
    course = learn(
        lambda drive: bench.measure(drive).runs[0],
        target,
        Drive(target.time, 0.75 + 4.5 * target.value / 75.0, 40.0, "triangle"),
        limits=bench.limits,
        iterations=2,
    )
    assert course.stopped == "done"
    assert course.rms_ghz[-1, 0] < 0.5 * course.rms_ghz[0, 0]
    assert course.rms_ghz[-1, 1] < 0.2 * course.rms_ghz[0, 1]
