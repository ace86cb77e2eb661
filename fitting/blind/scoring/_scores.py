"""All scores of a bank: answers, and the predictions made before they were seen.

`score` gives one dictionary that strict JSON can hold:

- `schema`: `rapi.blind-scores/1`; `worlds`: how many; `errors`: diagnoses that failed, with names.
- `detection`; `false_alarms`: `all`, `with_base_misfit`, `without`; `unlisted`: `flagged`,
  `in_set`, `listed_called_unlisted` (see `_counts`).
- `top_1`, `by_kind`, `by_effect`, `by_size`, `by_survival`, `closed`: see `_named`.
- `sets`: coverage and mean size of `can_be_seen` (2 sigma or more, and nulls) and of `all`.
- `left_out`: worlds whose effect was taken from the candidates; they count nowhere else.
- `honesty`, `realised`, `confusion`, `failures`: see the modules of these names; `next_scan`: see
  `_paired`.
- `seconds`: of a diagnosis: `median`, `most_of_ten`, `longest`.
- `baselines`: five counts of the diagnosis and of each baseline.

A count is `{n, k, share, low, high, target, met}` (`low`, `high`: Wilson's 95 % interval; `target`:
`{"least": x}`, `{"most": x}` or null; `met`: null where nothing was counted). Another figure is
`{n, value, target, met}`. Parameters are not scored: the worlds' forms are not the model's.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from fitting._json import replace_nonfinite

from . import _counts
from . import _top_one as _named
from ._calibration_error import calibration_measures
from ._confusion import confusion
from ._entry import Entry, Given
from ._failures import failures
from ._paired import paired
from ._realised import Draw, Progress, draw_again, realise

SCHEMA = "rapi.blind-scores/1"
Prediction = Mapping[str, Any] | None
Follow = tuple[Mapping[str, Any], Prediction, Prediction, Prediction]


def score(
    entries: Sequence[Given],
    *,
    draw: Draw = draw_again,
    follow: Sequence[Follow] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The scores of a bank; see above.

    **Arguments:**

    - `entries`: answer, prediction, and the folder of the prediction's models or `None`.
    - `draw`: draws the world of an answer anew, to try out what was promised.
    - `follow`: answer, then predictions before, after the advised and after a random next scan.
    - `progress`: called with a line before each world that is tried out.
    """
    every = [Entry.of(*entry) for entry in entries]
    own = [entry for entry in every if entry.withheld is None]
    visible = [entry for entry in own if _counts.can_be_seen(entry)]
    scores = {
        "schema": SCHEMA,
        "worlds": len(every),
        "errors": [{"name": e.name, "error": e.error} for e in every if e.error is not None],
        "detection": _counts.detection(own),
        "false_alarms": {
            "all": _counts.false_alarms(own),
            "with_base_misfit": _counts.false_alarms(own, base_misfit=True),
            "without": _counts.false_alarms(own, base_misfit=False),
        },
        "top_1": _named.top_1(own),
        "by_kind": _named.by_kind(own),
        "by_effect": _named.by_effect(own),
        "by_size": _named.by_size(own),
        "by_survival": _named.by_survival(own),
        "sets": {"can_be_seen": _counts.sets(visible), "all": _counts.sets(own)},
        "unlisted": {
            "flagged": _counts.unlisted_flagged(own),
            "in_set": _counts.unlisted_in_set(own),
            "listed_called_unlisted": _counts.listed_called_unlisted(own),
        },
        "left_out": _counts.left_out([e for e in every if e.withheld is not None]),
        "closed": _named.closed(own),
        "honesty": calibration_measures(own),
        "realised": realise(own, draw=draw, progress=progress),
        "next_scan": paired([_three(*four) for four in follow]),
        "seconds": _counts.seconds(every),
        "baselines": _baselines(own),
        "confusion": confusion(own),
        "failures": failures(every),
    }
    return replace_nonfinite(scores)


def _three(
    answer: Mapping[str, Any], first: Prediction, advised: Prediction, other: Prediction
) -> tuple[Entry, Entry, Entry]:
    return Entry.of(answer, first), Entry.of(answer, advised), Entry.of(answer, other)


def _baselines(entries: Sequence[Entry]) -> dict[str, dict[str, Any]]:
    """The same measures for each, on the worlds that each has judged."""
    names = list(dict.fromkeys(name for entry in entries for name in entry.baselines))
    out = {"diagnosis": _measures(entries, _counts.own)}
    for name in names:
        out[name] = _measures(entries, lambda entry, name=name: entry.baselines.get(name))
    return out


def _measures(entries: Sequence[Entry], said: _counts.Said) -> dict[str, Any]:
    return {
        "detection": _counts.detection(entries, said),
        "false_alarms": _counts.false_alarms(entries, said),
        "top_1": _named.top_1(entries, said),
        "unlisted_flagged": _counts.unlisted_flagged(entries, said),
        "listed_called_unlisted": _counts.listed_called_unlisted(entries, said),
    }
