"""The physics of the simulated bench against what is known of each part in closed form."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from hardware.simulated import (
    Amplifier,
    Cavity,
    Device,
    Digitizer,
    Drift,
    Interferometer,
    Laboratory,
    Laser,
    MirrorResonance,
    ParasiticEtalon,
)
from hardware.simulated.laser._light_noise import PhaseNoise
from rapi_jax import ECDL, GeneralRAPI, predict
from rapi_jax._waveform import triangle
from rapi_jax.effects import (
    AbstractDriveEffect,
    AbstractOpticalEffect,
    AmplifierLowpass,
    AmplitudeLaw,
    Creep,
    CurrentCoupling,
    Delay,
    RateLaw,
    Resonance,
    SlewLimit,
)
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.io.drives._afg_waveform import AfgWaveform

QUIET = Laser(linewidth_hz=0.0, rin_per_hz=0.0)
DARK = {
    "interferometer": Interferometer(24.5e-9, noise_v=0.0),
    "cavity": Cavity(noise_v=0.0),
    "laser": QUIET,
}


def rng():
    return np.random.default_rng(3)


@pytest.fixture(scope="module")
def waveform():
    return AfgWaveform.of(paper_drives()[3])  # 40 Hz: the shortest record


BENT = ECDL(
    GeneralRAPI(
        alpha=0.3, zeta=(6e-3, 2e-3), lam=1.5, eta=1.0, a=0.7, b=(0.2, 0.1), bow=0.03, u_0=3.0,
        d=(18.8, -1.1, 0.01),
    )
)  # fmt: skip


@pytest.mark.parametrize("device", [paper_device(), BENT], ids=["paper", "bent bounds"])
def test_the_laser_follows_the_device(waveform, device):
    """Within half a code (0.14 mV) and half a step of the generator, at the device's slope."""
    drive = paper_drives()[3]
    truth = np.asarray(predict(device, drive))
    lab = Laboratory(Device(device))
    found = lab.frequency(waveform, drive.time)
    slope = np.abs(np.diff(truth) / np.diff(drive.value)).max()
    bound = slope * (4.5 / 16382 / 2 + 360.0 * 0.5 / (40.0 * 131072)) + 1e-4
    assert np.abs(found - truth).max() < bound < 6e-3
    scan = lab.scan(waveform)
    assert scan.held
    assert scan.nu.size == 131072
    again = lab.frequency(waveform, drive.time + 1.0 / 40.0)
    np.testing.assert_allclose(again, found, atol=1e-2)


