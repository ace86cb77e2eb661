"""States of the oscilloscope that a record needs; each is sent, and read back as it is written.

Another user may have left any other: inverted or averaged inputs, a filter, another trigger. After
the programmer's guides of the series.
"""

ACQUISITION = {
    ":ACQ:MODE": "RTIM",  # every sample of one trigger; none from several
    ":ACQ:TYPE": "NORM",  # neither averages nor peaks
    ":TIM:MODE": "MAIN",
    ":TIM:REF": "LEFT",  # one division from the left
}
INPUT = {  # `{n}`: the connector
    ":CHAN{n}:DISP": "1",
    ":CHAN{n}:COUP": "DC",
    ":CHAN{n}:INV": "0",
    ":CHAN{n}:BWL": "0",
    ":CHAN{n}:UNIT": "VOLT",
}
TRIGGER = {
    ":TRIG:MODE": "EDGE",
    ":TRIG:EDGE:SOUR": "EXT",
    ":TRIG:EDGE:SLOP": "POS",
    ":TRIG:EDGE:COUP": "DC",
    ":TRIG:EDGE:REJ": "OFF",
    ":TRIG:HFR": "0",
    ":TRIG:NREJ": "0",
    ":TRIG:SWE": "NORM",  # no record without a trigger
}
HOLDOFF_S = 60e-9  # the shortest of the series


def of_input(connector: int) -> dict[str, str]:
    """`INPUT` for one connector."""
    return {header.format(n=connector): value for header, value in INPUT.items()}
