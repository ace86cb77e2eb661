"""The amplitude of the simulated generator's output in a unit that fits its shape and load."""

import math

from hardware.simulated.instruments._messages import Unit
from hardware.simulated.instruments._scpi_instrument import number, one
from hardware.simulated.instruments._status import ScpiFault

from ._output import AfgOutput
from ._shapes import volts_of_unit


def amplitude_volts(out: AfgOutput, unit: Unit) -> float:
    """The amplitude given, V peak to peak: in the channel's unit, or in the one behind the number.

    Raises `ScpiFault`.
    """
    given = one(unit).upper()
    named = next((name for name in ("VRMS", "DBM") if given.endswith(name)), None)
    if named is not None:
        unit = unit._replace(parameters=(given.removesuffix(named),))
    name = named or ("VPP" if given[-1:] in "VP" else out.unit)
    scale = volts_of_unit(name, out.shape, out.set_ohm)
    if scale is None:
        raise ScpiFault(-221, f"{name} of this shape or load")
    value = number(unit, quantity="V" if named is None else "")
    return scale[0] * (10 ** (value / 20) if scale[1] else value)


def amplitude_text(out: AfgOutput) -> str:
    """The amplitude as it is told, in the channel's unit."""
    scale = volts_of_unit(out.unit, out.shape, out.set_ohm) or (1.0, False)
    value = out.level("amplitude") / scale[0]
    return f"{20 * math.log10(value) if scale[1] else value:.4E}"
