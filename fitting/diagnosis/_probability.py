"""How probable each hypothesis is: none, each effect, pairs, and `unlisted`."""

import dataclasses

import numpy as np

from ._attribute import Attribution, excess
from ._candidates import Candidate


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Numbers that turn chi-squares into probabilities, and where they come from.

    - `temperature`: differences of log evidence are divided by it, and by `form` times the excess
      at stake between two hypotheses besides: no effect is quite as its equation says.
    - `parameter`: log evidence that one more parameter costs, in units of the logarithm of the
      number of lines, halved.
    - `chance`: log evidence that one more effect costs, for the search over its trials.
    - `left`: share of the excess that the right effects leave at most; `left_width`: how sharply.
    - `left_unknown`, `left_unknown_width`: the same where no run repeats, so that noise is unknown.
    - `closed`, `closed_width`: share of the gap on data held out that the right effects close.
    - `misfit`: chi-square a locked line that a base may leave; `misfit_loose`: the same of what
      does not repeat; `misfit_unknown`: the same where noise is unknown; `misfit_width`: how
      sharply, in the same unit.
    """

    temperature: float = 4.0
    form: float = 1e-3
    parameter: float = 1.0
    chance: float = 20.0
    left: float = 0.012
    left_width: float = 0.002
    closed: float = 0.965
    closed_width: float = 0.01
    left_unknown: float = 0.5
    left_unknown_width: float = 0.08
    misfit: float = 0.3
    misfit_loose: float = 0.05
    misfit_unknown: float = 1.5
    misfit_width: float = 0.04
    provenance: str = "set by hand on one simulated device of the model's own class, no bank"


CALIBRATION = Calibration()


def _logistic(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -50.0, 50.0))))


def remains(best: Candidate, none: Candidate, noise_known: bool, calibration: Calibration) -> float:
    """Probability that what the best hypothesis leaves is more than noise and base misfit."""
    state = best.rich
    lines, loose = state.errors.locked.size, max(state.errors.loose.size, 1)
    chance, chance_loose = (3.0 * np.sqrt(2.0 / n) for n in (lines, loose))
    over = max(
        (state.locked / lines - 1.0 - calibration.misfit - chance) / calibration.misfit_width,
        (state.loose / loose - 1.0 - calibration.misfit_loose - chance_loose)
        / (calibration.misfit_width / 5.0)
        if state.errors.loose.size
        else -np.inf,
    )
    before = excess(none.rich)
    share = excess(state) / before if before > 0 else 0.0
    if not noise_known:  # then all that is left may be noise, and only a poor share tells
        poor = _logistic((share - calibration.left_unknown) / calibration.left_unknown_width)
        more = state.locked / lines - 1.0 - calibration.misfit_unknown
        return poor * _logistic(more / (5.0 * calibration.misfit_width))
    closed = (share - calibration.left) / calibration.left_width
    return _logistic(over) * _logistic(closed)


def probabilities(
    attribution: Attribution, *, noise_known: bool = True, calibration: Calibration = CALIBRATION
) -> list[tuple[Candidate | None, float]]:
    """Each hypothesis with its probability, most probable first; `None` stands for `unlisted`."""
    all_of = [attribution.none, *attribution.candidates]
    best = attribution.best if attribution.best.cost < attribution.none.cost else attribution.none
    state = best.rich
    lines, loose = state.errors.locked.size, max(state.errors.loose.size, 1)
    # Where the base misfits, its misfit is noise of that size to every comparison.
    wide = max(1.0, state.locked / lines)
    wide_loose = max(1.0, state.loose / loose)
    each = calibration.parameter * np.log(lines + loose)
    log = np.array(
        [
            -0.5
            * (c.rich.locked / wide + c.rich.loose / wide_loose + c.rich.prior + each * c.count)
            - calibration.chance * len(c.effects)
            for c in all_of
        ]
    )
    first = all_of[int(np.argmax(log))]
    doubt = np.array(
        [calibration.temperature + calibration.form * _at_stake(c, first, all_of) for c in all_of]
    )
    weight = np.exp((log - log.max()) / doubt)
    weight /= weight.sum()
    top = all_of[int(np.argmax(weight))]
    unlisted = remains(top, attribution.none, noise_known, calibration)
    out: list[tuple[Candidate | None, float]] = [
        (c, float(w * (1.0 - unlisted))) for c, w in zip(all_of, weight, strict=True)
    ]
    out.append((None, unlisted))
    return sorted(out, key=lambda pair: -pair[1])


def credited(
    hypotheses: list[tuple[Candidate | None, float]],
    closed: dict[str, float] | None,
    calibration: Calibration = CALIBRATION,
) -> list[tuple[Candidate | None, float]]:
    """The same once the most probable was judged on data held out.

    Effects that explain what they were fitted to and not the rest are a likeness of the right one.
    """
    if closed is None or closed["high"] > 1.0 - (1.0 - calibration.closed) / 2.0:
        return hypotheses
    doubt = _logistic((calibration.closed - closed["value"]) / calibration.closed_width)
    before = next(p for c, p in hypotheses if c is None)
    unlisted = max(before, doubt)
    scale = (1.0 - unlisted) / max(1.0 - before, 1e-12)
    out = [(c, unlisted if c is None else p * scale) for c, p in hypotheses]
    return sorted(out, key=lambda pair: -pair[1])


def _at_stake(one: Candidate, other: Candidate, all_of: list[Candidate]) -> float:
    """What the effects explain in which two hypotheses differ: the excess without these.

    An effect's equation is good to a few hundredths of what it explains: two that differ by less
    are not told apart by any amount of data.
    """
    common = {effect.name for effect in one.effects} & {effect.name for effect in other.effects}
    without = [c for c in all_of if {effect.name for effect in c.effects} == common]
    return max(excess((without or all_of)[0].rich), 0.0)


def smallest_set(
    hypotheses: list[tuple[Candidate | None, float]], level: float = 0.95
) -> list[str]:
    """Names of the smallest set of hypotheses with at least `level` of the probability."""
    total, names = 0.0, []
    for candidate, probability in hypotheses:
        names.append("unlisted" if candidate is None else candidate.name)
        total += probability
        if total >= level:
            break
    return names
