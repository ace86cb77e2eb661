"""The scan proposed, with its power and the other candidates, as `diagnosis.json` has it."""

import dataclasses
from typing import Any

import numpy as np

from rapi_jax import Drive

from ._candidates import Candidate
from ._rated_scan import Pair, RatedScan
from ._scan_batch import Rival
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class NextScan:
    """A scan, what it separates, and what else was considered.

    `power`: chi-square that the wrong one of the worst pair would lose, at least. `separates`: the
    hypotheses of all pairs with a power of 9 or more. `pairs`: for each ordered pair the true one,
    the `rival`, the `power`, and whether a joint refit gave it (`checked`). `candidates`: best
    first; powers of scans that were not refitted are first-order ones, scaled as those that were.
    `drive`: to play.
    """

    waveform: str
    excitation_hz: float | None
    amplitude: float
    bias: float
    separates: list[str]
    power: float
    pairs: list[dict[str, Any]]
    candidates: list[dict[str, Any]]
    reason: str
    drive: Drive

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for `diagnosis.json`; without the drive."""
        names = [f.name for f in dataclasses.fields(self) if f.name != "drive"]
        return {**self.candidates[0], **{name: getattr(self, name) for name in names}}


def next_scan_of(
    order: list[RatedScan],
    powers: dict[int, float],
    rivals: list[Rival],
    unit: str,
    needs: str = "",
) -> NextScan:
    """The first of `order`; `needs`: what would separate the rivals where it does not."""
    best, names = order[0], [rival.name for rival in rivals]
    table = [
        {
            "true": names[i],
            "rival": names[j],
            "power": best.checked.get((i, j), power),
            "checked": (i, j) in best.checked,
        }
        for (i, j), power in sorted(best.first.items())
    ]
    both = {
        (i, j): min(best.checked.get(p, best.first[p]) for p in ((i, j), (j, i)))
        for i, j in best.first
        if i < j
    }
    apart = {i for pair, power in both.items() if power >= THRESHOLDS.separated_power for i in pair}
    listed = [
        {**r.candidate.to_dict(), "power": powers[id(r)], "checked": bool(r.checked)}
        for r in order[: THRESHOLDS.shown]
    ]
    c = best.candidate
    return NextScan(
        waveform=c.waveform,
        excitation_hz=c.excitation_hz,
        amplitude=c.amplitude,
        bias=c.bias,
        separates=[names[i] for i in sorted(apart)],
        power=powers[id(best)],
        pairs=table,
        candidates=listed,
        reason=_reason(c, min(both, key=lambda p: both[p]), powers[id(best)], names, unit, needs),
        drive=c.drive,
    )


def _reason(
    candidate: Candidate, pair: Pair, power: float, names: list[str], unit: str, needs: str
) -> str:
    one, other = (names[i].replace("_", " ").replace("+", " and ") for i in pair)
    scan, sigmas = candidate.describe(unit), float(np.sqrt(power))
    if power >= THRESHOLDS.separated_power:
        return (
            f"{scan} is the scan that best tells apart the two hypotheses that are hardest to "
            f"separate, ({one}) and ({other}): even refitted, the wrong one would miss it by "
            f"{sigmas:.3g} standard deviations."
        )
    return (
        f"{scan} is the best scan within the limits, but the predictions of ({one}) and ({other}) "
        f"still differ by only {sigmas:.2g} standard deviations: {needs}."
    )