def test_a_drive_that_starts_elsewhere_gives_the_same_scan():
    (drive,) = triangle(40.0, amplitude=4.5, bias=3.0)
    late = np.roll(drive.value, 1000)
    other = type(drive)(drive.time, late, 40.0, "triangle")
    lab = Laboratory(Device(paper_device()))
    a = lab.scan(AfgWaveform.of(drive)).nu
    b = lab.scan(AfgWaveform.of(other)).nu
    np.testing.assert_allclose(np.roll(a, 131072 // 4), b, atol=1e-9)


@pytest.mark.parametrize("latency", [1e-4, 1e-3])
def test_latency_shifts_all(waveform, latency):
    time = np.linspace(0.002, 0.02, 1000)
    now, late = (Laboratory(Device(paper_device()), latency_s=x) for x in (0.0, latency))
    np.testing.assert_array_equal(
        late.frequency(waveform, time + latency), now.frequency(waveform, time)
    )


def test_fringes_count_the_span(waveform):
    """One fringe is 1 / tau; the cavity shows one peak for every multiple of its range."""
    lab = Laboratory(Device(paper_device()), **DARK)
    fringes = lab.record(waveform, rng())
    volts = lab.digitizer.volts(fringes.interferometer)
    middle = volts > 0.45
    up = slice(0, fringes.size // 2)
    crossings = np.count_nonzero(np.diff(middle[up].astype(int)))
    nu = lab.scan(waveform).nu
    assert crossings / 2 == pytest.approx(np.ptp(nu) * 24.5, abs=1.5)
    light = lab.digitizer.volts(fringes.cavity)[up]
    high = np.diff((light > 0.4).astype(int)) == 1
    orders = (np.array([nu.min(), nu.max()]) - 0.37) / 1.5
    assert np.count_nonzero(high) == int(np.floor(orders[1])) - int(np.floor(orders[0]))


def test_cavity_peaks_lie_on_the_comb():
    nu = np.linspace(0.0, 9.0, 900_001)
    light = Cavity().light(nu, None)
    peaks = [nu[part][light[part] > 0.4] for part in np.array_split(np.arange(nu.size), 6)]
    np.testing.assert_allclose([p.mean() for p in peaks], 0.37 + 1.5 * np.arange(6), atol=2e-5)
    width = np.count_nonzero(light > 0.4) * 1e-5 / 6
    assert width == pytest.approx(1.5 / 200, rel=0.01)


def test_an_interferometer_of_five_metres():
    assert Interferometer.fibre().delay_s == pytest.approx(24.5e-9, rel=2e-3)


@pytest.mark.parametrize("delay", [24.5e-9, 1e-7, 1.01e-6])
def test_phase_noise_has_the_variance_of_the_linewidth(delay):
    laser = Laser(linewidth_hz=2e5)
    source = PhaseNoise(laser, delay, 30e6, rng())
    phase = np.concatenate([source.draw(50_000)[0] for _ in range(6)])
    assert phase.var() == pytest.approx(2 * np.pi * 2e5 * delay, rel=0.05)
    # Windows a sampling interval apart share all but that.
    share = max(0.0, 1.0 - 1.0 / (30e6 * delay))
    found = np.mean(phase[1:] * phase[:-1]) / phase.var()
    assert found == pytest.approx(share, abs=0.03)


def test_a_noise_of_each_kind_has_its_size(waveform):
    """Of the residual about the record without noise, where the fringe's slope is known."""
    lab = Laboratory(Device(paper_device()), **DARK)
    clean = lab.record(waveform, rng())
    base = lab.digitizer.volts(clean.interferometer.astype(float))
    cosine = (base - 0.45) / 0.405
    step = lab.digitizer.volts_per_code

    def residual(**changes):
        # The same generator state gives the same fringe phase: it is drawn first.
        laser = changes.pop("laser", QUIET)
        other = Laboratory(Device(paper_device()), **{**DARK, **changes, "laser": laser})
        record = other.record(waveform, rng())
        return lab.digitizer.volts(record.interferometer.astype(float)) - base

    detector = residual(interferometer=Interferometer(24.5e-9, noise_v=5e-3))
    assert detector.std() == pytest.approx(np.hypot(5e-3, step / np.sqrt(6)), rel=0.02)
    flank = np.abs(cosine) < 0.1
    walk = residual(laser=Laser(1e5, 0.0))[flank].std() / 0.405
    assert walk == pytest.approx(np.sqrt(2 * np.pi * 1e5 * 24.5e-9), rel=0.03)
    bright = cosine > 0.9
    rin = residual(laser=Laser(0.0, 1e-11))[bright]
    assert rin.std() / base[bright].mean() == pytest.approx(np.sqrt(1e-11 * 15e6), rel=0.03)


def test_power_follows_the_scan(waveform):
    laser = Laser(0.0, 0.0, power_per_ghz=2e-3)
    lab = Laboratory(Device(paper_device()), **{**DARK, "laser": laser})
    light = lab.digitizer.volts(lab.record(waveform, rng()).interferometer)
    begin, end = light[2000:22_000].max(), light[353_000:373_000].max()
    assert end / begin == pytest.approx(1 + 2e-3 * 68, rel=0.03)


def test_digitizer_codes():
    digitizer = Digitizer(bits=12, low_v=-1.0, high_v=1.0)
    volts = np.array([-5.0, -1.0, 0.0, 0.3, 1.0, 5.0])
    codes = digitizer.codes(volts.copy())
    assert codes.dtype == np.int16
    assert codes[[0, 1, 4, 5]].tolist() == [-2048, -2048, 2047, 2047]
    assert np.abs(digitizer.volts(codes[1:5]) - volts[1:5]).max() <= digitizer.volts_per_code / 2
    with pytest.raises(ValueError, match="No digitizer"):
        Digitizer(bits=40)


def test_clipping_is_the_digitizers(waveform):
    small = {**DARK, "digitizer": Digitizer(low_v=0.0, high_v=0.7)}
    record = Laboratory(Device(paper_device()), **small).record(waveform, rng())
    assert record.full_scale == (-2048.0, 2047.0)
    assert (record.interferometer == 2047).mean() > 0.1


def test_an_amplifier_lags_a_ramp_by_its_time_constant():
    """Steady state of a first-order lag: 1 / (2 pi 1.5 kHz) = 0.106 ms behind, and its gain."""
    cycles = (np.arange(20_000) + 0.5) / 20_000
    period = 1 - 2 * np.abs(1 - 2 * cycles)
    out = Amplifier(2.0, 0.5, 1500.0)(period, 20_000 * 40.0)
    late = 1.0 / (2 * np.pi * 1500.0)
    part = (cycles > 0.3) & (cycles < 0.45)  # 7.5 ms after the turn: 70 time constants
    expected = 2.0 * (period - 4 * 40.0 * late) + 0.5
    np.testing.assert_allclose(out[part], expected[part], atol=2e-5)


def test_a_resonance_rings_at_its_own_frequency():
    """After a corner from slope -S to S, against the free oscillation in closed form."""
    cycles = (np.arange(400_000) + 0.5) / 400_000
    period = 1 - 2 * np.abs(1 - 2 * cycles)
    hertz, z, rate = 900.0, 0.05, 10.0
    out = MirrorResonance(hertz, z)(period, 400_000 * rate)
    w0, slope = 2 * np.pi * hertz, 4 * rate
    time = cycles[:150_000] / rate
    found = out[:150_000] - (period[:150_000] - 2 * z * slope / w0)
    wd, y0 = w0 * np.sqrt(1 - z**2), 4 * z * slope / w0
    swing = y0 * np.cos(wd * time) + (z * w0 * y0 - 2 * slope) / wd * np.sin(wd * time)
    expected = np.exp(-z * w0 * time) * swing
    np.testing.assert_allclose(found, expected, atol=1e-4 * 2 * slope / w0)


def test_an_etalon_is_fixed_in_frequency():
    etalon = ParasiticEtalon(0.02, 7.0, 0.4)
    nu = np.linspace(0, 70, 1001)
    np.testing.assert_allclose(etalon(nu, 1.0) - nu, 0.02 * np.sin(2 * np.pi * nu / 7.0 + 0.4))


def test_a_band_limit_smooths_the_codes():
    waveform = AfgWaveform.of(paper_drives()[3], 4096)
    held = Laboratory(Device(paper_device())).scan(waveform)
    smooth = Laboratory(Device(paper_device(), Amplifier(bandwidth_hz=1500.0))).scan(waveform)
    assert held.held
    assert not smooth.held
    assert smooth.nu.size >= 131072
    time = np.linspace(0.002, 0.010, 100_000)
    assert np.abs(np.diff(smooth.at(time))).max() < 0.1 * np.abs(np.diff(held.at(time))).max()


class Gain(AbstractDriveEffect):
    name: ClassVar = "gain"
    factor: float = 1.0

    @classmethod
    def initial_guesses(cls, evidence):
        return []

    def __call__(self, t, signal):
        return self.factor * signal


class Pickup(AbstractOpticalEffect):
    name: ClassVar = "pickup"
    hertz: float = 50.0

    @classmethod
    def initial_guesses(cls, evidence):
        return []

    def __call__(self, t, signal):
        return signal + 0.1 * jnp.sin(2 * jnp.pi * self.hertz * t)


def test_effects_of_the_model_see_session_time(waveform):
    """A ripple of 50 Hz is not the same in every period of 40 Hz; a gain acts on the drive."""
    time = np.linspace(0.001, 0.049, 500)
    plain = Device(ECDL(paper_device().operator, (Gain(1.0), Pickup(0.0))))
    rippled = Device(ECDL(paper_device().operator, (Gain(1.0), Pickup(50.0))))
    fields = {"periods": 2, "start_s": 3.003}
    base = Laboratory(plain).frequency(waveform, time, **fields)
    found = Laboratory(rippled).frequency(waveform, time, **fields) - base
    np.testing.assert_allclose(found, 0.1 * np.sin(100 * np.pi * (3.003 + time)), atol=1e-4)
    still = Laboratory(Device(paper_device())).frequency(waveform, time, periods=2)
    assert np.abs(base - still).max() < 0.01  # half a code and a step
    less = Device(ECDL(paper_device().operator, (Gain(0.9), Pickup(0.0))))
    assert np.ptp(Laboratory(less).frequency(waveform, time, **fields)) < 0.95 * np.ptp(base)


def around(*effects, **fields):
    return Device(ECDL(paper_device().operator, effects), **fields)


@pytest.mark.parametrize(
    ("model", "physics"),
    [
        (AmplifierLowpass(tau=1e-4), {"amplifier": Amplifier(bandwidth_hz=1e4 / (2 * np.pi))}),
        (Resonance(hertz=900.0, damping=0.1, share=1.0), {"after": (MirrorResonance(900.0, 0.1),)}),
    ],
)
def test_the_models_dynamics_are_those_of_the_bench(waveform, model, physics):
    """In time, from one period before, and by harmonics: both steady at once.

    The model's thresholds follow the drive that is sent, the bench's the drive behind its
    amplifier, which is smaller.
    """
    time = np.linspace(0.001, 0.024, 2000)
    amplifier = physics.get("amplifier", Amplifier())
    behind = amplifier(waveform.volts, waveform.volts.size * waveform.frequency_hz)
    operator = paper_device().operator
    less = operator.alpha * (np.ptp(behind) / np.ptp(waveform.volts))
    operator = eqx.tree_at(lambda o: o.alpha, operator, less)
    device = Device(ECDL(operator, (model,)), settling=0)
    found = Laboratory(device).frequency(waveform, time)
    expected = Laboratory(Device(paper_device(), **physics)).frequency(waveform, time)
    plain = Laboratory(around()).frequency(waveform, time)
    np.testing.assert_allclose(found, expected, atol=5e-3)  # a code is 5 MHz
    assert np.abs(plain - expected).max() > 0.5


def test_a_delay_of_the_model_is_a_latency_of_the_bench(waveform):
    time = np.linspace(0.002, 0.02, 1000)
    found = Laboratory(around(Delay(tau=3e-4))).frequency(waveform, time)
    expected = Laboratory(around(), latency_s=3e-4).frequency(waveform, time)
    np.testing.assert_allclose(found, expected, atol=1e-2)


def test_laws_and_limits_of_the_model_act_on_the_bench(waveform):
    """As in a prediction for the same drive; codes and steps as in the first test here."""
    drive = paper_drives()[3]
    effects = (
        SlewLimit(limit=300.0),
        RateLaw(exponent=1.6),
        AmplitudeLaw(threshold=0.2, gain=0.02, reference=3.0, centre=3.0),
        CurrentCoupling(coupling=1e-4),
    )
    model = ECDL(paper_device().operator, effects[:3])
    truth = np.asarray(predict(model, drive))
    found = Laboratory(around(*effects[:3])).frequency(waveform, drive.time)
    assert np.abs(found - truth).max() < 1e-2
    assert np.abs(truth - np.asarray(predict(paper_device(), drive))).max() > 1.0
    # The drive of the generator has steps, so that only the mean of what couples is known.
    coupled = Laboratory(around(*effects)).frequency(waveform, drive.time)
    up = (drive.time > 0.002) & (drive.time < 0.010)
    assert np.mean((coupled - found)[up]) == pytest.approx(1e-4 * 360.0, abs=0.02)


@pytest.mark.parametrize("history", [0.0, 1.0])
def test_creep_goes_on_within_a_measurement(history):
    """Against a prediction for the whole of what was played, the settling period included."""
    (drive,) = triangle(40.0, amplitude=4.5, bias=3.0, samples=12_000, periods=3)
    creep = Creep(gain=0.04, history=history)
    device = around(creep, settling=0)
    waveform = AfgWaveform.of(triangle(40.0, amplitude=4.5, bias=3.0, samples=16_384)[0], 16_384)
    time = np.linspace(0.001, 0.048, 800)
    found = Laboratory(device).frequency(waveform, time, periods=2)
    # The device has played one period when its record begins.
    truth = np.asarray(predict(ECDL(paper_device().operator, (creep,)), drive))
    np.testing.assert_allclose(found, np.interp(time + 1 / 40.0, drive.time, truth), atol=0.015)


def test_drift_is_a_function_of_session_time():
    drift = Drift.laboratory(seed=4)
    assert drift.at(0.0) == Drift().at(3600.0)
    long = [drift.at(t) for t in (60.0, 3600.0, 7200.0)]
    assert long == [drift.at(t) for t in (60.0, 3600.0, 7200.0)]
    assert long != [Drift.laboratory(seed=5).at(t) for t in (60.0, 3600.0, 7200.0)]
    states = [Drift(1.0, 1.0, 1.0, k).at(3600.0) for k in range(400)]
    after = np.array([[s.origin_ghz, s.gain, s.memory] for s in states])
    np.testing.assert_allclose(after.std(axis=0), 1.0, rtol=0.12)


def test_drift_changes_the_scan(waveform):
    still = Laboratory(Device(paper_device()))
    moving = Laboratory(Device(paper_device()), drift=Drift(1.0, 1e-3, 1e-3, seed=1))
    np.testing.assert_array_equal(still.scan(waveform).nu, moving.scan(waveform).nu)
    state = moving.drift.at(3600.0)
    change = moving.scan(waveform, start_s=3600.0).nu - still.scan(waveform).nu
    assert change.mean() == pytest.approx(state.origin_ghz, abs=0.3)
    assert np.ptp(change) > 1e-3
