"""What another user may leave the instruments in, and change during a scan.

Each must be refused, undone, or recorded truly. What came of it is judged by what the load of the
generator saw and by what is in the recording, not by what the driver says.
"""

import json
import re

import numpy as np
import pytest
from benches import bench_file

from hardware import (
    Acquisition,
    InfiniiVision,
    Input,
    InstrumentError,
    Scpi,
    dry_run,
    read_bench,
)
from hardware.bench import _open
from hardware.simulated import SimulatedInfiniiVision, SimulatedLink, WiredLaboratory
from rapi_jax import DataError, triangle

(DRIVE,) = triangle([80.0], amplitude=2.0, bias=3.0, periods=1)
INPUTS = {"interferometer": Input(1, -0.2, 1.2), "cavity": Input(2, -0.2, 1.2)}
ASKED = Acquisition(INPUTS, 1e-3, 1e-2)
GENERATOR, SCOPE, LASER = "generator", "digitizer", "laser"

# What was sent before the bench was opened: each is undone.
LEFT = {
    "inverted polarity": (GENERATOR, "OUTP1:POL INV"),
    "a phase": (GENERATOR, "SOUR1:PHAS:ADJ 1.5708"),
    "a sweep": (GENERATOR, "SOUR1:FREQ:MODE SWE"),
    "a burst": (GENERATOR, "SOUR1:BURS:STAT ON"),
    "amplitude modulation": (GENERATOR, "SOUR1:AM:STAT ON"),
    "frequency modulation": (GENERATOR, "SOUR1:FM:STAT ON"),
    "phase modulation": (GENERATOR, "SOUR1:PM:STAT ON"),
    "frequency-shift keying": (GENERATOR, "SOUR1:FSK:FREQ 1E6\nSOUR1:FSK:STAT ON"),
    "pulse-width modulation": (GENERATOR, "SOUR1:PWM:STAT ON"),
    "noise added": (GENERATOR, 'SOUR1:COMB:FEED "NOISe"'),
    "an external signal added": (GENERATOR, 'SOUR1:COMB:FEED "EXTernal"'),
    "coupled levels": (GENERATOR, "SOUR1:VOLT:CONC ON"),
    "coupled levels, by channel 2": (GENERATOR, "SOUR2:VOLT:CONC ON"),
    "coupled rates": (GENERATOR, "SOUR1:FREQ:CONC ON"),
    "coupled rates, by channel 2": (GENERATOR, "SOUR2:FREQ:CONC ON"),
    "sequence mode": (GENERATOR, "SEQC:STAT ON"),
    "sequence mode, with the output on": (GENERATOR, "SEQC:STAT ON\nOUTP1 ON"),
    "a load of 50 ohm": (GENERATOR, "OUTP1:IMP 50"),
    "another memory": (GENERATOR, "SOUR1:FUNC EMEM2"),
    "a sine at 1 MHz, with the output on": (GENERATOR, "SOUR1:FUNC SIN\nOUTP1 ON"),
    "levels by amplitude and offset": (GENERATOR, "SOUR1:VOLT 0.5\nSOUR1:VOLT:OFFS 1"),
    "a unit of dBm": (GENERATOR, "SOUR1:VOLT:UNIT DBM"),
    "an external trigger": (GENERATOR, "TRIG:SOUR EXT"),
    "a narrow clamp": (GENERATOR, "SOUR1:VOLT:LIM:HIGH 0.6\nSOUR1:VOLT:LIM:LOW -0.6"),
    "an inverted input": (SCOPE, ":CHAN1:INV 1"),
    "an input coupled by AC": (SCOPE, ":CHAN1:COUP AC"),
    "averages": (SCOPE, ":ACQ:TYPE AVER"),
    "high resolution": (SCOPE, ":ACQ:TYPE HRES"),
    "segments": (SCOPE, ":ACQ:MODE SEGM"),
    "a roll": (SCOPE, ":TIM:MODE ROLL"),
    "a reference at the right": (SCOPE, ":TIM:REF RIGH"),
    "a trigger at an input": (SCOPE, ":TRIG:EDGE:SOUR CHAN2"),
    "a falling edge": (SCOPE, ":TRIG:EDGE:SLOP NEG"),
    "no trigger needed": (SCOPE, ":TRIG:SWE AUTO"),
    "a holdoff": (SCOPE, ":TRIG:HOLD 1"),
    "a probe of 10": (SCOPE, ":CHAN1:PROB 10"),
    "a skew": (SCOPE, ":CHAN1:PROB:SKEW 1E-7"),
    "a trigger probe of 10": (SCOPE, ":EXT:PROB 10"),
    "tracking": (LASER, "OUTPut:TRACk 1"),
    "a scan of the motor": (LASER, "OUTPut:SCAN:START"),
    "a wavelength by voltage": (LASER, "SYSTem:WINPut 1"),
}

