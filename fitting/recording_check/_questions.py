"""What may be asked of a recording, what may not, and what to record to change that."""

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any, Literal

from fitting._units import quantity
from fitting.identification.data_checks._drive_character import describe_repetition
from fitting.identification.data_checks._fault import Fault, hides_effects
from fitting.identification.data_checks.holds._sweeps import single_sweep
from fitting.identification.data_checks.periods._odd_periods import OddPeriod
from rapi_jax import Recording
from rapi_jax.internal import significant

from ._runs import RunSummary
from ._thresholds import THRESHOLDS

Answer = Literal["yes", "partly", "no"]
# Kinds of faults beside which a diagnosis names no effect, other than `hides_effects` says.
_NOT_JUDGED = ("columns swapped", "unrelated columns", "unusable run", "noisy drive")


@dataclasses.dataclass(frozen=True)
class Question:
    """One thing that a recording may answer.

    `answer`: "yes", "partly" (assumed, or less certain) or "no"; `because`: the reason, a sentence;
    `record`: what to record or say to change it, empty where nothing is to be changed.
    """

    name: str
    answer: Answer
    because: str
    record: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain text, for a file."""
        return dataclasses.asdict(self)


def ask(
    recording: Recording,
    runs: Sequence[RunSummary],
    faults: Sequence[Fault],
    unsettled: Sequence[OddPeriod] = (),
) -> list[Question]:
    """Every question, in the order in which a laboratory meets them.

    Whether the device had settled is one only where the first period of a run speaks against it.
    """
    return [
        _ask_model(recording, runs, faults),
        *([_ask_settled(recording, unsettled)] if unsettled else []),
        _ask_noise(recording, runs),
        _ask_rates(recording),
        _ask_amplitudes(recording),
        _ask_held_out(runs),
        _ask_effects(recording, runs, faults),
    ]


def _ask_model(
    recording: Recording, runs: Sequence[RunSummary], faults: Sequence[Fault]
) -> Question:
    name = "a model (`rapi fit`)"
    if faults:
        kinds = ", ".join(dict.fromkeys(fault.kind for fault in faults))
        return Question(
            name, "no", f"a fit would not be trusted, because of: {kinds}.",
            "Each fault above says what to do.",
        )  # fmt: skip
    sweep = single_sweep(recording)
    if sweep is not None:
        return Question(name, "no", sweep)
    single = _of_one_period(runs)
    if single:
        return Question(
            name, "partly",
            f"nothing speaks against a fit, but {_name_runs(single, runs)} one period only. That "
            "does not show whether the device had settled, whether its response repeats, or "
            "whether the rate is right: no period is compared with another.", _more_periods(),
        )  # fmt: skip
    return Question(name, "yes", "nothing speaks against a fit.")


def _of_one_period(runs: Sequence[RunSummary]) -> list[RunSummary]:
    return [run for run in runs if run.periods == 1]


def _name_runs(some: Sequence[RunSummary], runs: Sequence[RunSummary]) -> str:
    """Which runs they are, with the verb "have"."""
    if len(some) == len(runs):
        return "each run has" if len(runs) > 1 else "the run has"
    named = ", ".join(repr(run.name) for run in some[:3])
    more = f" and {len(some) - 3} more" if len(some) > 3 else ""
    return f"run {named} has" if len(some) == 1 else f"runs {named}{more} have"


def _ask_settled(recording: Recording, unsettled: Sequence[OddPeriod]) -> Question:
    unit = recording.response_unit

    def shown(size: float) -> str:
        return quantity(float(f"{size:.2g}"), unit)

    named = [f"{one.run} {shown(one.rms)} rms, {shown(one.most)} at most" for one in unsettled[:4]]
    more = f"; and {len(unsettled) - 4} more" if len(unsettled) > 4 else ""
    return Question(
        "whether the device had settled", "partly",
        f"the first period differs from the later ones by more than noise explains "
        f"({'; '.join(named)}{more}). The device came from rest or from another scan, or "
        "its reading drifts ever more slowly; the hysteresis of a first rise may be part of it. "
        "The noise that is given is that of the later periods.",
        "Leave the first period of each run out (`rapi import --skip-periods 1`), or let each "
        "drive run for one more period before recording.",
    )  # fmt: skip


def _ask_noise(recording: Recording, runs: Sequence[RunSummary]) -> Question:
    name = "the noise"
    settled = "" if all(run.settled for run in runs) else "settled "
    beside = f"which have one {settled}period or none"
    repeated = [run for run in runs if run.noise_from == "periods" and run.periods > 1]
    if not repeated:
        cure = describe_repetition(recording)
        one = any(run.periods - (not run.settled) == 1 for run in runs) and cure is None
        because = (
            f"only one {settled}period, so periods cannot be compared: "
            if one
            else "no drive is declared periodic: "
        ) + (
            "the noise is estimated from differences between samples, which misses slow noise, or "
            "from the residual of a fit, which includes errors of the model."
        )
        return Question(name, "partly", because, cure or _more_periods())
    fewest = min(run.periods for run in repeated)
    if len(repeated) < len(runs):
        return Question(
            name, "partly",
            f"measured from differences between periods in {len(repeated)} of {len(runs)} runs; in "
            f"the others, {beside}, it is taken from what a fit leaves.",
            _more_periods(),
        )  # fmt: skip
    if fewest < THRESHOLDS.enough_periods:
        return Question(name, "yes", f"measured from {fewest} periods only.", _more_periods())
    return Question(name, "yes", f"measured from {fewest} periods or more of each run.")


def _more_periods() -> str:
    return "Record three periods or more of each drive."


def _ask_rates(recording: Recording) -> Question:
    name, rates = "rate dependence", recording.rates
    if not recording.one_rate and min(rates) > 0:
        apart = [b > (1.0 + THRESHOLDS.rates_apart) * a for a, b in itertools.pairwise(rates)]
        said = f"{1 + sum(apart)} scan rates, {min(rates):.6g} to {max(rates):.6g} Hz."
        return Question(name, "yes", said)
    cure = "Record two scan rates, at least a factor of two and better a factor of five apart."
    if max(rates) == 0:
        said = "Give it by `--rate` of `rapi import`, or as `excitation_hz` in the manifest. "
        return Question(name, "no", "no run has a scan rate.", said + cure)
    some = (
        "some runs have no scan rate." if min(rates) == 0 else f"one scan rate, {rates[0]:.6g} Hz."
    )
    because = f"{some} A lag cannot be told from hysteresis, and other rates cannot be predicted."
    return Question(name, "no", because, cure)


def _ask_amplitudes(recording: Recording) -> Question:
    name, swings, unit = "dependence on the swing", recording.amplitudes, recording.drive_unit
    low, high = (significant(swing, 4) for swing in (swings[0], swings[-1]))
    if _swings_differ(recording):
        shown = f"{len(swings)} swings, {low} to {high} {unit} peak to peak."
        return Question(name, "yes", shown)
    one = f"one swing, {low} {unit} peak to peak"
    if len(swings) > 1:
        one = f"swings of {low} to {high} {unit} peak to peak, nearly one"
    because = f"{one}: how the hysteresis grows with the swing is assumed, not measured."
    return Question(name, "partly", because, "Record a second swing, half as large.")


def _swings_differ(recording: Recording) -> bool:
    """Whether swings lie so far apart that they show how the hysteresis grows with the swing."""
    swings = recording.amplitudes
    return swings[-1] > THRESHOLDS.swings_apart * max(swings[0], 1e-300)


def _ask_held_out(runs: Sequence[RunSummary]) -> Question:
    name = "whether other runs are predicted"
    if len(runs) >= 3:
        return Question(name, "yes", f"each of {len(runs)} runs is left out in turn.")
    short = [run for run in runs if run.periods < 2]
    left = "the last third of its periods" if not short else (
        "the last third of its samples, which belongs to the same period as the rest"
        if _of_one_period(runs)
        else "the last third of its samples"
    )  # fmt: skip
    return Question(
        name, "partly",
        f"{len(runs)} run(s) only, and none lies between others. A fit is tested on what it has "
        f"not seen of each run alone: {left}.",
        "Record three rates or more: the middle one is then predicted from its neighbours.",
    )  # fmt: skip


def _ask_effects(
    recording: Recording, runs: Sequence[RunSummary], faults: Sequence[Fault]
) -> Question:
    name = "which effect is missing (`rapi diagnose`)"
    sweep = single_sweep(recording)
    if sweep is not None:
        return Question(name, "no", "no effect can be named from a single sweep.")
    if faults:
        hidden = any(f.kind in _NOT_JUDGED or hides_effects(f, recording) for f in faults)
        said = (
            "no effect is named on data with such a fault."
            if hidden
            else "a named effect may only reflect the fault above."
        )
        cure = "Each fault above says what to do."
        return Question(name, "no" if hidden else "partly", said, cure)
    missing = []
    if min(run.periods for run in runs) < THRESHOLDS.enough_periods:
        missing.append("at least three periods")
    if recording.one_rate:
        missing.append("at least two rates")
    if not _swings_differ(recording):
        missing.append("at least two swings")
    if not missing:
        return Question(name, "yes", "there are enough periods, rates and swings.")
    lacks = " and ".join(missing)
    because = f"the answer is less certain without {lacks}."
    return Question(name, "partly", because, f"Record {lacks}.")
