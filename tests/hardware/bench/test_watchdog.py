"""A drive of counted periods: true records, and an end of its own where nobody ends it."""

import json

import numpy as np
import pytest
from benches import bench_file
from transcript import Transcript

from hardware import AFG31000, DriveLimits, InstrumentError, Scpi, dry_run, read_bench
from hardware.generator._burst import Burst
from hardware.generator._port import AfgPort
from hardware.simulated import SimulatedAFG31052, SimulatedLink
from rapi_jax import DataError, triangle

(DRIVE,) = triangle([80.0], amplitude=2.0, bias=3.0, periods=1)
LIMITS = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
STEPS = np.array([1.0, 1.2, 1.4, 1.2])


def opened(tmp_path, *, watchdog_s=3.0, points=2048, settling=2):
    head = "" if watchdog_s is None else f"watchdog_s = {watchdog_s}\n"
    change = {
        "load_ohm = inf": f"points = {points}\n{head}load_ohm = inf",
        "settling = 2": f"settling = {settling}",
    }
    return dry_run(read_bench(bench_file(tmp_path, change=change)))


def send(laboratory, message):
    assert not list(laboratory.generator.feed(message.encode() + b"\n"))


def test_a_record_is_as_true_as_one_without(tmp_path):
    """As precisely as the same drive is recorded where it goes on."""
    dry = opened(tmp_path, points=131072)
    with dry.bench as bench:
        recording = bench.measure(DRIVE)
        (run,) = recording.runs
        truth = dry.laboratory.laboratory.frequency(
            bench.channel.loaded, DRIVE.time, periods=1, start_s=run.drive.start_s
        )
    assert np.nanstd(run.response - truth) < 1e-3  # GHz
    told = json.loads(recording.provenance["run00_settings"])["generator"]
    cycles = 2 + 80.0 * (3.0 + (1 + 2 + 2 * 0.18) / 80.0)  # settling, record, wait
    assert told["SOUR1:BURS:STAT"] == "1"
    assert float(told["SOUR1:BURS:NCYC"]) == pytest.approx(cycles, abs=1.0)
    assert (told["SOUR1:BURS:IDLE"], told["TRIG:SOUR"]) == ("STAR", "EXT")
    assert float(told["SOUR1:BURS:TDEL"]) == 0.0
    seen = dry.laboratory.generator.seen[1]
    assert dry.laboratory.generator.output(1) is None and seen.relay_v <= 0.0041


@pytest.mark.fault(
    name="nothing is sent any more while the output is on, with a watchdog and without",
    promise="the output stops after its periods; without one it plays on",
)
@pytest.mark.parametrize("cycles", [1, 7, None])
def test_where_nobody_ends_it_the_output_stops_after_its_periods(cycles):
    """Nothing is sent any more: the driving side is gone."""
    link = SimulatedLink(SimulatedAFG31052())
    instrument = link._instrument
    instrument._clock = link.now
    channel = AFG31000(Scpi(link)).channel(1, limits=LIMITS)
    channel.set_watchdog(cycles)
    channel.load(STEPS, 10.0)
    channel.start()
    fired, playing = link.now(), instrument.output(1).codes
    assert np.ptp(playing.astype(int)) == 16382
    assert channel.playing_s() == (np.inf if cycles is None else pytest.approx(cycles / 10.0))
    for seconds in (0.0, 0.05, 0.5, 0.95, 3600.0):
        now = instrument.output(1, fired + seconds)
        plays = cycles is None or seconds < cycles / 10.0
        assert (now.codes == (playing if plays else playing[0])).all()
    pulses = [instrument.pulse_s(1, fired + 0.1 * k + 0.01) for k in range(8)]
    assert sum(one is not None for one in pulses) == (8 if cycles is None else max(cycles - 1, 0))
    link.sleep(3600.0)
    assert channel.playing_s() == (np.inf if cycles is None else 0.0)
    channel.off()
    seen = instrument.seen[1]
    assert instrument.output(1) is None and seen.relay_v <= 0.0041
    assert (seen.low_v, seen.high_v) == (0.0, pytest.approx(1.4))
    assert seen.jump_v <= 0.05 + 1e-9


def test_every_start_begins_anew_and_a_burst_can_be_left(tmp_path):
    with opened(tmp_path).bench as bench:
        channel = bench.channel
        channel.set_watchdog(200)
        channel.load_drive(DRIVE, points=2048)
        for _ in range(2):
            channel.start()
            assert channel.playing_s() == pytest.approx(2.5)
            bench._player._sleep(0.5)
            assert channel.playing_s() == pytest.approx(2.0)
            with pytest.raises(ValueError, match="call `off` first"):
                channel.set_watchdog(None)
            channel.off()
        channel.set_watchdog(None)
        channel.load_drive(DRIVE, points=2048)
        channel.start()
        assert channel.settings()["SOUR1:BURS:STAT"] == "0" and channel.playing_s() == np.inf


