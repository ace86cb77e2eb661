"""A model of the series that does not know a setting has no such mode; a silent one is refused."""

import numpy as np
import pytest

from hardware import AFG31000, DriveLimits, InstrumentError, Scpi
from hardware.simulated import Faulty, Silent, SimulatedAFG31052, SimulatedLink

LIMITS = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
WAVE = np.array([1.0, 1.2, 1.4, 1.2])
QUERY = "SOUR1:COMB:FEED?"


def played(instrument, peer=None, timeout_s=1.0):
    """Settings of a channel that plays `WAVE`, and how long it took, s."""
    link = SimulatedLink(peer or instrument)
    with AFG31000(Scpi(link, timeout_s=timeout_s)) as afg:
        began = link.now()
        channel = afg.channel(1, limits=LIMITS)
        channel.load(WAVE, 10.0)
        channel.start()
        assert instrument.output(1) is not None
        settings = channel.settings()
        channel.off()
        return settings, link.now() - began


@pytest.mark.fault(
    name="a generator whose model does not know the adding of noise",
    promise="tried once, the scan goes on, the recording says so",
)
def test_a_header_that_a_model_does_not_know_costs_one_deadline():
    known, quick = played(SimulatedAFG31052())
    unknown, slow = played(SimulatedAFG31052(lacks=(QUERY,)))
    assert known.pop("SOUR1:COMB:FEED") == '""'
    assert unknown.pop("SOUR1:COMB:FEED") == "undefined header"
    assert known == unknown
    assert slow - quick == pytest.approx(1.0, abs=0.2)


def test_a_header_that_all_know_must_be_answered():
    with pytest.raises(InstrumentError, match="OUTP1:POL"):
        played(SimulatedAFG31052(lacks=("OUTP1:POL?",)))


@pytest.mark.fault(
    name="no answer about the adding of noise, and no error either",
    promise="one error within twice the deadline, the output never on",
)
def test_silence_alone_does_not_say_that_a_header_is_unknown():
    instrument = SimulatedAFG31052()
    with pytest.raises(InstrumentError, match="no answer"):
        played(instrument, Faulty(instrument, Silent(), when=QUERY.encode()))
    assert instrument.seen[1].times_on == 0


def test_an_unknown_header_leaves_neither_error_nor_status_behind():
    scpi = Scpi(SimulatedLink(SimulatedAFG31052(lacks=(QUERY,))))
    assert scpi.text_if_known(QUERY) is None
    assert scpi.text_if_known("SOUR2:COMB:FEED?") == '""'
    scpi.command("SOUR1:FREQ 20")
    assert scpi.number("SOUR1:FREQ?") == 20.0
