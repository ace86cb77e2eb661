"""The bench of instruments: what it measures, what it refuses, how it is left."""

import dataclasses

import numpy as np
import pytest
from benches import bench_file

from hardware import (
    AFG31000,
    InstrumentError,
    LabBench,
    Scpi,
    check_against_bench,
    dry_run,
    read_bench,
)
from hardware.simulated import SimulatedLink
from rapi_jax import DataError, LimitError, triangle


@pytest.fixture
def dry(tmp_path):
    return dry_run(read_bench(bench_file(tmp_path)))


def parked(dry):
    seen = dry.laboratory.generator.seen[1]
    return dry.laboratory.generator.output(1) is None and seen.relay_v <= 0.0041


def test_what_is_measured_is_what_the_laser_did(dry):
    (drive,) = triangle([40.0], amplitude=3.0, bias=3.0, periods=1)
    with dry.bench as bench:
        recording = bench.measure(drive)
    run = recording.runs[0]
    lab = dry.laboratory.laboratory
    wave = bench.channel.loaded
    truth = lab.frequency(wave, drive.time, periods=1, start_s=run.drive.start_s)
    off = run.response - truth
    assert np.nanstd(off) < 1e-3  # GHz
    assert recording.response_origin == "run"
    told = recording.provenance
    assert told["generator"].startswith("TEKTRONIX") and told["laser_tracking"] == "0"
    assert "40 Hz" in told["history"]
    assert parked(dry)
    assert dry.laboratory.generator.seen[1].high_v <= 4.51


def test_all_drives_are_checked_before_one_is_played(dry):
    good, bad = triangle([40.0], amplitude=1.0, bias=3.0), triangle([40.0], amplitude=8.0, bias=4.0)
    with dry.bench as bench:
        before = dry.sent()
        with pytest.raises(LimitError, match="drive 2 of 2"):
            bench.measure([*good, *bad])
        assert dry.sent() == before


@pytest.mark.fault(name="the interlock opens between two runs", promise="one error, parked and off")
def test_an_interlock_that_opens_ends_it_before_the_next_run(dry):
    drives = triangle([40.0, 80.0], amplitude=1.0, bias=3.0)
    with dry.bench as bench:

        def trip(number, total, what):
            dry.laboratory.laser.interlock = number == 0

        with pytest.raises(InstrumentError, match="INTERLOCK"):
            bench.measure(drives, progress=trip)
        assert len(bench.so_far) == 1 and len(bench.recording().runs) == 1
        dry.laboratory.laser.interlock = True
    assert parked(dry)


@pytest.mark.fault(
    name="the trigger is missed in the second run",
    promise="one error in time, parked and off, the first run kept",
)
def test_a_trigger_that_is_missed_ends_it_in_time(dry):
    """In the second run: the first is kept, the output parked and off."""
    drives = triangle([40.0, 80.0], amplitude=1.0, bias=3.0)
    clock = dry.links["digitizer"]
    began = []

    def pull(number, total, what):
        dry.laboratory.trigger_connected = number == 0
        began.append(clock.now())

    with dry.bench as bench:
        with pytest.raises(InstrumentError, match="No trigger came within 10") as error:
            bench.measure(drives, progress=pull)
        assert clock.now() - began[1] < 15.0  # s of the virtual clock
        assert parked(dry) and len(bench.so_far) == 1
    assert "trigger output" in str(error.value)


@pytest.mark.fault(
    name="an exception or interrupt while a drive is measured", promise="parked and off"
)
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_however_it_ends_the_output_is_parked_and_off(dry, error, monkeypatch):
    def fails(timeout_s):
        assert dry.laboratory.generator.output(1) is not None
        raise error

    with dry.bench as bench:
        monkeypatch.setattr(bench.digitizer, "fetch", fails)
        with pytest.raises(error):
            bench.measure(triangle([40.0], amplitude=1.0, bias=3.0))
        assert parked(dry)


