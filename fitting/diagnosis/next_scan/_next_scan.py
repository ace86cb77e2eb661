"""The scan proposed, with its power and the other candidates, as `diagnosis.json` has it."""

import dataclasses
from typing import Any

import numpy as np

from rapi_jax import Drive, Recording

from ._rated_scan import RatedScan
from ._rival_set import probability_left
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class NextScan:
    """A scan, what it separates, and what else was considered.

    `power`: chi-square that the wrong one of the worst pair would lose, at least; `left`: the
    probability that it would keep, of two as probable before; `None` for a scan that confirms.
    `separates`: the hypotheses of all pairs of which the wrong one keeps 5 % at most. `pairs`: for
    each ordered pair the true one, the `rival`, the `power`, whether a joint refit gave it
    (`checked`), and what is `left`. `candidates`: best first; what scans that were not refitted
    leave is scaled as with those that were. `drive`: to play.
    """

    waveform: str
    excitation_hz: float | None
    amplitude: float
    bias: float
    separates: list[str]
    power: float
    left: float | None
    pairs: list[dict[str, Any]]
    candidates: list[dict[str, Any]]
    reason: str
    drive: Drive

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for `diagnosis.json`; without the drive."""
        names = [f.name for f in dataclasses.fields(self) if f.name != "drive"]
        return {**self.candidates[0], **{name: getattr(self, name) for name in names}}


def next_scan_of(
    order: list[RatedScan], odds: dict[int, float], recording: Recording, needs: str = ""
) -> NextScan:
    """The first of `order`; `odds`: log odds of each scan, by its `id`, see `RatedScan`.

    `recording`: what was recorded so far, of which the reason has its units. `needs`: what would
    separate the rivals where the scan does not.
    """
    best = order[0]
    names = [rival.name for rival in best.rivals.rivals]
    table = [
        {
            "true": names[i],
            "rival": names[j],
            "power": best.power((i, j)),
            "checked": (i, j) in best.checked,
            "left": probability_left(best.log_odds((i, j))),
        }
        for i, j in sorted(best.first)
    ]
    least = {
        (i, j): min(best.log_odds(pair) for pair in ((i, j), (j, i)))
        for i, j in best.first
        if i < j
    }
    apart = {i for p, found in least.items() if found >= THRESHOLDS.separated_log_odds for i in p}
    listed = [
        {
            **r.candidate.to_dict(),
            "power": r.power(r.worst()),
            "checked": bool(r.checked),
            "left": probability_left(odds[id(r)]),
        }
        for r in order[: THRESHOLDS.shown]
    ]
    c = best.candidate
    return NextScan(
        waveform=c.waveform,
        excitation_hz=c.excitation_hz,
        amplitude=c.amplitude,
        bias=c.bias,
        separates=[names[i] for i in sorted(apart)],
        power=best.power(best.worst()),
        left=probability_left(best.least_log_odds()),
        pairs=table,
        candidates=listed,
        reason=_reason(best, recording, needs),
        drive=c.drive,
    )


def _reason(best: RatedScan, recording: Recording, needs: str) -> str:
    pair, scan = best.worst(), best.candidate.describe(recording.drive_unit)
    rivals = (best.rivals.rivals[i] for i in sorted(pair))
    one, other = (rival.describe(recording.response_unit) for rival in rivals)
    sigmas, left = float(np.sqrt(best.power(pair))), probability_left(best.log_odds(pair))
    if not needs:
        return (
            f"{scan} is the scan that best separates the two hypotheses that are hardest to "
            f"distinguish: {one}, and {other}. The wrong one, even refitted to all data, would "
            f"differ from this scan by {sigmas:.3g} standard deviations, and would keep a "
            f"probability of {describe_probability(left)} if both are equally probable now."
        )
    return (
        f"{scan} is the best scan within the limits, but it would not clearly separate two "
        f"hypotheses: {one}, and {other}. The wrong one, refitted to all data, would differ from "
        f"this scan by {sigmas:.2g} standard deviations. Since no effect follows its equation "
        f"exactly, it would keep a probability of {describe_probability(left)} if both are equally "
        f"probable now. {needs}."
    )


def describe_probability(left: float) -> str:
    """In percent, with two digits; it is foreseen, so roughly."""
    return "less than 0.1 %" if left < 1e-3 else f"about {100.0 * left:.2g} %"
