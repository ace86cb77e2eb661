"""Proportions with Wilson's score interval, and figures beside their targets."""

from typing import Any

from scipy.stats import binomtest

from ._thresholds import THRESHOLDS


def wilson_interval(k: int, n: int) -> tuple[float, float]:
    """Wilson's score interval for the proportion of which `k` of `n` is a sample; (0, 1) for n = 0.

    All proportions p with `|k/n - p| <= z sqrt(p (1 - p)/n)`, z the normal quantile of the
    confidence: it stays within 0 and 1, and has a width also where all or none were counted.
    """
    if not 0 <= k <= n:
        raise ValueError(f"Argument `k` must lie between 0 and `n`, but they are {k} and {n}.")
    if n == 0:
        return 0.0, 1.0
    interval = binomtest(k, n).proportion_ci(THRESHOLDS.confidence, method="wilson")
    return float(interval.low), float(interval.high)


def proportion(
    k: int, n: int, *, least: float | None = None, most: float | None = None
) -> dict[str, Any]:
    """`k` of `n` as a record: share, its interval, and whether the target is met.

    The target is `least` or `most`; `met` judges the share itself and is `None` without a target,
    or where nothing was counted.
    """
    low, high = wilson_interval(k, n)
    share = k / n if n else None
    met = None
    if share is not None and least is not None:
        met = share >= least
    elif share is not None and most is not None:
        met = share <= most
    return {
        "n": n, "k": k, "share": share, "low": low if n else None, "high": high if n else None,
        "target": _target(least, most), "met": met,
    }  # fmt: skip


def compare_with_target(
    value: float | None, n: int, *, least: float | None = None, most: float | None = None
) -> dict[str, Any]:
    """A figure that is no share, with its target, as a record."""
    met = None
    if value is not None and n and least is not None:
        met = value >= least
    elif value is not None and n and most is not None:
        met = value <= most
    return {"n": n, "value": value if n else None, "target": _target(least, most), "met": met}


def _target(least: float | None, most: float | None) -> dict[str, float] | None:
    if least is not None:
        return {"least": least}
    return None if most is None else {"most": most}
