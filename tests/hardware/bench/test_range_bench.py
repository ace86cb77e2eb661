"""Fringe records from a bench of instruments: what is in them, and how the bench is left."""

import dataclasses

import numpy as np
import pytest
from benches import bench_file

from hardware import InstrumentError, dry_run, read_bench
from hardware.simulated import ConstantVelocity, Interferometer, MeasurementArm, Target
from rapi_jax import DataError, LimitError, triangle
from rapi_jax.ranging import AirState

C = 299_792_458.0
SLOW = {"sample_hz = 10e6": "sample_hz = 1e6"}
AIR = "[air]\ntemperature_c = 21.0\npressure_pa = 100000.0\nrelative_humidity = 0.4\n\n[optics]"
(DRIVE,) = triangle(40.0, amplitude=3.0, bias=3.0, samples=2000)


def rehearsed(folder, change=None, arm=None):
    file = read_bench(bench_file(folder, change={**SLOW, **(change or {})}, measurement=True))
    dry = dry_run(file)
    if arm is not None:
        dry.laboratory.laboratory = dataclasses.replace(
            dry.laboratory.laboratory, measurement=arm, interferometer=Interferometer(24.483e-9)
        )
    return dry


def parked(dry):
    seen = dry.laboratory.generator.seen[1]
    return dry.laboratory.generator.output(1) is None and seen.relay_v <= 0.0041


def phase(codes):
    spectrum = np.fft.fft(codes - codes.mean())
    spectrum[codes.size // 2 :] = 0
    return np.unwrap(np.angle(np.fft.ifft(spectrum)))


def distance(record, part, path_m=24.483e-9 * C):
    """By fringes of both arms over a part (0 to 1) of a record in which the scan has no turn."""
    at = slice(int(part[0] * record.size), int(part[1] * record.size))
    one, other = (phase(x[at].astype(float)) for x in (record.measurement, record.interferometer))
    inner = slice(one.size // 5, -one.size // 5)
    return np.polyfit(other[inner], one[inner], 1)[0] * path_m / 2


def test_records_of_a_target(tmp_path):
    dry = rehearsed(tmp_path, {"[optics]": AIR}, MeasurementArm(Target(0.6)))
    with dry.bench as bench:
        records = bench.record_fringes(DRIVE, periods=2, records=3)
        assert parked(dry)
    assert records.interferometer_path_m == pytest.approx(24.483e-9 * C)
    assert records.wavelength_m == 780e-9
    assert records.air == AirState(21.0, 100_000.0, 0.4)
    assert records.excitation_hz == pytest.approx(40.0)
    assert records.cavity_spacing_hz == 1.5e9
    sizes = [record.size for record in records]
    assert sizes == [round(2 / 40 * records.sample_hz)] * 3
    starts = [record.start_s for record in records]
    periods = np.diff(starts) * 40.0
    np.testing.assert_allclose(periods, np.rint(periods), atol=1e-3)
    assert (periods >= 2).all()
    for record in records:
        assert record.rising_at_start is True
        assert record.measurement.dtype == np.int16
        assert distance(record, (0.06, 0.24)) == pytest.approx(0.6, rel=2e-4)


def test_a_target_that_moves(tmp_path):
    """By its distance from record to record, and by what motion adds in a scan (Eq. 2)."""
    velocity = 5e-4
    dry = rehearsed(tmp_path, arm=MeasurementArm(Target(0.6) + ConstantVelocity(velocity)))
    with dry.bench as bench:
        records = bench.record_fringes(DRIVE, records=2)
    for record in records:
        up, down = distance(record, (0.1, 0.45)), distance(record, (0.6, 0.95))
        assert up > down  # a scan upward and a target that recedes both add fringes


def test_the_direction_follows_drive_amplifier_and_laser(tmp_path):
    late = dataclasses.replace(DRIVE, value=np.roll(DRIVE.value, 1000))
    change = {"settling = 2": "settling = 2\namplifier = { gain = -1.0, offset_v = 6.0 }"}
    falls = {"fsr_ghz = 1.5": "fsr_ghz = 1.5\nrises_with_voltage = false"}
    for played, changed, rises in (
        (DRIVE, {}, True), (late, {}, False), (DRIVE, change, False), (DRIVE, falls, False),
    ):  # fmt: skip
        dry = rehearsed(tmp_path, changed)
        with dry.bench as bench:
            records = bench.record_fringes(played)
        assert records.records[0].rising_at_start is rises


def test_inputs_of_several_ranges_give_volts(tmp_path):
    change = {"connector = 3, low_v = -0.2": "connector = 3, low_v = -1.2"}
    dry = rehearsed(tmp_path, change)
    with dry.bench as bench:
        records = bench.record_fringes(DRIVE)
    (record,) = records
    assert record.measurement.dtype == np.float32
    assert records.volts_per_code == 1.0
    assert records.full_scale is None
    assert 0.0 < record.interferometer.min() < 0.1
    assert 0.8 < record.interferometer.max() < 0.95


def test_each_record_is_handed_over_at_once(tmp_path):
    dry = rehearsed(tmp_path)
    seen = []

    def store(records):
        assert dry.laboratory.generator.output(1) is not None
        seen.append(records.records[0].name)

    with dry.bench as bench:
        last = bench.record_fringes(DRIVE, records=3, store=store)
    assert seen == ["record00", "record01", "record02"]
    assert [record.name for record in last] == ["record02"]


@pytest.mark.fault(
    name="a setting changes between two fringe records", promise="refused, parked and off"
)
def test_a_setting_that_changes_between_records_ends_it(tmp_path):
    dry = rehearsed(tmp_path)
    seen = []

    def store(records):
        seen.append(records)
        dry.laboratory.generator.feed(b"SOUR1:VOLT:OFFS 3.01\n")

    with dry.bench as bench:
        with pytest.raises(InstrumentError, match="changed the setting"):
            bench.record_fringes(DRIVE, records=3, store=store)
        assert len(seen) == 1 and dry.laboratory.generator.output(1) is None
        assert '"OUTP1:POL": "NORM"' in bench.settings


@pytest.mark.fault(name="an exception or interrupt among fringe records", promise="parked and off")
@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError])
def test_however_it_ends_the_output_is_parked_and_off(tmp_path, error):
    dry = rehearsed(tmp_path)

    def full(records):
        raise error

    with dry.bench as bench:
        with pytest.raises(error):
            bench.record_fringes(DRIVE, records=3, store=full)
        assert parked(dry)


