"""Candidates in the order of their probabilities, and on which base each is judged."""

from fitting.diagnosis.base_misfit._remainder import is_beyond_hysteresis
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._candidate import Candidate
from ._excess import excess, is_unexplained
from ._forward_selection import Attribution
from ._thresholds import THRESHOLDS
from .evidence._probability import UNLISTED, Ranked
from .evidence._thresholds import THRESHOLDS as EVIDENCE

RankedCandidates = list[tuple[Candidate | None, float]]  # `None` stands for `unlisted`


def match_candidates(attribution: Attribution, ranked: Ranked) -> RankedCandidates:
    """The candidates behind the names, most probable first."""
    by_name: dict[str, Candidate | None] = {UNLISTED: None}
    by_name |= {c.name: c for c in (attribution.none, *attribution.candidates)}
    return [(by_name[name], probability) for name, probability in ranked]


def likely_candidates(attribution: Attribution, ranked: RankedCandidates) -> list[Candidate]:
    """The likeliest candidates with effects; the one that leaves least where none is likely.

    Nothing where the data need no effect: what one would predict then decides nothing.
    """
    least = THRESHOLDS.likely_probability
    likely = [c for c, p in ranked if c is not None and c.effects and p > least]
    if not likely and attribution.candidates and ranked[0][0] is not attribution.none:
        return [attribution.best]
    return likely[: THRESHOLDS.likely_candidates]


def needs_flexible_base(candidate: Candidate) -> bool:
    """Whether the identified operator, unlike the flexible base, leaves more than noise."""
    base, flexible = (
        state.synchronous - state.errors.synchronous.size
        for state in (candidate.on_base, candidate.on_flexible_base)
    )
    more = base > THRESHOLDS.flexible_base_ratio * max(flexible, 0.0)
    return is_unexplained(candidate.on_base) and more


def choose_refit(candidate: Candidate, refit: Refit, *, flexible: bool) -> tuple[Refit, State]:
    """A candidate's refit on the flexible base, or on the identified one."""
    if flexible:
        return candidate.on_flexible_operator
    return refit, candidate.on_base


def is_hidden_by_operator(candidate: Candidate, without: State, end: State) -> bool:
    """Whether an operator misfits so much that what the effect closes cannot be seen beside it.

    `without`, `end`: refits on it without the candidate's effects and with them. On a density of
    plays the effects leave no more than base misfit and chance, but on the operator, which alone
    predicts data held out, most of the excess stays, though these data were fitted.
    """
    if not candidate.refit.whitener.spectrum.measured or not candidate.effects:
        return False
    if is_beyond_hysteresis(candidate.on_flexible_base):
        return False
    return bool(excess(end) > (1.0 - EVIDENCE.least_closed) * excess(without) > 0.0)
