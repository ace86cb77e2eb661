"""The measurement arm's light and noise against closed forms and an independent fine simulation."""

import numpy as np
import pytest
from scipy import stats

from hardware.simulated import (
    Cavity,
    Device,
    Laser,
    MeasurementArm,
    Reflector,
    Scan,
    Target,
)
from hardware.simulated.laser._comb_jitter import CombJitter
from hardware.simulated.laser._normal import TableNormal
from hardware.simulated.laser._shared_phase_noise import SharedPhaseNoise
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.io.drives._afg_waveform import AfgWaveform

C = 299_792_458.0


def cosine(arm, light):
    return (light / (arm.volts / 2.0) - 1.0) / arm.visibility


@pytest.mark.parametrize("distance", [0.0, 0.35, 0.7, 7.3])
def test_the_phase_is_that_of_the_absolute_frequency(distance):
    """To 1e-4 rad, against 80-bit arithmetic: 2e6 whole fringes are dropped without loss."""
    nu = np.linspace(0.0, 75.0, 20_001)
    displacement = np.linspace(0.0, 0.2, nu.size)
    arm = MeasurementArm(Target(distance), index=1.00027, group_index=1.0003)
    optical = np.longdouble(C) / np.longdouble(780e-9) * np.longdouble(1.00027)
    optical = optical + np.longdouble(1e9) * np.longdouble(1.0003) * nu.astype(np.longdouble)
    cycles = optical * 2 * (np.longdouble(distance) + displacement) / np.longdouble(C)
    exact = np.cos(2 * np.longdouble(np.pi) * (cycles - np.floor(cycles)))
    found = cosine(arm, arm.light(nu, displacement, None))
    assert np.abs(found - exact.astype(float)).max() < 1e-5


def test_a_fringe_is_half_a_wavelength_of_motion():
    arm = MeasurementArm(Target(0.7), wavelength_m=633e-9)
    moved = np.linspace(0.0, 10 * 633e-9 / 2, 10_001)
    light = arm.light(np.zeros(moved.size), moved, None)
    np.testing.assert_allclose(light[::1000], light[0], atol=1e-4)
    assert np.count_nonzero(np.diff(np.sign(cosine(arm, light)))) == 20


def test_a_scan_counts_the_group_index():
    """One fringe of the scan is c / (2 n_g L)."""
    arm = MeasurementArm(Target(0.7), index=1.0, group_index=1.2)
    nu = np.arange(5) * (C / (2 * 1.2 * 0.7)) * 1e-9
    light = arm.light(nu, None, None)
    np.testing.assert_allclose(light, light[0], atol=1e-5)
    assert arm.delay_s(0.0) == pytest.approx(2 * 1.2 * 0.7 / C)


def fields(distances, amplitudes, nu, *, visibility):
    """Intensity of reference and reflections as complex fields, bright fringe of the first = 1."""
    share = (1 - np.sqrt(1 - visibility**2)) / 2
    total = np.full(nu.size, np.sqrt(1 - share), dtype=complex)
    for distance, amplitude in zip(distances, amplitudes, strict=True):
        cycles = (C / 780e-9 + nu * 1e9) * 2 * distance / C
        total += np.sqrt(share) * amplitude * np.exp(2j * np.pi * cycles)
    return np.abs(total) ** 2


def test_reflectors_interfere_as_fields_do():
    """With `between`, all but the constant power of the reflections; without, no cross terms."""
    nu = np.linspace(0.0, 75.0, 4001)
    reflectors = (Reflector(0.02, 0.3), Reflector(-0.5, 0.1, moving=False))
    arm = MeasurementArm(Target(0.7), reflectors=reflectors, between=True, visibility=0.8)
    distances, amplitudes = (0.7, 0.72, 0.2), (1.0, 0.3, 0.1)
    exact = fields(distances, amplitudes, nu, visibility=0.8)
    share = (1 - 0.6) / 2
    exact -= share * (0.3**2 + 0.1**2)
    found = arm.light(nu, None, None) / (arm.volts / 2)
    np.testing.assert_allclose(found, exact, atol=2e-5)
    plain = MeasurementArm(Target(0.7), reflectors=reflectors, visibility=0.8)
    each = [
        fields((d,), (a,), nu, visibility=0.8) for d, a in zip(distances, amplitudes, strict=True)
    ]
    powers = [share * a**2 + (1 - share) for a in amplitudes]
    beats = sum(one - power for one, power in zip(each, powers, strict=True))
    np.testing.assert_allclose(plain.light(nu, None, None) / (arm.volts / 2), 1 + beats, atol=2e-5)


def test_a_reflector_at_rest_does_not_move_with_the_target():
    moved = np.linspace(0.0, 1e-6, 1001)
    nu = np.zeros(moved.size)
    at_rest = MeasurementArm(Target(0.7), reflectors=(Reflector(-0.7, 0.5, moving=False),))
    alone = MeasurementArm(Target(0.7))
    difference = at_rest.light(nu, moved, None) - alone.light(nu, moved, None)
    assert np.ptp(difference) < 1e-6


def fine_windows(delays_s, sample_hz, linewidth_hz, rng):
    """Phase over each delay at some samples, from a Wiener process in steps of 0.5 ns or less."""
    steps_a_sample = max(int(2e9 / sample_hz), 41)
    count = 16_000_000 // max(steps_a_sample, 200)
    lead = max(int(np.ceil(delay * sample_hz)) for delay in delays_s) + 1
    steps = rng.standard_normal((count + lead) * steps_a_sample)
    walk = np.cumsum(steps * np.sqrt(2 * np.pi * linewidth_hz / (sample_hz * steps_a_sample)))
    at = (lead + np.arange(count)) * steps_a_sample
    place = np.arange(walk.size)
    ago = [delay * sample_hz * steps_a_sample for delay in delays_s]
    return [walk[at] - np.interp(at - steps, place, walk) for steps in ago]


