"""Lasers that their current tunes: closed forms, an integrated network, published sizes."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hardware import SimulatedBench
from hardware.simulated import CurrentDriver, ThermalImpedance, dfb, vcsel
from rapi_jax import AfgWaveform, LimitError, linearity, triangle

LASERS = {"dfb": dfb(), "vcsel": vcsel()}


@pytest.fixture(params=LASERS)
def laser(request):
    return LASERS[request.param]


def middle_ma(laser):
    return laser.driver.offset_ma + 2.5 * laser.driver.ma_per_v


def square(low, high, size=1 << 16):
    """One period, `high` first."""
    return np.where(np.arange(size) < size // 2, high, low)


def test_a_step_of_power_warms_by_a_sum_of_exponentials(laser):
    """A period far longer than the slowest lag: each half is a step, exact at once."""
    thermal = laser.diode.thermal
    slowest, size = max(thermal.time_constants_s), 1 << 16
    sample_hz = size / (80.0 * slowest)
    found = thermal.temperature(square(0.0, 1.0, size), sample_hz)
    time = (np.arange(size // 2) + 0.5) / sample_hz
    expected = sum(
        r * (1 - np.exp(-time / tau))
        for r, tau in zip(thermal.resistances_k_per_w, thermal.time_constants_s, strict=True)
    )
    np.testing.assert_allclose(thermal.step(time), expected, rtol=1e-12)
    np.testing.assert_allclose(
        found[: size // 2], expected, rtol=0, atol=1e-12 * thermal.static_k_per_w
    )


def test_the_impedance_is_that_of_its_network(laser):
    """Against the node equations, integrated; real at rest, passive, and falling with frequency."""
    thermal = laser.diode.thermal
    hz = np.logspace(-2, 8, 101)
    z = thermal.impedance(hz)
    assert z[0] == pytest.approx(thermal.static_k_per_w, rel=1e-3)
    assert np.all(z.real > 0) and np.all(z.imag < 0) and np.all(np.diff(np.abs(z)) < 0)
    r, tau = (np.array(x) for x in (thermal.resistances_k_per_w, thermal.time_constants_s))
    rate = 1e3
    result = solve_ivp(
        lambda t, x: (r * np.cos(2 * np.pi * rate * t) - x) / tau,
        (0.0, 12 * tau.max()), np.zeros(r.size), method="LSODA", rtol=1e-9, atol=1e-9,
        dense_output=True,
    )  # fmt: skip
    time = 12 * tau.max() - np.arange(64) / 64 / rate
    wave = result.sol(time).sum(axis=0)
    expected = np.real(thermal.impedance(np.array([rate]))[0] * np.exp(2j * np.pi * rate * time))
    np.testing.assert_allclose(wave, expected, atol=1e-4 * thermal.static_k_per_w)


@pytest.mark.parametrize("bad", [((1.0,), (1.0, 2.0)), ((-1.0,), (1.0,)), ((1.0,), (np.inf,))])
def test_a_network_that_is_none(bad):
    with pytest.raises(ValueError, match="come in pairs"):
        ThermalImpedance(*bad)


def test_at_rest_all_that_goes_in_comes_out(laser):
    """Current times voltage is light and heat; heat times resistance is the temperature."""
    diode = laser.diode
    for ma in np.linspace(diode.lowest_ma, diode.highest_ma, 7):
        rest = diode.play(np.full(8, ma), 1e3)
        electrical = 1e-3 * ma * (diode.junction_v + 1e-3 * diode.series_ohm * ma)
        heat = rest.kelvin / diode.thermal.static_k_per_w
        np.testing.assert_allclose(heat + 1e-3 * rest.power_mw, electrical, rtol=1e-9)
        threshold = diode.threshold_ma * np.exp(rest.kelvin / diode.threshold_k)
        slope = diode.slope_mw_per_ma * (1 - rest.kelvin / diode.slope_k)
        np.testing.assert_allclose(rest.power_mw, slope * (ma - threshold), rtol=1e-7)


@pytest.mark.parametrize(("name", "low", "high"), [("dfb", -1.5, -0.5), ("vcsel", -500.0, -150.0)])
def test_static_tuning_is_of_the_published_size_and_bent(name, low, high):
    """GHz/mA; always down, ever steeper, since the heat grows with the square of the current."""
    laser = LASERS[name]
    ma = laser.driver.offset_ma + laser.driver.ma_per_v * np.linspace(0.0, 5.0, 21)
    slope = np.array([laser.diode.tuning_ghz_per_ma(one, np.zeros(1))[0].real for one in ma])
    assert np.all((slope > low) & (slope < high)) and np.all(np.diff(slope) < 0)

    def frequency(x):
        rest = laser.diode.play(np.full(2, x), 1.0)
        return (rest.thermal_ghz + rest.carrier_ghz)[0]

    step = 1e-4 * ma[10]
    central = (frequency(ma[10] + step) - frequency(ma[10] - step)) / (2 * step)
    assert slope[10] == pytest.approx(central, rel=1e-6)


@pytest.mark.parametrize("hz", [1e2, 1e3, 1e4, 1e5, 1e6])
def test_small_modulation_is_tuned_as_the_formula_says(laser, hz):
    """A sine of a ten-thousandth of the current, through the whole nonlinear device."""
    ma, size = middle_ma(laser), 1 << 16
    phase = 2 * np.pi * np.arange(size) / size
    depth = 1e-4 * ma
    light = laser.diode.play(ma + depth * np.cos(phase), hz * size)
    nu = light.thermal_ghz + light.carrier_ghz
    found = 2 * np.mean(nu * np.exp(-1j * phase)) / depth
    expected = laser.diode.tuning_ghz_per_ma(ma, np.array([hz]))[0]
    assert abs(found - expected) < 1e-4 * abs(expected)


def test_red_at_rest_and_blue_at_once(laser):
    """Heat wins at low rates; what is left above all lags are carriers, of the other sign."""
    slow, fast = laser.diode.tuning_ghz_per_ma(middle_ma(laser), np.array([0.0, 1e10]))
    assert slow.real < 0 < fast.real
    power_per_ma = laser.diode.slope_mw_per_ma
    assert fast.real < laser.diode.blue_ghz_per_mw * power_per_ma
    assert fast.real == pytest.approx(laser.diode.blue_ghz_per_mw * power_per_ma, rel=0.25)


def test_half_of_the_tuning_is_lost_where_published():
    """DFB lasers: within 1 to 100 kHz. VCSELs: at some 100 kHz."""
    for name, half_hz in (("dfb", (1e3, 1e5)), ("vcsel", (5e4, 1e6))):
        laser = LASERS[name]
        hz = np.logspace(0, 7, 701)
        size = np.abs(laser.diode.tuning_ghz_per_ma(middle_ma(laser), hz))
        half = hz[np.argmax(size < 0.5 * size[0])]
        assert half_hz[0] < half < half_hz[1], name


def test_more_current_is_more_light_and_a_longer_wavelength(laser):
    """Along a slow triangle: no memory of its own, both branches monotone."""
    size = 1 << 12
    ramp = np.concatenate([np.linspace(0, 1, size // 2), np.linspace(1, 0, size // 2)])
    ma = laser.driver.offset_ma + laser.driver.ma_per_v * 5.0 * ramp
    light = laser.diode.play(ma, 0.01 * size)
    nu = light.thermal_ghz + light.carrier_ghz
    assert np.all(np.diff(nu[: size // 2]) < 0) and np.all(np.diff(light.power_mw[: size // 2]) > 0)
    assert np.abs(nu - nu[::-1]).max() < 2e-3 * np.ptp(nu)  # 100 s against lags of ms


def test_what_a_diode_does_not_stand(laser):
    with pytest.raises(ValueError, match="this laser withstands"):
        laser.diode.play(np.array([laser.diode.highest_ma * 1.1]), 1.0)


def test_a_diode_too_warm_to_shine_turns_all_into_heat(laser):
    """Behind a hundred times the thermal resistance, by the closed form without light."""
    resistance = 1e2 * laser.diode.thermal.static_k_per_w
    hot = dataclasses.replace(laser.diode, thermal=ThermalImpedance((resistance,), (1e-3,)))
    ma = middle_ma(laser)
    rest = hot.play(np.full(4, ma), 1.0)
    assert not rest.power_mw.any()
    electrical = 1e-3 * ma * (hot.junction_v + 1e-3 * hot.series_ohm * ma)
    np.testing.assert_allclose(rest.kelvin, resistance * electrical, rtol=1e-12)


def test_the_driver_is_a_line_behind_a_low_pass():
    driver = CurrentDriver(offset_ma=50.0, ma_per_v=20.0, bandwidth_hz=1e3)
    np.testing.assert_allclose(driver(np.full(16, 2.0), 1e4), 90.0)
    phase = 2 * np.pi * np.arange(64) / 64
    swing = np.ptp(driver(np.cos(phase), 64e3))
    assert swing == pytest.approx(40.0 / np.sqrt(2.0), rel=1e-2)


def test_the_scan_is_the_diode_behind_the_driver(laser):
    """Frequency and power through generator codes, within what the codes are good for."""
    (drive,) = triangle([500.0], amplitude=4.0, bias=2.5, samples=2000)
    bench = SimulatedBench.dfb() if laser is LASERS["dfb"] else SimulatedBench.vcsel()
    scan = bench.laboratory.scan(AfgWaveform.of(drive))
    fine = np.interp(
        np.arange(1 << 17) / (1 << 17), np.append(drive.time, 2e-3) * 500.0,
        np.append(drive.value, drive.value[0]),
    )  # fmt: skip
    light = laser.diode.play(laser.driver(fine, 500.0 * fine.size), 500.0 * fine.size)
    expected = light.thermal_ghz + light.carrier_ghz
    found = scan.at(np.arange(1 << 17) / ((1 << 17) * 500.0))
    off = found - expected
    assert np.ptp(off) < 2e-3 * np.ptp(expected)
    assert scan.light is not None and np.ptp(scan.light.nu) > 0.5


@pytest.mark.parametrize(("name", "amplitude", "noise"), [("dfb", 4.0, 0), ("vcsel", 3.0, 7)])
def test_a_scan_is_read_from_its_fringes(name, amplitude, noise):
    """At the highest rate, power rising by half of itself: 4e-5 of the span, for the linewidth.

    With the VCSEL's noise a peak of the cavity beside a turn is twice as wide as the others.
    """
    bench = getattr(SimulatedBench, name)()
    bench.measured = noise
    (drive,) = triangle([1000.0], amplitude=amplitude, bias=2.5, samples=1000, periods=2)
    readout = bench.read(drive)
    assert all("visibility changes" in fault for fault in readout.faults), readout.faults
    run = readout.run(drive)
    truth = -bench.truth(drive)  # a reading rises with the drive
    off = run.response - truth
    assert np.nanstd(off) < 4e-5 * np.ptp(truth)
    before = linearity(run)
    assert max(before.up.rms_ghz, before.down.rms_ghz) > 5e-3 * np.ptp(truth)


@pytest.mark.parametrize("name", LASERS)
def test_fringes_at_the_limits_can_be_sampled(name):
    """The steepest drive that the limits let pass gives a fringe five samples or more."""
    bench = getattr(SimulatedBench, name)()
    lab, laser = bench.laboratory, LASERS[name]
    highest_ma = laser.driver.offset_ma + laser.driver.ma_per_v * bench.limits.high_v
    steepest = abs(
        laser.diode.tuning_ghz_per_ma(highest_ma, np.array([bench.limits.max_frequency_hz]))
    )
    ghz_per_s = float(steepest[0]) * laser.driver.ma_per_v * bench.limits.slew_v_per_s
    fringe_hz = ghz_per_s * 1e9 * lab.interferometer.delay_s
    assert fringe_hz < lab.digitizer.sample_hz / 5.0
    with pytest.raises(LimitError, match="max_frequency_hz"):
        bench.measure(triangle([2000.0], amplitude=4.0, bias=2.5))
