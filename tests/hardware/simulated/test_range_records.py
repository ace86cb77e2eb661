"""Fringe records of the simulated bench: distance in them, time, continuity, and noise."""

import dataclasses

import numpy as np
import pytest

from hardware import SimulatedBench
from hardware.simulated import (
    Amplifier,
    Cavity,
    ConstantVelocity,
    Device,
    Digitizer,
    Drift,
    Interferometer,
    Laboratory,
    Laser,
    MeasurementArm,
    Target,
    Vibration,
)
from rapi_jax import ECDL, LimitError
from rapi_jax._waveform import triangle
from rapi_jax.effects import Creep
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.io.drives._afg_waveform import AfgWaveform

C = 299_792_458.0
QUIET = Laser(0.0, 0.0)
DRIVE = paper_drives()[3]  # 40 Hz


def bench(arm=None, *, sample_hz=2e6, quiet=True, **fields):
    laser = QUIET if quiet else Laser()
    made = SimulatedBench.like_paper(
        laser=laser, digitizer=Digitizer(sample_hz), measurement=arm, **fields
    )
    if quiet:
        dark = {
            "interferometer": Interferometer(24.5e-9, noise_v=0.0),
            "cavity": Cavity(noise_v=0.0),
        }
        made.laboratory = dataclasses.replace(made.laboratory, **dark)
    return made


