"""States of the generator that a scan needs, and what any other would do to it.

Another user may have left any of them. Each is asked for first and sent only where it differs: a
command that has nothing to change may be refused. Headers as in the AFG31000 series' programmer
manual, those that are `optional` as in the AFG3000 series'; `{n}` is the channel.
"""

import re
from typing import NamedTuple

OFF = r"0|(?i:OFF)"
UNDEFINED = "undefined header"


class State(NamedTuple):
    """One setting: `header`; the `value` that is sent; `answer`: a pattern of its reply.

    `otherwise`: what becomes of a scan with any other, as a sentence. `optional`: a model may not
    know the header; then it has no such mode, and the setting reads as `UNDEFINED`.
    """

    header: str
    value: str
    answer: str
    otherwise: str
    optional: bool = False

    def holds(self, answer: str) -> bool:
        """Whether an instrument that answers so is in this state, or can be in no other."""
        absent = self.optional and answer == UNDEFINED
        return absent or re.fullmatch(self.answer, answer) is not None


def _modulation(name: str, header: str) -> State:
    otherwise = f"With {name} on, something else than the loaded waveform is played."
    return State(f"SOUR{{n}}:{header}:STAT", "OFF", OFF, otherwise)


SEQUENCE = State(
    "SEQC:STAT", "OFF", OFF, "In sequence mode the instrument does not play the loaded waveform."
)
# Of both channels: either one would carry the other's changes over.
COUPLINGS = tuple(
    State(
        f"SOUR{n}:{quantity}:CONC:STAT",
        "OFF",
        OFF,
        f"Where {words} of the channels are coupled, whoever sets the other channel sets this one.",
    )
    for quantity, words in (("VOLT", "levels"), ("FREQ", "rates"))
    for n in (1, 2)
)
BURST_OFF, BURST_ON = (
    State("SOUR{n}:BURS:STAT", "OFF", OFF, "In burst mode the drive ends by itself."),
    State("SOUR{n}:BURS:STAT", "ON", r"1|(?i:ON)", "Out of burst mode the drive never ends."),
)
BURST = (
    State(
        "SOUR{n}:BURS:MODE", "TRIG", r"(?i:TRIG(GERED)?)", "A gated burst does not count periods."
    ),
    State(
        "SOUR{n}:BURS:IDLE",
        "START",
        r"(?i:START?)",
        "Before and after a burst the output rests elsewhere than at the drive's first value.",
    ),
    State("TRIG:SOUR", "EXT", r"(?i:EXT\w*)", "The internal clock starts the burst again."),
)
CONTINUOUS = (
    State(
        "SOUR{n}:FREQ:MODE",
        "CW",
        r"(?i:CW|FIX(ED)?)",
        "In a sweep the rate is another one than was set.",
    ),
    *(
        _modulation(name, header)
        for name, header in (
            ("amplitude modulation", "AM"),
            ("frequency modulation", "FM"),
            ("phase modulation", "PM"),
            ("frequency-shift keying", "FSK"),
            ("pulse-width modulation", "PWM"),
        )
    ),
    State(
        "SOUR{n}:COMB:FEED",
        '""',
        "\"\"|''",
        "With noise or an external signal added, more than the loaded waveform is played.",
        optional=True,
    ),
    BURST_OFF,
    State(
        "OUTP{n}:POL",
        "NORM",
        r"(?i:NORM(AL)?)",
        "With inverted polarity the drive is mirrored.",
    ),
    State(
        "SOUR{n}:PHAS:ADJ",
        "0",
        r"[+-]?0*\.?0*([eE][+-]?\d+)?",
        "With a phase the drive begins elsewhere in its period than the trigger says.",
    ),
)
