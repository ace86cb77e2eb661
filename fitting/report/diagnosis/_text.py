"""The sentences of a diagnosis: hypotheses by their labels, the verdict, the advice."""

from collections.abc import Mapping
from typing import Any

from fitting._units import interval_digits
from rapi_jax import effects

from ._numbers import (
    Scale,
    finite_or_none,
    format_interval,
    format_number,
    format_percent,
    format_setting,
)

SPECIAL = {
    "none": "no effect beyond the model",
    "unlisted": "an effect that is not among those known here",
}


Labels = Mapping[str, str]  # of effects, by name


def packaged_labels() -> dict[str, str]:
    """Labels of the package's own effects, by name."""
    return {cls.name: cls.label for cls in effects.ALL}


def describe_hypothesis(name: str, labels: Labels) -> str:
    """A hypothesis in words: `creep+drift` becomes "creep of the piezo and drift of ..."."""
    if name in SPECIAL:
        return SPECIAL[name]
    items = [labels.get(part, part.replace("_", " ")) for part in name.split("+")]
    # "A delay between drive and reading and pickup ..." would have to be read twice.
    return join_items(items, "together with" if any(" and " in item for item in items) else "and")


def without_article(label: str) -> str:
    """`label` as it stands in a list: "a delay between ..." becomes "delay between ..."."""
    first, _, rest = label.partition(" ")
    return rest if first in ("a", "an") and rest else label


def join_items(items: list[str], last: str = "and") -> str:
    """Items as in running text: "a, b and c"."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def to_sentence(text: str) -> str:
    """`text` with a capital first letter and a full stop; nothing where there is nothing."""
    text = capitalise(text)
    return text if not text or text.endswith((".", "!", "?")) else f"{text}."


def capitalise(text: str) -> str:
    """`text` with a capital first letter."""
    text = text.strip()
    return text[:1].upper() + text[1:]


def list_alternatives(items: list[str], labels: Labels) -> str:
    """Alternative hypotheses, joined by "or" as effects of one hypothesis are by "and"."""
    return ", or ".join(describe_hypothesis(item, labels) for item in items)


def credible_names(verdict: dict) -> list[str]:
    """The 95 % credible set, the verdict first."""
    first = str(verdict.get("name") or "unlisted")
    rest = [str(name) for name in verdict.get("set") or []]
    return [first, *(name for name in rest if name != first)]


def verdict_probability(diagnosis: dict) -> float | None:
    """Of the verdict: its own entry, or that of the hypothesis of its name."""
    verdict = diagnosis.get("verdict") or {}
    own = finite_or_none(verdict.get("probability"))
    found = (h for h in diagnosis.get("hypotheses") or [] if h.get("name") == verdict.get("name"))
    return own if own is not None else finite_or_none(next(found, {}).get("probability"))


def write_headline(diagnosis: dict, labels: Labels) -> str:
    """The verdict in one sentence: the file's own, or one made from its numbers."""
    verdict = diagnosis.get("verdict") or {}
    if verdict.get("sentence"):
        return to_sentence(str(verdict["sentence"]))
    among = credible_names(verdict)
    sure = verdict_probability(diagnosis)
    odds = "" if sure is None else f" (probability {format_percent(sure)})"
    closed = (diagnosis.get("shrinkage") or {}).get("closed_fraction")
    part = f"closes {format_interval(closed)} of the gap on held-out data" if closed else ""
    if len(among) > 1:
        rivals = list_alternatives(among, labels)
        likeliest = f"{describe_hypothesis(among[0], labels)}{odds}{part and f', which {part}'}"
        return to_sentence(
            f"these data cannot decide which it is: {rivals}; the likeliest is {likeliest}"
        )
    if among[0] == "none":
        return f"The base model explains this recording; no effect is missing{odds}."
    if among[0] == "unlisted":
        return f"The gap is real, but none of the known effects explains it{odds}."
    text = f"the gap is {describe_hypothesis(among[0], labels)}{odds}"
    return to_sentence(f"{text}; added to the model, it {part}" if part else text)


def describe_scan(entry: dict, drive_unit: str) -> str:
    """A scan to record: "triangle, 100 Hz, 1 V peak to peak, bias 3 V"."""
    parts = [str(entry.get("waveform") or "scan")]
    if finite_or_none(entry.get("excitation_hz")) is not None:
        parts.append(format_setting(entry["excitation_hz"], "Hz"))
    for key, words in (("amplitude", "{} peak to peak"), ("bias", "bias {}")):
        if finite_or_none(entry.get(key)) is not None:
            parts.append(words.format(format_setting(entry[key], drive_unit)))
    return ", ".join(parts)


def describe_separation(entry: dict, labels: Labels) -> str:
    """What a scan separates, from names or from pairs of names."""
    items = entry.get("separates") or []
    if items and all(isinstance(item, str) for item in items):
        return list_alternatives(items, labels)
    pairs = [
        [describe_hypothesis(str(n), labels) for n in item]
        for item in items
        if isinstance(item, list)
    ]
    return join_items([join_items(pair, "from") for pair in pairs])


