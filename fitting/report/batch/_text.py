"""Sentences of the page of a batch: the headline, who stands out, what drifts."""

from typing import Any

from fitting.report.diagnosis._numbers import (
    SPACE,
    finite_or_none,
    format_number,
    format_quantity,
    format_with_error,
)
from fitting.report.diagnosis._text import join_items

_COMBINED = 1.5  # times as far off given the others as by itself: it is the combination
_NAMED = 3  # in a sentence; the rest is counted
_TIMES = ((2.0, "min", 60.0), (72.0, "h", 1.0), (float("inf"), "days", 1.0 / 24.0))


def count(rows: list[dict], **having: Any) -> int:
    """How many rows have these values."""
    return sum(all(row.get(key) == value for key, value in having.items()) for row in rows)


def cut_at_words(text: str, limit: int) -> str:
    """A text of at most `limit` characters: of a longer one its two ends, whole words."""
    if len(text) <= limit:
        return text
    half = limit // 2 - 2
    head, tail = text[: half + 1], text[-half - 1 :]
    start = head.rsplit(" ", 1)[0] if " " in head else head[:half]
    end = tail.split(" ", 1)[1] if " " in tail else tail[1:]
    return f"{start} \N{HORIZONTAL ELLIPSIS} {end}"


def plural(number: int, noun: str) -> str:
    """`1 recording`, `2 recordings`."""
    return f"{number}{SPACE}{noun}{'' if number == 1 else 's'}"


def write_headline(rows: list[dict]) -> str:
    """How many are done, trusted and failed, in one sentence."""
    if not rows:
        return "This batch holds no recording."
    done, judged = count(rows, status="done"), count(rows, status="done", trusted=True)
    against = count(rows, status="done", trusted=False)
    lost = [
        f"{count(rows, status=status)} {words}"
        for status, words in (
            ("failed", "failed"),
            ("skipped", "skipped"),
            ("unreadable", "cannot be read"),
        )
        if count(rows, status=status)
    ]
    if judged or against:
        every = judged == len(rows)
        head = f"All {len(rows)}" if every else f"{judged} of {plural(len(rows), 'recording')}"
        verb = "has" if judged == 1 and not every else "have"
        text = f"{head}{' recordings' if every else ''} {verb} a trusted result"
        if against:
            lost.insert(0, f"{against} {'is' if against == 1 else 'are'} not to be trusted")
    else:
        head = f"All {len(rows)}" if done == len(rows) else f"{done} of {len(rows)}"
        text = f"{head} {'recording is' if len(rows) == 1 else 'recordings are'} done"
    hint = ""
    if against and not judged and not any(row.get("verdict") for row in rows):
        hint = (
            " Where a model leaves more than noise, `rapi batch ... --do diagnose` with the same "
            "recordings says which effect it lacks."
        )
    return f"{text}{'; ' if lost else ''}{join_items(lost)}.{hint}"


def format_p(p: Any) -> str:
    """A p-value, small ones as a bound."""
    x = finite_or_none(p)
    if x is None:
        return format_number(None)
    return f"<{SPACE}0.001" if x < 0.001 else f"{x:.3f}" if x < 0.0995 else f"{x:.2f}"


def with_p(p: Any) -> str:
    """`p = 0.012` or `p < 0.001`."""
    text = format_p(p)
    return f"p{SPACE}{text}" if text.startswith("<") else f"p{SPACE}={SPACE}{text}"


def explain_outlier(outlier: dict, group: dict) -> str:
    """Which parameter of a recording is off, and how far."""
    names = [one["name"] for one in group["parameters"]]
    z = [finite_or_none(v) or 0.0 for v in outlier["z"]]
    given = [finite_or_none(v) or 0.0 for v in outlier["given"]]
    k = max(range(len(z)), key=lambda i: abs(z[i]))
    j = max(range(len(given)), key=lambda i: abs(given[i]))
    side = "above" if z[k] > 0 else "below"
    alone = f"{names[k]} is {abs(z[k]):.1f} standard deviations {side} the others"
    if abs(given[j]) <= _COMBINED * abs(z[k]):
        return alone
    way = "high" if given[j] > 0 else "low"
    return (
        f"{names[j]} is {abs(given[j]):.1f} standard deviations too {way} for its other parameters"
    )


def summarise_outliers(found: list[dict], compared: bool, fewest: int) -> str:
    """Who stands out, in one sentence or two."""
    if not compared:
        return (
            f"Fewer than {fewest} trusted recordings have the same parameters, so none can be "
            "tested against the others."
        )
    if not found:
        return "No recording differs from the others by more than chance."
    named = [f"{one['name']}: {one['why']} ({with_p(one['p'])})" for one in found[:_NAMED]]
    more = len(found) - len(named)
    return "; ".join(named) + (f"; and {more} more, listed below." if more else ".")


def summarise_drift(groups: list[dict], fewest: int) -> str:
    """What drifts, in one sentence or two."""
    tested = [g for g in groups if any(p["drift"] for p in g["parameters"])]
    if not tested:
        return f"Fewer than {fewest} trusted recordings follow one another, so no trend is tested."
    found = [
        f"{p['name']} {describe_change(p, g)}"
        for g in tested
        for p in g["parameters"]
        if p["drift"] and p["drift"]["found"]
    ]
    if not found:
        return "No parameter has a trend beyond chance."
    more = len(found) - _NAMED
    return "; ".join(found[:_NAMED]) + (f"; and {more} more, listed below." if more > 0 else ".")


def describe_change(parameter: dict, group: dict) -> str:
    """`rises by 0.2 ± 0.1 V over 8 h (p = 0.012)`."""
    drift = parameter["drift"]
    way = "rises" if drift["change"] > 0 else "falls"
    size = format_with_error(abs(drift["change"]), drift["stderr"], parameter["unit"])
    return f"{way} by {size} {over_session(group)} ({with_p(drift['p'])})"


def over_session(group: dict) -> str:
    """The length of a session: `over 8.2 h`, `over 100 recordings`."""
    if not group["hours"]:
        return f"over {plural(len(group['index']), 'recording')}"
    unit, factor = time_unit(group)
    return f"over {format_quantity(max(group['time']) * factor, unit)}"


def time_unit(group: dict) -> tuple[str, float]:
    """The unit in which a session's time is shown, and its number in an hour."""
    longest = max(group["time"], default=0.0)
    return next((unit, factor) for limit, unit, factor in _TIMES if longest < limit)


def name_group(kind: list[str]) -> str:
    """What was estimated: `RAPI with Creep`, `creep`, `range`."""
    task, *parts = kind
    if task == "fit" and parts:
        return " with ".join(filter(None, [parts[0], join_items(parts[1:])]))
    return {"diagnose": f"verdict {join_items(parts)}"}.get(task, "distance and velocity")
