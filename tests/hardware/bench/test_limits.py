"""Nothing is played unless all drives are allowed; the same sequence gives the same numbers."""

import dataclasses

import numpy as np
import pytest

from hardware import AbstractBench, DriveLimits, SimulatedBench
from hardware.simulated import Amplifier, Device, Laboratory
from rapi_jax import DataError, Drive, LimitError
from rapi_jax._waveform import triangle
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.io.drives._afg_waveform import AfgWaveform

GOOD = paper_drives()[3]


def forty(**fields):
    return triangle(40.0, **({"amplitude": 4.5, "bias": 3.0} | fields))[0]


@pytest.mark.fault(name="a drive beyond a limit of the bench", promise="refused whole")
@pytest.mark.parametrize(
    ("drive", "words"),
    [
        (forty(bias=6.0), ["high_v", "7.5", "8.25", "sample 2000"]),
        (forty(bias=2.0), ["low_v", "-0.25"]),
        (triangle(150.0, amplitude=4.5, bias=3.0)[0], ["150", "max_frequency_hz"]),
        (
            Drive(GOOD.time, np.where(GOOD.time > 0.01, 5.0, 3.0), 40.0, "triangle"),
            ["slew_v_per_s", "after sample 1600"],
        ),
        (
            Drive(GOOD.time, 1.0 + 4.0 * GOOD.time / GOOD.time[-1], 40.0, "triangle"),
            ["closes the period"],
        ),
    ],
)
def test_a_drive_beyond_a_limit_is_refused_whole(drive, words):
    bench = SimulatedBench.like_paper()
    for call in (bench.measure, bench.fringes):
        with pytest.raises(LimitError) as error:
            call(drive)
        assert all(word in str(error.value) for word in words), error.value
    with pytest.raises(LimitError, match="drive 2 of 2"):
        bench.measure([GOOD, drive])
    assert bench.measured == 0
    assert bench.session_s == 0.0


def test_all_drives_that_are_refused_are_named_once_with_what_to_do():
    high = Drive(GOOD.time, np.where(GOOD.time > 0.01, 50.0, 3.0), 40.0, "triangle")
    low = Drive(GOOD.time, -50.0 - GOOD.value, 40.0, "triangle")
    with pytest.raises(LimitError) as error:
        SimulatedBench.like_paper().measure([GOOD, high, high, low])
    said = str(error.value)
    assert said.startswith("drive 2 of 4: ") and said.count("Scan less, move the bias") == 1
    first, _, others = said.partition(" Refused, too: ")
    assert "`high_v`" in first and others.startswith("drive 3 of 4; drive 4 of 4 (")
    assert "`low_v`" in others and others.endswith(").")


def test_limits_hold_behind_the_amplifier():
    device = Device(paper_device(), Amplifier(gain=2.0))
    bench = SimulatedBench(Laboratory(device), DriveLimits(0.0, 7.5, 2000.0))
    with pytest.raises(LimitError, match="10.5"):
        bench.fringes(GOOD)
    assert bench.measured == 0


def test_a_drive_that_does_not_repeat_is_refused():
    bench = SimulatedBench.like_paper()
    free = Drive(GOOD.time, GOOD.value)
    part = Drive(GOOD.time[:3000], GOOD.value[:3000], 40.0, "triangle")
    for drive in (free, part):
        with pytest.raises(DataError, match="repeats"):
            bench.measure(drive)
    with pytest.raises(DataError, match="no drive"):
        bench.measure([])


def test_the_same_sequence_gives_the_same_numbers():
    first, second = SimulatedBench.like_paper(seed=5), SimulatedBench.like_paper(seed=5)
    a = [first.fringes(GOOD) for _ in range(2)]
    b = [second.fringes(GOOD) for _ in range(2)]
    for x, y in zip(a, b, strict=True):
        np.testing.assert_array_equal(x.interferometer, y.interferometer)
        np.testing.assert_array_equal(x.cavity, y.cavity)
    assert (a[0].interferometer != a[1].interferometer).mean() > 0.5
    other = SimulatedBench.like_paper(seed=6).fringes(GOOD)
    assert (a[0].interferometer != other.interferometer).mean() > 0.5


def test_records_are_as_long_as_their_drive():
    bench = SimulatedBench.like_paper()
    record = bench.fringes(paper_drives(samples=8000, periods=2)[3])
    margin = 0.18 / 40.0
    assert record.start_s == pytest.approx(-margin, abs=1e-7)
    assert record.stop_s == pytest.approx(0.05 + margin, abs=1e-7)
    assert record.sample_hz == 30e6
    assert bench.session_s == pytest.approx(0.05 + 0.05 + margin)
    bench.wait(60.0)
    assert bench.session_s > 60.0


def test_the_generator_holds_codes():
    bench = SimulatedBench.like_paper()
    waveform = bench.waveform(GOOD)
    assert isinstance(waveform, AfgWaveform)
    assert waveform.codes.size == 131072
    assert (waveform.low_v, waveform.high_v) == (pytest.approx(0.75), pytest.approx(5.25))
    assert isinstance(bench, AbstractBench)


def test_a_bench_says_what_it_is():
    bench = SimulatedBench.like_paper(seed=3, latency_s=1e-4, unmodelled=True)
    said = bench._provenance()
    assert all(isinstance(v, str) for v in said.values())
    assert said["seed"] == "3"
    assert said["latency_s"] == "0.0001"
    assert "MirrorResonance(hertz=1200.0" in said["physics"]
    assert dataclasses.is_dataclass(bench.laboratory)