def write_advice(diagnosis: dict, drive_unit: str, labels: Labels) -> str:
    """What to do next, in one sentence: the file's own, or what the verdict calls for."""
    verdict = diagnosis.get("verdict") or {}
    if verdict.get("advice"):
        return to_sentence(str(verdict["advice"]))
    following = diagnosis.get("next_scan")
    if following:
        apart = describe_separation(following, labels)
        return f"Record one more scan ({describe_scan(following, drive_unit)})" + (
            f" to tell {apart}." if apart else "."
        )
    among = credible_names(verdict)
    if len(among) > 1:
        return "The model predicts equally well with each; none is established as the cause."
    if among[0] == "none":
        return "Use the model as it is."
    if among[0] == "unlisted":
        return "See where in the scan the gap lies before you rely on a prediction there."
    file = (diagnosis.get("model") or {}).get("file")
    return "Use the model with the effect added" + (f", {file}." if file else ".")


def explain_no_scan(verdict: dict) -> str:
    """Why there is no scan to record next."""
    if not verdict.get("judged", True):
        return "The recording has a fault: correct it first, then a scan can be chosen."
    if credible_names(verdict) == ["unlisted"]:
        return "No scan is proposed: the effect is not known, so it predicts nothing."
    if len(credible_names(verdict)) > 1:
        return "No scan within the limits would separate the effects of the 95 % credible set."
    return "No further scan is needed: the 95 % credible set holds a single hypothesis."


def name_run(entry: dict) -> str:
    """A run by its name, or its number where it has none."""
    number = entry.get("run")
    return str(entry.get("name") or f"run {'?' if number is None else number}")


def label_run(entry: dict, drive_unit: str) -> str:
    """A run by what was done: "40 Hz, 3 V"; by its name or number where that is not known."""
    parts = []
    if finite_or_none(entry.get("excitation_hz")) is not None:
        parts.append(format_setting(entry["excitation_hz"], "Hz"))
    if finite_or_none(entry.get("amplitude")) is not None:
        parts.append(format_setting(entry["amplitude"], drive_unit))
    return ", ".join(parts) or name_run(entry)


def describe_baseline(diagnosis: dict, scale: Scale) -> str:
    """What the closed fraction refers to, where that is not the residual of the model alone.

    Empty where nothing was held out or no effect is named.
    """
    found, verdict = diagnosis.get("shrinkage") or {}, diagnosis.get("verdict") or {}
    before = finite_or_none(found.get("before"))
    if before is None or not found.get("held_out") or verdict.get("name") in SPECIAL:
        return ""
    alone = (diagnosis.get("base") or {}).get("operator")
    richer = alone and (diagnosis.get("model") or {}).get("operator") != alone
    which = "a more flexible hysteresis" if richer else "the same hysteresis"
    alone = finite_or_none((diagnosis.get("gap") or {}).get("total"))
    over_all = "" if alone is None else f" The model alone, over all data: {scale(alone)} rms."
    return (
        f"The closed fraction is of held-out data: there {which} without the effect, fitted to the "
        f"remaining data, leaves {scale(before)} rms.{over_all}"
    )


def describe_nonlinearity(diagnosis: dict, scale: Scale) -> str:
    """How far a compensated scan is off its line without and with the effects; empty if unknown.

    With the factor between them, each with its 95 % interval.
    """
    shrinkage = diagnosis.get("shrinkage") or {}
    found, gain = shrinkage.get("nonlinearity"), shrinkage.get("straighter")
    parts = []
    if isinstance(found, dict) and finite_or_none(found.get("before")) is not None:
        after = found.get("after") or {}
        text = f"{scale.bare(found['before'])} → {scale(after.get('value'))} rms"
        text += _describe_range(*(scale.value(after.get(key)) for key in ("low", "high")))
        parts.append(f"{text} at {format_setting(found['excitation_hz'], 'Hz')}")
    if isinstance(gain, dict) and finite_or_none(gain.get("value")) is not None:
        less = float(gain["value"])
        if less >= 1.0:
            ends = gain.get("low"), gain.get("high")
            parts.append(f"{format_number(less)} times less{_describe_range(*ends)}")
        else:  # of the factor the other way the ends change places
            low, high = (_inverse(gain.get(key)) for key in ("high", "low"))
            text = f"{format_number(_inverse(less))} times more{_describe_range(low, high)}"
            parts.append(text)
    return "; ".join(parts)


def _inverse(value: Any) -> float | None:
    number = finite_or_none(value)
    return None if not number else 1.0 / number


def _describe_range(low: Any, high: Any) -> str:
    """Ends of an interval in brackets; empty where one is missing."""
    if finite_or_none(low) is None or finite_or_none(high) is None:
        return ""
    ends = (format_number(end, interval_digits(end, high - low)) for end in (low, high))
    return f" ({' to '.join(ends)})"
