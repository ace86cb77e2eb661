"""Metrics of a scan: Table 1's uncompensated half, exact shapes, refusals."""

import numpy as np
import pytest

from rapi_jax import DataError, Drive, Run, predict
from rapi_jax._metrics import SPEED_OF_LIGHT as C
from rapi_jax._metrics import linearity, turning_points
from rapi_jax._waveform import triangle
from rapi_jax.examples import paper_device, paper_drives

UP = (0.435, 0.400, 0.391, 0.400)  # GHz, Table 1
DOWN = (3.28, 3.24, 3.12, 3.03)
ONE_MINUS_R2 = ((7.15e-4, 6.12e-4, 5.83e-4, 6.15e-4), (4.26e-2, 4.23e-2, 3.92e-2, 3.70e-2))


@pytest.mark.parametrize("periods", [1, 3])
@pytest.mark.parametrize("noise", [0.0, 0.020])
def test_table_1_without_compensation(periods, noise):
    rng = np.random.default_rng(1)
    for i, drive in enumerate(paper_drives(samples=4000 * periods, periods=periods)):
        truth = np.asarray(predict(paper_device(), drive))
        scan = linearity(Run(drive, truth + noise * rng.standard_normal(drive.size)))
        up, down = scan.rms_ghz
        assert abs(up / UP[i] - 1) < 0.01
        assert abs(down / DOWN[i] - 1) < 0.01
        # The table's own two columns give excursions from 54.6 to 56.4 GHz: +-3.3 % about 55.5 GHz
        # in 1 - r^2, with twice 1 % from the rms.
        assert abs(scan.up.one_minus_r2(55.5) / ONE_MINUS_R2[0][i] - 1) < 0.053
        assert abs(scan.down.one_minus_r2(55.5) / ONE_MINUS_R2[1][i] - 1) < 0.053
        assert len(scan.up_periods) >= periods - 1
        assert scan.up.slope_ghz_per_s > 0 > scan.down.slope_ghz_per_s


def line_and_sine(rms, *, samples=4000, shift=0.0, rate=10.0, order=3):
    """A linear triangle of 75 GHz with a sine of the given rms on it, and its drive."""
    (drive,) = triangle(rate, amplitude=4.5, bias=3.0, samples=samples)
    phase = np.mod(drive.time * rate - shift, 1.0)
    up = phase < 0.5
    along = np.where(up, phase / 0.5, (phase - 0.5) / 0.5)
    nu = 75.0 * np.where(up, along, 1.0 - along)
    wave = np.sqrt(2) * rms * np.sin(2 * np.pi * order * (along - 0.1) / 0.8)
    return drive, nu + np.where(np.abs(along - 0.5) <= 0.4, wave, 0.0)


def test_a_sine_on_a_line():
    rms = 0.05
    drive, nu = line_and_sine(rms)
    branch = linearity(Run(drive, nu)).up
    # A least-squares line takes the part 6/(pi n)^2 of the sine's power.
    left = rms * np.sqrt(1 - 6 / (np.pi * 3) ** 2)
    assert branch.rms_ghz == pytest.approx(left, rel=3e-3)
    assert branch.excursion_ghz == pytest.approx(60.0, rel=5e-3)
    assert branch.one_minus_r2() == pytest.approx(12 * (branch.rms_ghz / 60.0) ** 2, rel=1e-2)
    tau = 24.5e-9
    cycles = 2 * np.pi * tau * branch.rms_ghz * 1e9
    assert branch.eq5_width_hz(tau) == pytest.approx((1 + cycles) / 0.04, rel=1e-3)
    span = branch.excursion_ghz * 1e9
    assert branch.resolution_m(tau) == pytest.approx(C * (1 + cycles) / (2 * span))
    assert branch.nonlinear_resolution_m(tau) == pytest.approx(C * cycles / (2 * span))


def test_the_width_of_a_linear_scan_is_that_of_the_window():
    """The power of a rectangular window of T seconds falls to half at 0.8859 / T."""
    drive, nu = line_and_sine(0.0)
    for branch in (linearity(Run(drive, nu)).up, linearity(Run(drive, nu)).down):
        assert branch.peak_width_hz(24.5e-9) == pytest.approx(0.8859 / 0.04, rel=2e-3)


def test_the_width_of_a_curved_scan_is_that_of_the_whole_beat():
    """Against the spectrum of the real beat, sampled far above its frequency."""
    (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=4000)
    truth = np.asarray(predict(paper_device(), drive))
    branch = linearity(Run(drive, truth)).down
    tau = 24.5e-9
    dense = np.linspace(branch.time[0], branch.time[-1], 400_000)
    beat = np.cos(2 * np.pi * tau * 1e9 * np.interp(dense, branch.time, branch.frequency))
    power = np.abs(np.fft.rfft(beat, 1 << 22)) ** 2
    hertz = np.fft.rfftfreq(1 << 22, dense[1] - dense[0])
    power[hertz < 1e3] = 0.0
    above = hertz[power >= power.max() / 2]
    assert branch.peak_width_hz(tau) == pytest.approx(np.ptp(above), rel=0.01)
    assert branch.peak_width_hz(tau) > 20 / 0.04


@pytest.mark.parametrize("shift", [0.0, 0.013, 0.0401, 0.31])
def test_late_turns_are_found(shift):
    drive, nu = line_and_sine(0.02, shift=shift)
    low, high = turning_points(drive.time * drive.rate, nu)
    assert abs((low - shift + 0.5) % 1.0 - 0.5) < 3e-4
    assert abs((high - shift) % 1.0 - 0.5) < 3e-4
    assert linearity(Run(drive, nu)).up.rms_ghz == pytest.approx(
        linearity(Run(*line_and_sine(0.02))).up.rms_ghz, rel=5e-3
    )


def test_round_turns_are_found():
    phase = np.arange(4000) / 4000
    low, high = turning_points(phase, np.cos(2 * np.pi * (phase - 0.3)))
    assert low == pytest.approx(0.8, abs=1e-4)
    assert high == pytest.approx(0.3, abs=1e-4)


def test_masked_readings_are_left_out():
    drive, nu = line_and_sine(0.05)
    whole = linearity(Run(drive, nu)).rms_ghz
    nu[100:130] = np.nan
    nu[::17] = np.nan
    assert linearity(Run(drive, nu)).rms_ghz == pytest.approx(whole, rel=0.02)


def test_a_denser_recording_gives_the_same():
    drive, nu = line_and_sine(0.05)
    dense, fine = line_and_sine(0.05, samples=20_000)
    a, b = linearity(Run(drive, nu)), linearity(Run(dense, fine))
    assert a.rms_ghz == pytest.approx(b.rms_ghz, rel=5e-3)


def test_refusals():
    drive, nu = line_and_sine(0.0)
    with pytest.raises(DataError, match="does not repeat"):
        linearity(Run(Drive(drive.time, drive.value), nu))
    with pytest.raises(DataError, match="too few"):
        linearity(Run(drive, np.full(nu.size, np.nan)))
    short = Drive(drive.time[:1500], drive.value[:1500], 10.0, "triangle")
    with pytest.raises(DataError, match="less than one period"):
        linearity(Run(short, nu[:1500]))
    three = paper_drives(samples=6000, periods=3)[0]
    many = linearity(Run(three, np.asarray(predict(paper_device(), three))))
    with pytest.raises(DataError, match="several periods"):
        many.up.peak_width_hz(24.5e-9)
    with pytest.raises(DataError, match="Record more samples"):
        many.down_periods[0].peak_width_hz(24.5)
