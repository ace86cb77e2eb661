"""The list of single lines of the errors: tones and harmonics."""

import numpy as np

from ._harmonics import Harmonics
from ._thresholds import THRESHOLDS
from ._tones import Tone


def list_lines(
    tones: list[Tone], harmonics: list[Harmonics | None], names: list[str]
) -> list[dict[str, object]]:
    """All lines, as `maps` of a diagnosis has them: tones, then the strongest harmonics."""
    out: list[dict[str, object]] = [
        {"hz": t.hz, "amplitude": t.amplitude, "p_value": t.p_value, "locked": False} for t in tones
    ]
    synchronous = []
    for name, h in zip(names, harmonics, strict=True):
        if h is not None:
            for i in np.flatnonzero(h.significant):
                synchronous.append(
                    {
                        "hz": float(h.hertz[i]),
                        "amplitude": float(h.amplitude[i]),
                        "p_value": float(h.p_value[i]),
                        "locked": True,
                        "run": name,
                    }
                )
    synchronous.sort(key=lambda line: -line["amplitude"])
    return out + synchronous[: THRESHOLDS.most_listed_harmonics]