# What is sent while the drive settles, or while the record is taken: each is refused.
CHANGED = {
    "inverted polarity": (GENERATOR, "OUTP1:POL INV", "OUTP1:POL"),
    "a phase": (GENERATOR, "SOUR1:PHAS:ADJ 1", "SOUR1:PHAS:ADJ"),
    "another rate": (GENERATOR, "SOUR1:FREQ 81", "SOUR1:FREQ"),
    "a rate a little off": (GENERATOR, "SOUR1:FREQ 80.001", "SOUR1:FREQ"),
    "a smaller amplitude": (GENERATOR, "SOUR1:VOLT 1", "SOUR1:VOLT:LEV:IMM:LOW"),
    "another offset": (GENERATOR, "SOUR1:VOLT:OFFS 3.1", "SOUR1:VOLT:LEV:IMM:LOW"),
    "a high level a step off": (GENERATOR, "SOUR1:VOLT:HIGH 4.001", "SOUR1:VOLT:LEV:IMM:HIGH"),
    "a wider clamp": (GENERATOR, "SOUR1:VOLT:LIM:HIGH 9", "SOUR1:VOLT:LIM:HIGH"),
    "another load": (GENERATOR, "OUTP1:IMP 10000", "OUTP1:IMP"),
    "frequency-shift keying": (GENERATOR, "SOUR1:FSK:STAT ON", "SOUR1:FSK:STAT"),
    "a sweep": (GENERATOR, "SOUR1:FREQ:MODE SWE", "SOUR1:FREQ:MODE"),
    "noise added": (GENERATOR, "SOUR1:COMB:FEED 'NOIS'", "SOUR1:COMB:FEED"),
    "an external signal added": (GENERATOR, 'SOUR1:COMB:FEED "EXT"', "SOUR1:COMB:FEED"),
    "a burst": (GENERATOR, "SOUR1:BURS:STAT ON", "SOUR1:BURS:STAT"),
    "channel 2, coupled": (
        GENERATOR, "SOUR2:FREQ:CONC ON\nSOUR2:FREQ 1E6", "SOUR2:FREQ:CONC:STAT",
    ),
    "channel 2, with coupled levels": (
        GENERATOR, "OUTP2:IMP INF\nSOUR1:VOLT:CONC ON\nSOUR2:VOLT:OFFS 5", "SOUR1:VOLT:CONC:STAT",
    ),
    "channel 2, with coupled levels that it cannot follow": (
        GENERATOR, "SOUR1:VOLT:CONC ON\nSOUR2:VOLT:OFFS 5", "SOUR1:VOLT:CONC:STAT",
    ),
    "sequence mode": (GENERATOR, "SEQC:STAT ON", "SEQC:STAT"),
    "another shape": (GENERATOR, "SOUR1:FUNC RAMP", "SOUR1:FUNC:SHAP"),
    "a shorter memory": (GENERATOR, "DATA:DATA EMEM1,#14\0\0\x3f\xfe", "DATA:POIN"),
    "the output off": (GENERATOR, "OUTP1 OFF", "OUTP1:STAT|No trigger"),
    "another clock": (GENERATOR, "ROSC:SOUR EXT", "ROSC:SOUR"),
    "another trigger output": (GENERATOR, "OUTP:TRIG:MODE SYNC", "OUTP:TRIG:MODE"),
    "another range": (SCOPE, ":CHAN1:RANG 8", "CHAN1:RANG"),
    "another offset of an input": (SCOPE, ":CHAN2:OFFS 0.1", "CHAN2:OFFS"),
    "an inverted input": (SCOPE, ":CHAN1:INV 1", "CHAN1:INV"),
    "an input of 50 ohm": (SCOPE, ":CHAN1:IMP FIFT", "CHAN1:IMP"),
    "averages": (SCOPE, ":ACQ:TYPE AVER", "ACQ:TYPE"),
    "another time base": (SCOPE, ":TIM:POS 0.001", "TIM:POS|about the trigger"),
    "another trigger": (SCOPE, ":TRIG:EDGE:SOUR LINE", "TRIG:EDGE:SOUR"),
    "another trigger level": (SCOPE, ":TRIG:EDGE:LEV 1", "TRIG:EDGE:LEV"),
    "the piezo": (LASER, "SOURce:VOLTage:PIEZo 60", "piezo_set_percent"),
    "the current": (LASER, "SOURce:CURRent:DIODe 100", "current_set_ma"),
    "the laser off": (LASER, "OUTPut:STATe 0", "emits"),
    "tracking": (LASER, "OUTPut:TRACk 1", "OUTPut:TRACk"),
    "a scan of the motor": (LASER, "OUTPut:SCAN:START", "[*]OPC"),
    "the front panel": (LASER, "SYSTem:MCONtrol LOC", "remote"),
}  # fmt: skip
WHILE_READ = (
    "inverted polarity", "a rate a little off", "another offset", "a high level a step off",
    "frequency-shift keying", "channel 2, coupled", "a shorter memory", "the output off",
    "another range", "another offset of an input", "another time base", "the piezo",
    "the laser off",
)  # fmt: skip


