"""Paired comparison of the advised next scan with a random one, on the same devices."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._outcome import Outcome
from ._thresholds import THRESHOLDS


def compare_scans(follow: Sequence[tuple[Outcome, Outcome, Outcome]]) -> dict[str, Any]:
    """Set sizes and probabilities of the truth after either scan.

    `follow`: the diagnosis before, after the advised scan, after the random one, for each device.
    Devices of which any diagnosis failed are listed and left out. Both tests are one-sided: the
    advised scan is no better.
    """
    whole = [t for t in follow if all(entry.error is None for entry in t)]
    sizes = np.array([[len(e.credible_set) for e in t] for t in whole], dtype=float).reshape(-1, 3)
    truth = np.array([[e.probability.get(e.correct, 0.0) for e in t] for t in whole]).reshape(-1, 3)
    smaller = _tests(sizes[:, 2] - sizes[:, 1])
    chance = smaller["p_signed_rank"]
    return {
        "n": len(whole),
        "failed": [t[0].name for t in follow if any(entry.error is not None for entry in t)],
        "set_size": _means(sizes) | smaller,
        "probability_of_truth": _means(truth) | _tests(truth[:, 1] - truth[:, 2]),
        "truth_in_set": {
            name: int(sum(t[k].correct in t[k].credible_set for t in whole))
            for k, name in enumerate(("before", "advised", "random"))
        },
        "met": None if chance is None else chance < THRESHOLDS.significance,
        "worlds": [
            {"name": t[0].name, "set_size": [int(x) for x in s], "probability_of_truth": p.tolist()}
            for t, s, p in zip(whole, sizes, truth, strict=True)
        ],
    }


def _means(columns: np.ndarray) -> dict[str, float | None]:
    names = ("before", "advised", "random")
    if not len(columns):
        return dict.fromkeys(names)
    return {name: float(columns[:, k].mean()) for k, name in enumerate(names)}


def _tests(gain: np.ndarray) -> dict[str, Any]:
    """How often the advised scan did better or worse, and both one-sided chances."""
    from scipy import stats

    better, worse = int((gain > 0).sum()), int((gain < 0).sum())
    rank = sign = None
    if better + worse:
        # Devices that tie say nothing.
        moved = gain[gain != 0]
        found: Any = stats.wilcoxon(moved, alternative="greater")
        rank = float(found.pvalue)
        sign = float(stats.binomtest(better, better + worse, alternative="greater").pvalue)
    elif gain.size:
        rank = sign = 1.0
    return {"better": better, "worse": worse, "p_signed_rank": rank, "p_sign": sign}