def phase(codes):
    """Unwrapped phase of fringes by the analytic signal: an oracle without anything of ours."""
    spectrum = np.fft.fft(codes - codes.mean())
    spectrum[codes.size // 2 :] = 0
    return np.unwrap(np.angle(np.fft.ifft(spectrum)))


def slope(record, part):
    """Fringes of the arm over fringes of the interferometer on a stretch of one branch."""
    one, other = (phase(x[part].astype(float)) for x in (record.measurement, record.interferometer))
    inner = slice(one.size // 5, -one.size // 5)
    return np.polyfit(other[inner], one[inner], 1)[0]


UP = slice(3_000, 22_000)  # of 50 000 samples a period at 2 MS/s


def test_a_distance_is_in_the_records():
    """By fringes alone, to 1e-5 of the distance."""
    arm = MeasurementArm(Target(0.7), index=1.00027, group_index=1.0003, noise_v=0.0)
    records = bench(arm).range_records(DRIVE)
    (record,) = records
    assert records.interferometer_path_m == pytest.approx(24.5e-9 * C)
    distance = slope(record, UP) * records.interferometer_path_m / (2 * 1.0003)
    assert distance == pytest.approx(0.7, rel=1e-5)


@pytest.mark.parametrize("velocity", [1e-4, -1e-4])
def test_motion_looks_like_a_distance(velocity):
    """Eq. 2: nu_0 over the scan's slope, 6000 times the motion in a scan, with opposite signs."""
    target = Target(0.7) + ConstantVelocity(velocity, -1.0)
    (record,) = bench(MeasurementArm(target, noise_v=0.0)).range_records(DRIVE)
    up = slope(record, UP) * 24.5e-9 * C / 2
    down = slope(record, slice(28_000, 47_000)) * 24.5e-9 * C / 2
    middle = float(target.distance(record.start_s + 0.0125))
    # 75 GHz in 12.5 ms: 6 THz/s.
    expected = velocity * C / 780e-9 / 6e12
    assert (up - down) / 2 == pytest.approx(expected, rel=0.1)
    assert (up + down) / 2 == pytest.approx(middle, abs=0.1 * abs(expected))


def test_what_a_record_says_of_itself():
    made = bench(sample_hz=1e6)
    records = made.range_records(DRIVE, periods=2, records=3, target=Target(0.7))
    assert [r.name for r in records] == ["record00", "record01", "record02"]
    assert [r.size for r in records] == [50_000] * 3
    starts = np.array([r.start_s for r in records])
    np.testing.assert_allclose(starts, 2 / 40 + np.arange(3) * 0.05)
    assert made.session_s == pytest.approx(starts[-1] + 0.05)
    assert made.measured == 1
    assert all(r.rising_at_start for r in records)
    assert records.cavity_spacing_hz == 1.5e9
    assert records.excitation_hz == 40.0
    assert records.waveform == "triangle"
    assert records.full_scale == (-2048.0, 2047.0)
    assert records.volts_per_code == made.laboratory.digitizer.volts_per_code
    assert records.records[0].measurement.dtype == np.int16


@pytest.mark.parametrize(("latency_s", "shift", "rising"), [
    (0.0, 0, True), (1e-4, 0, True), (0.0, 2000, False), (3e-3, 0, False),
])  # fmt: skip
def test_the_direction_at_the_start(latency_s, shift, rising):
    """That of the light: a turn within a hundredth of a period (latency) has already been."""
    drive = dataclasses.replace(DRIVE, value=np.roll(DRIVE.value, -shift))
    made = bench(sample_hz=1e6, latency_s=latency_s)
    records = made.range_records(drive, target=Target(0.7))
    assert records.records[0].rising_at_start is rising


@pytest.mark.parametrize("rate", [40.0, 37.0])
def test_records_follow_each_other_without_a_gap(rate):
    """Three records are one long one, to a code: scan, target and phases go on.

    Behind an amplifier of limited bandwidth: a sample on the edge of a generator's step may
    otherwise lie on either side of it.
    """
    (drive,) = triangle(rate, amplitude=4.5, bias=3.0)
    target = Target(0.7) + Vibration(3e-6, 130.0) + ConstantVelocity(5e-3, 0.06)
    arm = MeasurementArm(target, noise_v=0.0)
    smooth = Device(paper_device(), Amplifier(bandwidth_hz=5e3))

    def play(**fields):
        made = bench(arm)
        made.laboratory = dataclasses.replace(made.laboratory, device=smooth)
        return made.range_records(drive, **fields)

    several, (whole,) = play(records=3), play(periods=3)
    for name in ("measurement", "interferometer", "cavity"):
        joined = np.concatenate([getattr(r, name) for r in several]).astype(int)
        difference = np.abs(joined - getattr(whole, name))
        assert difference.max() <= 1
        assert np.count_nonzero(difference) < 1e-3 * joined.size
    assert [r.start_s for r in several][1:] == pytest.approx(
        [whole.start_s + k / rate for k in (1, 2)], abs=0.5 / 2e6
    )


def test_a_stream_gives_what_a_list_does():
    target = Target(0.7)
    listed = bench(quiet=False).range_records(DRIVE, records=3, target=target)
    made = bench(quiet=False)
    stream = made.stream_range_records(DRIVE, records=3, target=target)
    for one, expected in zip(stream, listed, strict=True):
        (record,) = one
        np.testing.assert_array_equal(record.measurement, expected.measurement)
        np.testing.assert_array_equal(record.cavity, expected.cavity)
        assert made.session_s == pytest.approx(record.start_s + 0.025)


def test_measurements_differ_in_noise_alone_and_repeat_with_the_seed():
    first, again = (bench(quiet=False) for _ in range(2))
    a = first.range_records(DRIVE, target=Target(0.7))
    b = first.range_records(DRIVE, target=Target(0.7))
    c = again.range_records(DRIVE, target=Target(0.7))
    np.testing.assert_array_equal(a.records[0].measurement, c.records[0].measurement)
    assert (a.records[0].measurement != b.records[0].measurement).mean() > 0.5


def test_the_arms_own_detector_noise():
    """On the flank of nothing but noise: the target at distance 0 gives a bright fringe."""
    arm = MeasurementArm(Target(0.0), noise_v=5e-3)
    (record,) = bench(arm).range_records(DRIVE)
    volts = Digitizer().volts(record.measurement.astype(float))
    assert volts.std() == pytest.approx(5e-3, rel=0.03)
    assert volts.mean() == pytest.approx(0.9 * 1.9 / 2, abs=1e-3)


def test_intensity_noise_is_common_to_the_channels():
    laser = Laser(0.0, 1e-9, 0.0)
    quiet = bench(MeasurementArm(Target(0.7), noise_v=0.0))
    loud = bench(MeasurementArm(Target(0.7), noise_v=0.0))
    loud.laboratory = dataclasses.replace(loud.laboratory, laser=laser)
    (clean,), (noisy,) = (one.range_records(DRIVE) for one in (quiet, loud))
    codes = Digitizer()
    ratios = []
    for name in ("measurement", "interferometer"):
        base, seen = (codes.volts(getattr(r, name).astype(float)) for r in (clean, noisy))
        ratios.append(np.where(base > 0.7, seen / base - 1.0, np.nan))
    both = np.isfinite(ratios).all(axis=0)
    assert np.corrcoef(ratios[0][both], ratios[1][both])[0, 1] > 0.95
    assert ratios[0][both].std() == pytest.approx(np.sqrt(1e-9 * 1e6), rel=0.05)


def test_drift_goes_on_between_records():
    """The origin of the optical frequency, by 2 L / c fringes a GHz."""
    drift = Drift(origin_ghz=30.0, seed=1)
    arm = MeasurementArm(Target(0.7), noise_v=0.0)
    made = bench(arm, drift=drift)
    made.wait(500.0)
    records = made.range_records(DRIVE, records=2)
    made.session_s = 500.0
    several = list(made.stream_range_records(DRIVE, records=2))
    assert several[0].wavelength_m == several[1].wavelength_m  # one set-up, so one folder
    at = [drift.at(r.start_s).origin_ghz for r in records]
    nu = [
        np.asarray(made.laboratory.scan(made.waveform(DRIVE), start_s=r.start_s).nu)
        for r in records
    ]
    assert (nu[1] - nu[0]).mean() == pytest.approx(at[1] - at[0], rel=1e-6)
    again = bench(arm, drift=dataclasses.replace(drift, origin_ghz=0.0))
    again.wait(500.0)
    still = again.range_records(DRIVE, records=2)
    for k in (0, 1):
        same = records.records[k].measurement[:10_000] == still.records[k].measurement[:10_000]
        assert same.mean() < 0.5


def test_a_device_with_effects_goes_on_too():
    """Creep goes on from record to record, as in one long record."""
    creeping = Device(ECDL(paper_device().operator, (Creep(gain=0.05),)))

    def one():
        made = bench(MeasurementArm(Target(0.7), noise_v=0.0), sample_hz=1e6)
        made.laboratory = dataclasses.replace(made.laboratory, device=creeping)
        return made

    several = one().range_records(DRIVE, records=2)
    (whole,) = one().range_records(DRIVE, periods=2)
    joined = np.concatenate([r.measurement for r in several]).astype(int)
    assert np.abs(joined - whole.measurement).max() <= 1


def test_end_points_of_the_cavity_err_by_the_jitter():
    """Peaks of a comb that is off by 1 GHz rms lie elsewhere in each branch; without, in none."""
    drive = DRIVE

    def peaks(jitter):
        made = bench(MeasurementArm(Target(0.7)))
        comb = Cavity(noise_v=0.0, jitter_ghz=jitter)
        made.laboratory = dataclasses.replace(made.laboratory, cavity=comb)
        (record,) = made.range_records(drive, periods=2)
        return record.cavity.reshape(2, -1)

    still, moved = peaks(0.0), peaks(0.2)
    assert np.corrcoef(still)[0, 1] > 0.99
    assert np.corrcoef(moved)[0, 1] < 0.5


def test_a_record_without_a_target_is_as_before():
    """The two-channel record neither sees the arm nor draws for it."""
    waveform = AfgWaveform.of(DRIVE)
    plain = bench(quiet=False).laboratory
    arm = dataclasses.replace(plain, measurement=MeasurementArm(Target(0.7)))
    one, other = (lab.record(waveform, np.random.default_rng(1)) for lab in (plain, arm))
    np.testing.assert_array_equal(one.interferometer, other.interferometer)
    np.testing.assert_array_equal(one.cavity, other.cavity)


def test_what_cannot_be_played_is_refused():
    made = bench()
    with pytest.raises(ValueError, match="no measurement arm"):
        made.range_records(DRIVE)
    with pytest.raises(ValueError, match="1 or more"):
        made.range_records(DRIVE, records=0, target=Target(0.7))
    (high,) = triangle(40.0, amplitude=4.5, bias=8.0)
    with pytest.raises(LimitError):
        made.range_records(high, target=Target(0.7))
    assert made.measured == 0
    assert isinstance(made.laboratory, Laboratory)