def send(laboratory, family, message):
    """Another user's command, beside the bench's own connection."""
    instrument = {
        GENERATOR: laboratory.generator, SCOPE: laboratory.oscilloscope, LASER: laboratory.laser,
    }[family]  # fmt: skip
    for line in message.split("\n"):
        for _ in instrument.feed(line.encode("latin-1") + b"\n"):
            pass


def opened(tmp_path, monkeypatch, *left, points=131072):
    """A dry run whose instruments were left in some state before they are opened."""

    class Left(WiredLaboratory):
        def __init__(self, *args, **named):
            super().__init__(*args, **named)
            for family, message in left:
                send(self, family, message)
            self.generator.seen[1].fastest_hz = 0.0

    monkeypatch.setattr(_open, "WiredLaboratory", Left)
    change = {"load_ohm = inf": f"points = {points}\nload_ohm = inf"}
    return dry_run(read_bench(bench_file(tmp_path, change=change)))


def off_by(dry, run):
    """Rms of the recorded response against what the laser did for the drive asked for, GHz."""
    lab, wave = dry.laboratory.laboratory, dry.bench.channel.loaded
    truth = lab.frequency(wave, DRIVE.time, periods=1, start_s=run.drive.start_s)
    off = run.response - truth
    return np.nanstd(off)


@pytest.mark.fault(
    name="a state that another user has left an instrument in", promise="undone before output"
)
@pytest.mark.parametrize("state", LEFT)
def test_what_another_user_has_left_is_undone(state, tmp_path, monkeypatch):
    """After it the instruments are as ones that nobody has touched."""
    dry = opened(tmp_path, monkeypatch, LEFT[state], points=2048)
    with dry.bench as bench:
        bench.digitizer.configure(ASKED)
        bench.channel.load_drive(DRIVE, points=2048)
        bench.channel.start()
        played, loaded = dry.laboratory.generator.output(1), bench.channel.loaded
        assert (played.codes == loaded.codes).all()
        assert played.frequency_hz == loaded.frequency_hz == 80.0
        assert (played.low_v, played.high_v) == (loaded.low_v, loaded.high_v) == (2.0, 4.0)
        fresh = SimulatedInfiniiVision(lambda *asked: None)
        InfiniiVision(Scpi(SimulatedLink(fresh))).configure(ASKED)
        scope = dry.laboratory.oscilloscope
        assert vars(scope.states) == vars(fresh.states)
        assert (scope.first_s, scope.sample_hz) == (fresh.first_s, fresh.sample_hz)
        laser = dry.laboratory.laser
        assert not laser.tracking and not any(laser.flags.values()) and bench.laser.settings()
        at_nm = laser.wavelength()
        bench._player._sleep(1.0)
        assert laser.wavelength() == at_nm
    seen = dry.laboratory.generator.seen[1]
    if "output on" not in state:  # else it was on before, with 1 MHz
        assert seen.low_v >= -0.0001 and seen.high_v <= 4.01
        assert seen.fastest_hz <= 80.0 + 1e-9 and seen.relay_v <= 0.0041


def test_all_of_it_at_once_leaves_the_recording_true(tmp_path, monkeypatch):
    dry = opened(tmp_path, monkeypatch, *LEFT.values())
    with dry.bench as bench:
        recording = bench.measure(DRIVE)
        assert off_by(dry, recording.runs[0]) < 1e-3  # GHz


