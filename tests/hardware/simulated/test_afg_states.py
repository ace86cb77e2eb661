"""What the simulated generator plays in each state that a user may leave it in."""

import numpy as np
import pytest

from hardware.simulated import SimulatedAFG31052
from rapi_jax.internal import FULL

CODES = np.rint(np.linspace(0.0, FULL, 500)).astype(np.uint16)  # a saw: no symmetry hides a fault


def playing(*messages):
    """A generator whose channel 1 plays the saw from 0 to 2 V at 1 kHz, and then is sent these."""
    instrument = SimulatedAFG31052()
    content = CODES.astype(">u2").tobytes()
    instrument.feed(b"OUTP1:IMP INF\nDATA:DATA EMEM1,#41000" + content + b"\n")
    setup = (
        "SOUR1:FUNC EMEM1",
        "SOUR1:FREQ 1000",
        "SOUR1:VOLT:HIGH 2",
        "SOUR1:VOLT:LOW 0",
        "OUTP1 1",
    )
    for message in (*setup, *messages):
        instrument.feed(f"{message}\n".encode())
    return instrument


def periods(codes):
    """How often the saw falls back."""
    return int((np.diff(codes.astype(int)) < -FULL // 2).sum())


def test_as_it_is():
    wave = playing().output(1)
    assert (wave.codes == CODES).all()
    assert (wave.low_v, wave.high_v, wave.frequency_hz) == (0.0, 2.0, 1000.0)


def test_inverted_polarity_mirrors():
    wave = playing("OUTP1:POL INV").output(1)
    assert wave.volts == pytest.approx(2.0 - playing().output(1).volts)


def test_a_phase_begins_elsewhere():
    assert (playing("SOUR1:PHAS 90DEG").output(1).codes == np.roll(CODES, -125)).all()


def test_frequency_shift_keying_plays_two_rates():
    instrument = playing("SOUR1:FSK:FREQ 3000", "SOUR1:FSK:INT:RATE 100", "SOUR1:FSK:STAT ON")
    wave = instrument.output(1)
    assert wave.frequency_hz == pytest.approx(100.0)
    half = wave.codes.size // 2
    assert np.diff([0, periods(wave.codes[:half]), periods(wave.codes)]) == pytest.approx(
        [5, 15], abs=1
    )
    assert instrument.seen[1].fastest_hz == 3000.0


def test_a_sweep_goes_through_all_rates():
    sweep = "SOUR1:FREQ:STAR 100", "SOUR1:FREQ:STOP 300", "SOUR1:SWE:TIME 1"
    instrument = playing(*sweep, "SOUR1:FREQ:MODE SWE")
    assert periods(instrument.output(1).codes) == pytest.approx(200, abs=1)
    assert instrument.seen[1].fastest_hz == 1000.0  # before


def test_a_burst_rests_after_its_cycles():
    wave = playing("SOUR1:BURS:NCYC 3", "SOUR1:BURS ON").output(1)
    assert periods(wave.codes) == 3 and (wave.codes[wave.codes.size // 2 + 10 :] == 0).all()


def test_amplitude_modulation_shrinks():
    wave = playing("SOUR1:AM 100PCT", "SOUR1:AM:INT:FREQ 10", "SOUR1:AM:STAT ON").output(1)
    size = wave.codes.size
    assert np.ptp(wave.codes[size // 4 - size // 50 : size // 4 + size // 50].astype(int)) > 16000
    assert np.ptp(wave.codes[3 * size // 4 - size // 50 :][: size // 25].astype(int)) < 300


@pytest.mark.parametrize("name", ["FM", "PM"])
def test_frequency_and_phase_modulation_move_the_periods(name):
    modulated = playing(f"SOUR1:{name}:INT:FREQ 100", f"SOUR1:{name}:STAT ON").output(1)
    assert periods(modulated.codes) == pytest.approx(10, abs=1)
    falls = np.flatnonzero(np.diff(modulated.codes.astype(int)) < -FULL // 2)
    assert np.ptp(np.diff(falls)) > 0.1 * np.diff(falls).mean()


def test_coupled_levels_and_rates_are_carried_over():
    instrument = playing("OUTP2:IMP INF", "SOUR1:VOLT:CONC ON", "SOUR1:FREQ:CONC ON")
    for message in ("SOUR2:VOLT:OFFS 3", "SOUR2:FREQ 5000"):
        instrument.feed(f"{message}\n".encode())
    wave = instrument.output(1)
    assert (wave.low_v, wave.high_v, wave.frequency_hz) == (2.0, 4.0, 5000.0)
    instrument.feed(b"SOUR1:VOLT:CONC OFF\nSOUR2:VOLT:OFFS 1\n")
    assert instrument.output(1).low_v == 2.0


def test_amplitude_and_offset_set_the_levels():
    wave = playing("SOUR1:VOLT 1", "SOUR1:VOLT:OFFS 2.5").output(1)
    assert (wave.low_v, wave.high_v) == (2.0, 3.0)


@pytest.mark.parametrize("given", ["'NOISe'", '"NOIS"', '"BOTH"'])
def test_noise_is_added_in_the_share_that_is_set(given):
    quiet = playing().output(1).codes.astype(float)
    for share in (1, 5):
        wave = playing(f"SOUR1:POW {share}PCT", f"SOUR1:COMB:FEED {given}").output(1)
        noise = np.ptp(wave.codes - quiet)
        assert noise == pytest.approx(share / 100 * FULL, rel=0.5)


def test_of_an_external_signal_that_is_not_connected_nothing_comes():
    instrument = playing('SOUR1:COMB:FEED "EXTernal"')
    np.testing.assert_array_equal(instrument.output(1).codes, CODES)
    assert instrument.feed(b"SOUR1:COMB:FEED?\n")[0].data == b'"EXT"\n'
    assert instrument.feed(b'SOUR1:COMB:FEED "";:SOUR1:COMB:FEED?\n')[0].data == b'""\n'
    assert instrument.feed(b'SOUR1:COMB:FEED "CH2"\nSYST:ERR?\n')[0].data.startswith(b"-224")


def test_sequence_mode_plays_something_else():
    assert not np.array_equal(playing("SEQC ON").output(1).codes, CODES)


def test_a_reset_ends_all_of_it():
    instrument = playing(
        "OUTP1:POL INV", "SOUR1:VOLT:CONC ON", "SEQC ON", "SOUR1:AM:STAT ON", "*RST"
    )
    asked = b"OUTP1:POL?;:SOUR1:VOLT:CONC?;:SEQC?;:SOUR1:AM:STAT?;:OUTP1?\n"
    assert instrument.feed(asked)[0].data == b"NORM;0;0;0;0\n"
