"""The budget's lines against simulation in which that source alone acts."""

import dataclasses

import numpy as np
import pytest

from hardware import SimulatedBench
from hardware.simulated import (
    Amplifier,
    Cavity,
    Interferometer,
    Laser,
    MeasurementArm,
    RandomVibration,
    Target,
)
from hardware.simulated.laser._digitizer import Digitizer
from rapi_jax import triangle
from rapi_jax._metrics import SPEED_OF_LIGHT as C
from rapi_jax.ranging._range import range_records
from rapi_jax.ranging.budget import Conditions, Vibration, measured_budget, predicted_budget

DISTANCE, RATE, HZ = 0.7, 10.0, 1e6
QUIET = {"linewidth_hz": 0.0, "noise_v": 0.0, "step_v": 0.0}


def _bench(*, laser=None, noise_v=0.0, bits=16, target=None, jitter_ghz=0.0, wander=None):
    """The paper's laser with everything switched off that is not asked for."""
    lab = SimulatedBench.like_paper(
        measurement=MeasurementArm(target or Target(DISTANCE), noise_v=noise_v),
        laser=laser or Laser(0.0, 0.0),
        digitizer=Digitizer(sample_hz=HZ, bits=bits),
        cavity=Cavity(noise_v=0.0, jitter_ghz=jitter_ghz),
    )
    lab.laboratory = dataclasses.replace(
        lab.laboratory,
        device=dataclasses.replace(lab.laboratory.device, amplifier=Amplifier(bandwidth_hz=2e3)),
        interferometer=dataclasses.replace(Interferometer.fibre(), noise_v=noise_v),
        wander=wander,
    )
    return lab


def _simulated(method, periods=40, **sources):
    (drive,) = triangle([RATE], amplitude=4.5, bias=3.0)
    records = _bench(**sources).range_records(drive, periods=periods)
    return range_records(records, method=method, kalman=False)


def _side(ranging, rising):
    table = ranging.table
    own = table.rising == rising
    shape = next(shape for shape in ranging.shapes if shape.rising == rising)
    # Neighbours differ by twice the variance: what all scans share does not count.
    return float(np.std(np.diff(table.path[own])) / np.sqrt(2.0)), shape


def _predicted(source, shape, method, **known):
    conditions = Conditions(
        time=shape.time,
        nu=shape.nu,
        margin=shape.margin,
        distance_m=DISTANCE,
        method=method,
        centre_hz=C / 780e-9,
        sample_hz=HZ,
        **{**QUIET, **known},
    )
    return {line.source: line.stderr for line in predicted_budget(conditions)}[source]


CASES = [
    ("detector", "resample-phase", {"noise_v": 0.05}, {"noise_v": 0.05}),
    ("detector", "resample-fft", {"noise_v": 0.05}, {"noise_v": 0.05}),
    ("linewidth", "resample-phase", {"laser": Laser(2e5, 0.0)}, {"linewidth_hz": 2e5}),
    ("linewidth", "resample-fft", {"laser": Laser(2e5, 0.0)}, {"linewidth_hz": 2e5}),
]
for _method in ("resample-phase", "resample-fft", "counting"):
    CASES.append(
        (
            "vibration",
            _method,
            {"target": Target(DISTANCE) + RandomVibration(2e-8, 20.0, 200.0, seed=2, lines=512)},
            {"vibration": Vibration(2e-8, 20.0, 200.0)},
        )
    )
for _method in ("counting", "counting-region"):
    CASES.append(("cavity", _method, {"jitter_ghz": 5e-3}, {"comb_hz": 5e6}))


@pytest.mark.parametrize(("source", "method", "sources", "known"), CASES)
def test_each_source_alone_spreads_distances_as_predicted(source, method, sources, known):
    """Within 20 % and what 60 scans leave open: 1.5 standard errors of their spread, of 10 %."""
    ranging = _simulated(method, periods=60, **sources)
    for rising in (True, False):
        seen, shape = _side(ranging, rising)
        expected = _predicted(source, shape, method, **known)
        assert 0.8 / 1.15 < seen / expected < 1.2 * 1.15, (seen, expected)


_BOTH = ("detector", "digitizer")


def test_coarse_codes_and_noise_together():
    """Five bits, dithered by noise of a third of a step: each error is then nearly its own.

    Without dither a slow fringe's errors of rounding repeat, and half as much reaches a distance:
    the prediction is an upper bound there.
    """
    known = {"noise_v": 0.02, "step_v": 2.0 / 31}
    ranging = _simulated("resample-phase", periods=60, bits=5, noise_v=0.02)
    for rising in (True, False):
        seen, shape = _side(ranging, rising)
        parts = [_predicted(one, shape, "resample-phase", **known) for one in _BOTH]
        assert 0.8 < seen / np.hypot(*parts) < 1.25
        assert seen > 1.15 * parts[0]  # more than the detector's noise alone


def test_the_crooked_scan_spreads_counting_as_predicted():
    """Over combs and fringes that lie anywhere; here they move with the laser's wander."""
    wander = RandomVibration(2.0, 0.0, 0.5, seed=1)
    ranging = _simulated("counting-region", periods=60, wander=wander)
    table = ranging.table
    for rising in (True, False):
        own = table.rising == rising
        _, shape = _side(ranging, rising)
        expected = _predicted("nonlinearity", shape, "counting-region")
        assert 0.75 < np.std(table.path[own]) / expected < 1.3


def test_motion_is_the_optical_frequency_over_the_span():
    nu = np.linspace(-30e9, 30e9, 500)
    time = np.linspace(0.0, 0.04, 500)
    for method in ("counting", "resample-fft", "resample-phase"):
        conditions = Conditions(time, nu, 0.7, method=method, velocity_m_per_s=1e-3)
        (line,) = (one for one in predicted_budget(conditions) if one.source == "motion")
        np.testing.assert_allclose(line.stderr, C / 780e-9 / 60e9 * 0.04 * 1e-3, rtol=2e-3)


def test_records_tell_their_own_budget():
    """Linewidth and detector told apart by two delays; vibration by the scatter beyond them."""
    target = Target(DISTANCE) + RandomVibration(5e-9, 20.0, 200.0, seed=5)
    ranging = _simulated("resample-phase", laser=Laser(2e5, 0.0), noise_v=0.03, bits=12)
    lines = {line.source: line for line in measured_budget(ranging)}
    _, shape = _side(ranging, True)
    for source, known in (("linewidth", {"linewidth_hz": 2e5}), ("detector", {"noise_v": 0.03})):
        expected = _predicted(source, shape, "resample-phase", **known)
        assert 0.8 < lines[source].stderr / expected < 1.2
    shaken = _bench(laser=Laser(2e5, 0.0), noise_v=0.03, bits=12, target=target)
    (drive,) = triangle([RATE], amplitude=4.5, bias=3.0)
    tracked = range_records(shaken.range_records(drive, periods=30))
    found = {line.source: line.stderr for line in measured_budget(tracked)}
    vibration = Vibration(5e-9, 20.0, 200.0)
    expected = _predicted("vibration", shape, "resample-phase", vibration=vibration)
    assert 0.6 < found["vibration"] / expected < 1.6  # by a median of some third differences
    assert found["air"] == 0.0 and found["cavity"] < 1e-6
