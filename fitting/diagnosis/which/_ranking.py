"""Candidates in the order of their probabilities."""

from ._candidate import Candidate
from ._forward_selection import Attribution
from ._thresholds import THRESHOLDS
from .evidence._probability import UNLISTED, Ranked

RankedCandidates = list[tuple[Candidate | None, float]]  # `None` stands for `unlisted`


def match_candidates(attribution: Attribution, ranked: Ranked) -> RankedCandidates:
    """The candidates behind the names, most probable first."""
    by_name: dict[str, Candidate | None] = {UNLISTED: None}
    by_name |= {c.name: c for c in (attribution.none, *attribution.candidates)}
    return [(by_name[name], probability) for name, probability in ranked]


def likely_candidates(attribution: Attribution, ranked: RankedCandidates) -> list[Candidate]:
    """The likeliest candidates with effects; where what is left has no name, the best of all."""
    least = THRESHOLDS.likely_probability
    likely = [c for c, p in ranked if c is not None and c.effects and p > least]
    if not likely and attribution.candidates and ranked[0][0] is None:
        return [attribution.best]
    return likely[: THRESHOLDS.likely_candidates]
