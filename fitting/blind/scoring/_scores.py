"""All scores of a bank: answers, and the predictions made before they were seen.

`score` gives one dictionary that strict JSON can hold:

- `schema`: `rapi.blind-scores/1`; `worlds`: how many; `errors`: diagnoses that failed, with names.
- `detection`; `false_alarms`: `all`, `with_base_misfit`, `without`; `unlisted`: `flagged`,
  `in_set`, `listed_called_unlisted` (see `_rates`).
- `top_1`, `by_kind`, `by_effect`, `by_size`, `by_survival`, `closed`: see `_accuracy`.
- `sets`: coverage and mean size of `can_be_seen` (2 sigma or more, and nulls) and of `all`.
- `left_out`: devices whose effect was taken from the candidates; they count nowhere else.
- `honesty`, `realised`, `confusion`, `failures`: see the modules of these names; `next_scan`: see
  `_scan_comparison`.
- `seconds`: of a diagnosis: `median`, `most_of_ten`, `longest`.
- `baselines`: five counts of the diagnosis and of each baseline.

A count is `{n, k, share, low, high, target, met}` (`low`, `high`: Wilson's 95 % interval; `target`:
`{"least": x}`, `{"most": x}` or null; `met`: null where nothing was counted). Another figure is
`{n, value, target, met}`. Parameters are not scored: the devices' forms are not the model's.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from fitting._json import replace_nonfinite

from . import _accuracy, _rates
from ._calibration_error import calibration_scores
from ._confusion import confusion
from ._outcome import Given, Outcome
from ._realised import Draw, Progress, evaluate_realised, redraw
from ._scan_comparison import compare_scans
from .tables._failures import list_failures

SCHEMA = "rapi.blind-scores/1"
Prediction = Mapping[str, Any] | None
Follow = tuple[Mapping[str, Any], Prediction, Prediction, Prediction]


def score(
    entries: Sequence[Given],
    *,
    draw: Draw = redraw,
    follow: Sequence[Follow] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The scores of a bank; see above.

    **Arguments:**

    - `entries`: answer, prediction, and the folder of the prediction's models or `None`.
    - `draw`: draws the device of an answer anew, to try out what was promised.
    - `follow`: answer, then predictions before, after the advised and after a random next scan.
    - `progress`: called with a line before each device that is tried out.
    """
    every = [Outcome.of(*entry) for entry in entries]
    own = [entry for entry in every if entry.withheld is None]
    visible = [entry for entry in own if entry.is_detectable]
    scores = {
        "schema": SCHEMA,
        "worlds": len(every),
        "errors": [{"name": e.name, "error": e.error} for e in every if e.error is not None],
        "detection": _rates.detection_rate(own),
        "false_alarms": {
            "all": _rates.false_alarm_rate(own),
            "with_base_misfit": _rates.false_alarm_rate(own, base_misfit=True),
            "without": _rates.false_alarm_rate(own, base_misfit=False),
        },
        "top_1": _accuracy.top_1_accuracy(own),
        "by_kind": _accuracy.accuracy_by_kind(own),
        "by_effect": _accuracy.accuracy_by_effect(own),
        "by_size": _accuracy.accuracy_by_size(own),
        "by_survival": _accuracy.accuracy_by_survival(own),
        "sets": {"can_be_seen": _rates.set_coverage(visible), "all": _rates.set_coverage(own)},
        "unlisted": {
            "flagged": _rates.unlisted_rate(own),
            "in_set": _rates.unlisted_set_rate(own),
            "listed_called_unlisted": _rates.listed_refusal_rate(own),
        },
        "left_out": _rates.withheld_rates([e for e in every if e.withheld is not None]),
        "closed": _accuracy.closed_fraction(own),
        "honesty": calibration_scores(own),
        "realised": evaluate_realised(own, draw=draw, progress=progress),
        "next_scan": compare_scans([_three(*four) for four in follow]),
        "seconds": _rates.run_times(every),
        "baselines": _baselines(own),
        "confusion": confusion(own),
        "failures": list_failures(every),
    }
    return replace_nonfinite(scores)


def _three(
    answer: Mapping[str, Any], first: Prediction, advised: Prediction, other: Prediction
) -> tuple[Outcome, Outcome, Outcome]:
    return Outcome.of(answer, first), Outcome.of(answer, advised), Outcome.of(answer, other)


def _baselines(entries: Sequence[Outcome]) -> dict[str, dict[str, Any]]:
    """The same measures for each, on the devices that each has judged."""
    names = list(dict.fromkeys(name for entry in entries for name in entry.baselines))
    out = {"diagnosis": _measures(entries, _rates.diagnosis_verdict)}
    for name in names:
        out[name] = _measures(entries, lambda entry, name=name: entry.baselines.get(name))
    return out


def _measures(entries: Sequence[Outcome], verdict_of: _rates.VerdictOf) -> dict[str, Any]:
    return {
        "detection": _rates.detection_rate(entries, verdict_of),
        "false_alarms": _rates.false_alarm_rate(entries, verdict_of),
        "top_1": _accuracy.top_1_accuracy(entries, verdict_of),
        "unlisted_flagged": _rates.unlisted_rate(entries, verdict_of),
        "listed_called_unlisted": _rates.listed_refusal_rate(entries, verdict_of),
    }