@pytest.mark.fault(
    name="a bench file that is wrong", promise="refused in one line that names the key"
)
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"slew_v_per_s = 2000.0\n": ""}, "`limits.slew_v_per_s`: Field required"),
        ({"step_v = 0.1": "step_v = inf"}, "`limits.step_v`"),
        ({"low_v = 0.0\nhigh": "low_v = 9.0\nhigh"}, "must lie below"),
        ({"settling = 2": "settlign = 2"}, "`settlign`: no such key; is `settling` meant"),
        (
            {"slew_v_per_s = 2": "slew_vps = 2"},  # one that must be given is missing then, too
            "`limits.slew_vps`: no such key; is `slew_v_per_s` meant",
        ),
        ({"[optics]": "[optic]"}, "`optic`: no such key; is `optics` meant"),
        ({"delay_s = 2": "dealy_s = 2"}, "`optics.dealy_s`: no such key; is `delay_s` meant"),
        ({"rapi.bench/1": 'rapi.bench/1"\nxyzzy = "'}, "`xyzzy`: no such key. .* one of schema, "),
        ({'resource = "LAS"': 'resuorce = "LAS"'}, "`laser.*resuorce`: .*is `resource` meant"),
        (
            {"settling = 2": "settling = 2\namplifier = { gian = 2.0 }"},
            "`amplifier.gian`: no such key; is `gain` meant",
        ),
        (
            {'"GEN"': '"GEN"\nbackend = "/tmp/lib.so"'},
            r"`generator.*backend`: Input should be '@py'",
        ),
        ({'"GEN"': '"GEN"\nbackend = "x.so@ivi"'}, r"`generator.*backend`: Input should be '@py'"),
        ({'"DIG"': '"DIG"\nbackend = "@sim"'}, r"`digitizer.*backend`"),
        ({'"LAS"': '"LAS"\nbackend = ""'}, r"`laser.*backend`"),
        ({'resource = "LAS"': 'serial = "no number"'}, "no serial number such as SN1012"),
        ({'resource = "LAS"': ""}, "either `resource` or `serial`"),
        ({"rapi.bench/1": "rapi.bench/9"}, "`schema`"),
        ({"delay_s = 2": "delay_s = -2"}, "`optics.delay_s`"),
        ({"load_ohm = inf": "load_ohm = 0"}, "`generator.load_ohm`"),
        ({"[optics]": "[optics"}, "not valid TOML"),
        ({'resource = "DIG"': 'kind = "scope"'}, "`digitizer`: .*'infiniivision'"),
        ({'resource = "DIG"': 'kind = "replay"'}, r"`digitizer.replay.folder`: Field required"),
        ({'resource = "DIG"': 'kind = "niscope"'}, r"`digitizer.niscope.resource`"),
        ({"sample_hz = 10e6": "latency_s = -1e-6"}, "latency_s"),
        ({"settling = 2": "settling = 2\namplifier = { gain = 0.0 }"}, "must not be zero"),
    ],
)
def test_a_file_that_is_wrong_is_refused_in_one_line(tmp_path, change, says):
    path = bench_file(tmp_path, change=change)
    with pytest.raises(DataError, match=says) as failed:
        read_bench(path)
    assert "\n" not in str(failed.value) and "bench.toml" in str(failed.value)


def test_limits_hold_behind_the_amplifier(tmp_path):
    change = {"settling = 2": "settling = 2\namplifier = { gain = -2.0, offset_v = 5.0 }"}
    file = read_bench(bench_file(tmp_path, change=change))
    with dry_run(file).bench as bench:
        assert (bench.channel.limits.low_v, bench.channel.limits.high_v) == (-1.25, 2.5)
        assert bench.channel.limits.slew_v_per_s == 1000.0
    check_against_bench(triangle([40.0], amplitude=1.0, bias=1.0), file)
    with pytest.raises(LimitError):
        check_against_bench(triangle([40.0], amplitude=1.0, bias=2.4), file)


@pytest.mark.fault(
    name="a generator that reckons with 50 ohm whatever it is told",
    promise="refused, the output never on",
)
def test_a_load_that_would_double_the_voltage(dry, tmp_path):
    """A generator that reckons with 50 ohm whatever it is told."""
    generator = dry.laboratory.generator
    generator.feed(b"OUTP1:IMP 50\n")
    generator.ignores = ("OUTP1:IMP",)
    session = AFG31000(Scpi(SimulatedLink(generator)))
    with pytest.raises(InstrumentError, match="The load must be inf ohm"):
        LabBench(read_bench(bench_file(tmp_path)), session, dry.bench.digitizer, None)
    assert generator.output(1) is None and not generator.seen[1].times_on


def test_a_latency_that_is_known_is_taken_out(tmp_path):
    late = 1.5e-4
    change = {"sample_hz = 10e6": f"sample_hz = 10e6\nlatency_s = {late}"}
    dry = dry_run(read_bench(bench_file(tmp_path, change=change)))
    lab = dry.laboratory.laboratory = dataclasses.replace(dry.laboratory.laboratory, latency_s=late)
    (drive,) = triangle([40.0], amplitude=3.0, bias=3.0, periods=1)
    with dry.bench as bench:
        run = bench.measure(drive).runs[0]
        wave = bench.channel.loaded
    start_s = run.drive.start_s
    truth = lab.frequency(wave, drive.time + late, periods=1, start_s=start_s)
    assert np.nanstd(run.response - truth) < 1e-3  # GHz; 0.04 at once where it is left in
    assert np.abs(np.diff(truth)).max() > 1e-3