@pytest.mark.fault(
    name="another user changes a setting of the burst", promise="refused, parked and off"
)
@pytest.mark.parametrize(
    ("change", "header"),
    [
        ("SOUR1:BURS:STAT OFF", "SOUR1:BURS:STAT"),
        ("SOUR1:BURS:NCYC 3", "SOUR1:BURS:NCYC"),
        pytest.param("SOUR1:BURS:IDLE DC", "SOUR1:BURS:IDLE", marks=pytest.mark.slow),
        pytest.param("SOUR1:BURS:MODE GAT", "SOUR1:BURS:MODE", marks=pytest.mark.slow),
        pytest.param("SOUR1:BURS:TDEL 0.01", "SOUR1:BURS:TDEL", marks=pytest.mark.slow),
        pytest.param("TRIG:SOUR TIM", "TRIG:SOUR", marks=pytest.mark.slow),
    ],
)
def test_what_another_user_changes_is_refused(change, header, tmp_path, monkeypatch):
    dry = opened(tmp_path)
    with dry.bench as bench:
        inner = bench._player._sleep

        def meanwhile(seconds):
            inner(seconds)
            send(dry.laboratory, change)

        monkeypatch.setattr(bench._player, "_sleep", meanwhile)
        with pytest.raises(InstrumentError, match=header):
            bench.measure(DRIVE)
        assert dry.laboratory.generator.output(1) is None and not bench.so_far


@pytest.mark.fault(
    name="instruments so slow that the record would hold the end of the burst",
    promise="refused, parked and off",
)
@pytest.mark.parametrize("late_s", [2.5, 60.0])
def test_a_record_that_would_hold_the_end_is_refused(late_s, tmp_path, monkeypatch):
    """The instruments answer slowly: by then the drive is over, or soon will be."""
    dry = opened(tmp_path)
    with dry.bench as bench:
        inner = bench.digitizer.arm
        monkeypatch.setattr(bench.digitizer, "arm", lambda: (bench._player._sleep(late_s), inner()))
        with pytest.raises(InstrumentError, match="ends the drive too soon.*watchdog_s"):
            bench.measure(DRIVE)
        assert dry.laboratory.generator.output(1) is None


def test_a_trigger_that_never_comes_is_waited_for_no_longer_than_the_drive_plays(tmp_path):
    dry = opened(tmp_path)
    dry.laboratory.trigger_connected = False
    with dry.bench as bench, pytest.raises(InstrumentError, match="No trigger came within 2"):
        bench.measure(DRIVE)


def test_where_the_drive_stops_the_light_does(tmp_path):
    dry = opened(tmp_path)
    lab = dry.laboratory
    with dry.bench as bench:
        bench.channel.set_watchdog(2)
        bench.channel.load_drive(DRIVE, points=2048)
        bench.channel.start()
        light = lab._light(bench._player._now() + 0.001, 0.0, 40_000, 1e6)[1]
        assert np.ptp(light[12_000:12_500]) > 0.1 and np.ptp(light[12_501:]) == 0.0
        assert lab._light(bench._player._now() + 0.014, 0.0, 40_000, 1e6) is None


@pytest.mark.fault(name="more periods than the generator counts", promise="refused before output")
def test_more_periods_than_it_counts_are_refused_before_output(tmp_path):
    dry = opened(tmp_path, settling=10_000, watchdog_s=3600.0)
    (fast,) = triangle([1000.0], amplitude=0.1, bias=3.0, periods=1)
    object.__setattr__(dry.bench._file.limits, "max_frequency_hz", 1000.0)
    with dry.bench as bench, pytest.raises(DataError, match="count 3610004 periods of 1000 Hz"):
        bench.measure([DRIVE, fast])
    assert dry.laboratory.generator.seen[1].times_on == 0
    port = AfgPort(Scpi(SimulatedLink(SimulatedAFG31052())), 1)
    assert Burst(port, 3).playing_s(1.0) == 0.0


@pytest.mark.parametrize("cycles", [0, -1, 1_000_001])
def test_counts_that_it_cannot_have_are_refused(cycles, tmp_path):
    with opened(tmp_path).bench as bench, pytest.raises(ValueError, match="1 to 1000000"):
        bench.channel.set_watchdog(cycles)


def test_the_trigger_waits_for_no_end():
    """`*OPC?` behind it might be answered only when the burst is over."""
    lines = (("*TRG", None), ("*ESR?", "0"), ("SYST:ERR?", '0,"No error"'))
    with Transcript(*lines) as link:
        Burst(AfgPort(Scpi(link), 1), 5).fire()
        assert link.whole
