"""The AFG31000's commands as data, and how their numbers are written.

Source: hardware tables of the AFG31000 series, basic mode. `{n}` is the channel.
"""

import math

import numpy as np

IDENTITY = r"TEKTRONIX,AFG31052,[^,]{1,64},SCPI:99\.0 FV:[^,]{1,64}"
CHANNELS = (1, 2)
UPLOAD = "DATA:DATA EMEM{n}"
POINTS = "DATA:POIN? EMEM{n}"
READ_BACK = "DATA:DATA? EMEM{n}"
SHAPE = "SOUR{n}:FUNC:SHAP"
FREQUENCY = "SOUR{n}:FREQ"
HIGH = "SOUR{n}:VOLT:LEV:IMM:HIGH"
LOW = "SOUR{n}:VOLT:LEV:IMM:LOW"
CLAMP_HIGH = "SOUR{n}:VOLT:LIM:HIGH"
CLAMP_LOW = "SOUR{n}:VOLT:LIM:LOW"
LOAD = "OUTP{n}:IMP"
OUTPUT = "OUTP{n}:STAT"
TRIGGER_OUTPUT = "OUTP:TRIG:MODE"
TRIGGER_SOURCE = "TRIG:SOUR"
ALIGN = "SOUR{n}:PHAS:INIT"
BURST_CYCLES = "SOUR{n}:BURS:NCYC"
BURST_DELAY = "SOUR{n}:BURS:TDEL"
TRIGGER = "*TRG"
REFERENCE = "ROSC:SOUR"  # clock; recorded, as either may be wanted
LARGEST_V = 10.0  # into high impedance, either sign
MOST_CYCLES = 1_000_000  # of a burst
SMALLEST_PP_V = 0.002  # into high impedance; the least that can be set


def memory_pattern(n: int) -> str:
    """What the answer to `SHAPE` looks like where channel `n` plays its own memory.

    The first memory may be named without its number, as public code for an AFG31022 expects.
    """
    return rf"(?i:EMEM(ory)?{n}{'?' if n == 1 else ''})"


def volts(value: float) -> str:
    """Volts as they are sent, in steps of 0.1 mV."""
    return f"{value:.4f}"


def hertz(value: float) -> str:
    """A frequency as it is sent, in steps of 1 uHz."""
    return f"{value:.6f}"


def ohms(value: float) -> str:
    """A load as it is sent."""
    return "INF" if math.isinf(value) else f"{value:.0f}"


def load_ratio(load_ohm: float) -> float:
    """Volts at the load for one volt into high impedance; the generator's own resistance is 50."""
    return 1.0 if math.isinf(load_ohm) else load_ohm / (load_ohm + 50.0)


def block(codes: np.ndarray) -> bytes:
    """Codes as the instrument takes them: 16 bits each, the high byte first."""
    return codes.astype(">u2").tobytes()


def codes(content: bytes) -> np.ndarray:
    """The codes in a block that was read back."""
    return np.frombuffer(content, dtype=">u2").astype(np.uint16)
