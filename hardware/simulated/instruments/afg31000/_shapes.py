"""Built-in waveforms of the simulated generator: one period as codes."""

import math

import numpy as np

from rapi_jax.internal import FULL

_CYCLE = np.linspace(0.0, 1.0, 1000, endpoint=False)
# Volts peak to peak for one volt rms, by shape; none for others.
_PP_OF_RMS = {"SIN": 2 * math.sqrt(2), "SQU": 2.0, "PULS": 2.0, "RAMP": 2 * math.sqrt(3)}
SHAPES = ("SINusoid", "SQUare", "PULSe", "RAMP", "DC")


def built_in(shape: str, symmetry: float, duty: float) -> np.ndarray:
    """Codes of a period, shape `time`. `symmetry`: the share of a ramp that rises, 0 to 1.

    `duty`: the share of a pulse that is high, 0 to 1.
    """
    if shape == "RAMP":
        up = _CYCLE / symmetry if symmetry > 0 else np.inf
        down = (1 - _CYCLE) / (1 - symmetry) if symmetry < 1 else np.inf
        return np.rint(FULL * np.clip(np.minimum(up, down), 0.0, 1.0)).astype(np.uint16)
    if shape in ("SQU", "PULS"):
        return np.where(_CYCLE < (duty if shape == "PULS" else 0.5), FULL, 0).astype(np.uint16)
    if shape == "DC":
        return np.full(_CYCLE.size, FULL // 2, np.uint16)
    return np.rint(FULL / 2 * (1 + np.sin(2 * np.pi * _CYCLE))).astype(np.uint16)


def volts_of_unit(unit: str, shape: str, load_ohm: float) -> tuple[float, bool] | None:
    """Volts peak to peak of one unit of amplitude, and whether the unit is logarithmic.

    `None` where the instrument has no such unit for this shape or load.
    """
    if unit == "VPP":
        return 1.0, False
    if shape not in _PP_OF_RMS:
        return None
    if unit == "VRMS":
        return _PP_OF_RMS[shape], False
    if math.isinf(load_ohm):
        return None
    return _PP_OF_RMS[shape] * math.sqrt(1e-3 * load_ohm), True  # of 0 dBm