@pytest.mark.fault(
    name="another user changes a setting while a drive settles or is recorded",
    promise="refused by the setting's name, parked and off, nothing kept",
)
@pytest.mark.parametrize(
    ("when", "change"),
    [("settling", change) for change in CHANGED] + [("record", change) for change in WHILE_READ],
)
def test_what_another_user_changes_meanwhile_is_refused(when, change, tmp_path, monkeypatch):
    family, message, header = CHANGED[change]
    dry = opened(tmp_path, monkeypatch, points=2048)
    with dry.bench as bench:
        place = (bench._player, "_sleep") if when == "settling" else (bench.digitizer, "arm")
        inner = getattr(*place)

        def meanwhile(*args):
            assert dry.laboratory.generator.output(1) is not None
            inner(*args)
            send(dry.laboratory, family, message)

        monkeypatch.setattr(*place, meanwhile)
        with pytest.raises((InstrumentError, DataError), match=header):
            bench.measure(DRIVE)
        assert dry.laboratory.generator.output(1) is None and not bench.so_far


def test_what_is_recorded_tells_every_setting(tmp_path, monkeypatch):
    """A clock from outside and an input of 50 ohm may be wanted: they are kept, and told."""
    left = (GENERATOR, "ROSC:SOUR EXT"), (SCOPE, ":CHAN1:IMP FIFT"), (GENERATOR, "OUTP1:POL INV")
    dry = opened(tmp_path, monkeypatch, *left)
    with dry.bench as bench:
        recording = bench.measure(DRIVE)
    told = json.loads(recording.provenance["run00_settings"])
    assert told[GENERATOR]["ROSC:SOUR"] == "EXT" and told[SCOPE]["CHAN1:IMP"] == "FIFT"
    assert told[GENERATOR]["OUTP1:POL"] == "NORM" and told[GENERATOR]["DATA:POIN EMEM1"] == "131072"
    assert float(told[GENERATOR]["SOUR1:VOLT:LEV:IMM:HIGH"]) == 4.0
    assert told[LASER]["tracking"] == "0" and told[LASER]["piezo_set_percent"] == "50.00"
    assert re.search("OUTP1:POL", recording.provenance["generator_undone"])


@pytest.mark.fault(
    name="another user plays a sequence on the other channel", promise="refused, nothing set"
)
def test_a_sequence_on_the_other_channel_is_left_alone(tmp_path, monkeypatch):
    left = (GENERATOR, "SEQC:STAT ON\nOUTP2 ON")
    with pytest.raises(InstrumentError, match="plays a sequence on channel 2"):
        opened(tmp_path, monkeypatch, left)


def test_the_other_channel_keeps_its_levels(tmp_path, monkeypatch):
    dry = opened(tmp_path, monkeypatch, (GENERATOR, "SOUR1:VOLT:CONC ON\nOUTP2 ON"))
    with dry.bench as bench:
        bench.measure(DRIVE)
    seen = dry.laboratory.generator.seen[2]
    assert (seen.low_v, seen.high_v, seen.jump_v) == (-1.0, 1.0, 0.0)  # as it was left
    assert dry.laboratory.generator.output(2) is not None


def test_between_two_runs_a_change_is_undone_too(tmp_path, monkeypatch):
    dry = opened(tmp_path, monkeypatch)
    with dry.bench as bench:
        bench.measure(DRIVE)
        send(dry.laboratory, GENERATOR, "OUTP1:POL INV\nSOUR1:AM:STAT ON\nSOUR1:VOLT:CONC ON")
        recording = bench.measure(DRIVE)
        assert off_by(dry, recording.runs[0]) < 1e-3
        assert "SOUR1:AM:STAT" in recording.provenance["generator_undone"]


@pytest.mark.fault(
    name="an output that a killed process left on", promise="told with what it played, parked, off"
)
@pytest.mark.parametrize("on", [True, False])
def test_an_output_that_was_found_on_is_said_with_what_it_played(on, tmp_path, monkeypatch):
    """As a process that was killed outright leaves it: parked, off, and in the provenance."""
    left = "OUTP1:IMP INF\nSOUR1:FREQ 40\nSOUR1:VOLT:HIGH 4\nSOUR1:VOLT:LOW 1" + "\nOUTP1 ON" * on
    with opened(tmp_path, monkeypatch, (GENERATOR, left), points=64).bench as bench:
        assert bench.channel.found_on == ("1 to 4 V at 40 Hz" if on else "")
        said = bench.provenance().get("generator_found_on")
        assert said == ("1 to 4 V at 40 Hz; it was parked and switched off" if on else None)