def test_what_cannot_be_recorded_is_refused(tmp_path):
    dry = rehearsed(tmp_path)
    with dry.bench as bench:
        before = dry.sent()
        with pytest.raises(LimitError):
            bench.record_fringes(triangle(40.0, amplitude=9.0, bias=4.0)[0])
        with pytest.raises(ValueError, match="1 or more"):
            bench.record_fringes(DRIVE, records=0)
        assert dry.sent() == before
        with pytest.raises(DataError, match="memory"):
            bench.record_fringes(DRIVE, periods=400)  # 10 s at 1 MS/s, with room for 4 million
        assert parked(dry)
    plain = dry_run(read_bench(bench_file(tmp_path)))
    with (
        plain.bench as bench,
        pytest.raises(DataError, match=r"`digitizer.measurement` is missing"),
    ):
        bench.record_fringes(DRIVE)


@pytest.mark.fault(name="a bench file that does not do for ranging", promise="refused in one line")
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"[optics]": AIR.replace("0.4", "45.0")}, "relative_humidity"),
        ({"[optics]": AIR.replace("pressure_pa = 100000.0\n", "")}, "`air.pressure_pa`"),
        ({"fsr_ghz = 1.5": "fsr_ghz = 1.5\nwavelength_m = -1.0"}, "`optics.wavelength_m`"),
        ({"connector = 3": 'connector = "three"'}, "measurement.connector"),
    ],
)
def test_a_file_that_is_wrong_is_refused(tmp_path, change, says):
    with pytest.raises(DataError, match=says):
        read_bench(bench_file(tmp_path, change=change, measurement=True))