@pytest.mark.parametrize(
    ("sample_hz", "delays_s"),
    [
        (1e6, (24.5e-9, 4.67e-9)),
        (30e6, (24.5e-9, 4.67e-9)),
        (30e6, (4.67e-9, 24.5e-9)),
        (100e6, (24.5e-9, 4.67e-9)),
        (300e6, (24.5e-9, 4.67e-9)),
        (30e6, (24.5e-9, 66.7e-9)),
        (30e6, (24.5e-9, 24.5e-9)),
        (30e6, (24.5e-9, 0.0)),
    ],
)
def test_two_delays_share_the_noise_of_their_common_past(sample_hz, delays_s):
    """Variances and covariances, also between samples, as in a simulation in small steps."""
    count, linewidth = 60_000, 2e5
    source = SharedPhaseNoise(
        Laser(linewidth, 0.0), delays_s, sample_hz, TableNormal(np.random.default_rng(1))
    )
    drawn = [source.draw(size)[0] for size in (1, 3, 9_996, count - 10_000)]
    found = [np.concatenate([part[i] for part in drawn]).astype(float) for i in (0, 1)]
    rng = np.random.default_rng(2)
    expected = fine_windows(delays_s, sample_hz, linewidth, rng)
    scale = 2 * np.pi * linewidth * max(delays_s)
    for lag in range(4):
        for i in (0, 1):
            for j in (0, 1):
                one, other = (
                    np.mean(x[i][lag:] * x[j][: x[j].size - lag]) / scale for x in (found, expected)
                )
                assert one == pytest.approx(other, abs=0.05), (lag, i, j)


def test_the_cavity_sees_the_same_frequency_noise():
    """The mean frequency over the auxiliary interferometer's window, where that is shorter."""
    source = SharedPhaseNoise(
        Laser(1e5, 0.0), (24.5e-9, 4.67e-9), 30e6, TableNormal(np.random.default_rng(1))
    )
    (phase, _), hertz = source.draw(1000)
    np.testing.assert_allclose(hertz, phase / (2 * np.pi * 24.5e-9), rtol=1e-5)
    silent = SharedPhaseNoise(Laser(0.0), (1e-8, 2e-8), 1e9, TableNormal(np.random.default_rng(1)))
    assert silent.draw(10) is None


def test_normal_numbers_from_a_table():
    normal = TableNormal(np.random.default_rng(4))
    x = normal.draw(400_001)
    assert x.size == 400_001
    assert stats.kstest(x[:20_000], "norm").pvalue > 1e-3
    assert x.var() == pytest.approx(1.0, abs=0.01)
    assert stats.kurtosis(x) == pytest.approx(0.0, abs=0.03)
    assert abs(np.mean(x[1:] * x[:-1])) < 0.008
    assert normal.draw(1000, 3.0).std() == pytest.approx(3.0, rel=0.1)


@pytest.fixture(scope="module")
def scan():
    from hardware.simulated import Laboratory

    return Laboratory(Device(paper_device())).scan(AfgWaveform.of(paper_drives()[3]))


def test_a_comb_errs_at_both_ends_of_each_branch(scan):
    """Independent from branch to branch and end to end, straight between, however it is asked."""
    jitter = CombJitter(1e-3, 7, scan)
    value = jitter.even(-0.050001, 1e-5, 200_000)  # 40 Hz: 80 periods
    again = np.concatenate([jitter.even(-0.050001 + k * 0.5, 1e-5, 50_000) for k in range(4)])
    np.testing.assert_allclose(again, value, atol=1e-9)
    branches = value.reshape(-1, 1250)[:, 5:-5]  # but for the turns
    ends = np.array([branches[:, 0], branches[:, -1]])
    assert ends.std() == pytest.approx(1e-3, rel=0.15)
    assert abs(np.corrcoef(ends)[0, 1]) < 0.3
    assert abs(np.corrcoef(ends[0][1:], ends[1][:-1])[0, 1]) < 0.3
    assert np.abs(np.diff(branches, 2)).max() < 1e-8


def test_a_comb_that_is_off_moves_its_peaks():
    nu = np.linspace(0.0, 3.0, 300_001)
    light = Cavity().light(nu, None, np.full(nu.size, 0.01))
    peaks = nu[light > 0.4]
    np.testing.assert_allclose(peaks[peaks < 1].mean(), 0.38, atol=2e-5)


def test_even_times_are_times(scan):
    time = 0.0123 + np.arange(5000) * 1e-6
    np.testing.assert_allclose(scan.even(0.0123, 1e-6, 5000), scan.at(time), atol=2e-2)
    smooth = Scan(np.sin(np.arange(1000) * 2 * np.pi / 1000), 40.0, 1, False)
    for start in (-0.3, 0.0, 77.0):
        time = start + np.arange(5000) * 1e-5
        exact = np.sin(2 * np.pi * 40.0 * time - np.pi / 1000)
        np.testing.assert_allclose(smooth.even(start, 1e-5, 5000), exact, atol=1e-5)


def test_what_is_no_arm_is_refused():
    for wrong in ({"index": 0.9}, {"visibility": 1.2}, {"wavelength_m": 0.0}, {"noise_v": -1.0}):
        with pytest.raises(ValueError, match="unlike|positive"):
            MeasurementArm(Target(0.7), **wrong)
