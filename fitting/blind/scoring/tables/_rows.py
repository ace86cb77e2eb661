"""The main table of the scores: measure, target, what was seen, met."""

from collections.abc import Mapping
from typing import Any

Record = Mapping[str, Any]
Row = tuple[str, str, str, str]


def summary_rows(scores: Record) -> list[Row]:
    """One row a measure, in the order in which a diagnosis is made."""
    alarms, kinds, sets = scores["false_alarms"], scores["by_kind"], scores["sets"]
    unlisted, honesty, named = scores["unlisted"], scores["honesty"], scores["realised"]
    seen, drives = named["unseen"], named["compensated"]
    rows = [
        _share("detection, 2 sigma or more", scores["detection"]),
        _share("false alarms on nulls", alarms["all"]),
        _share("- base misfit", alarms["with_base_misfit"]),
        _share("- no base misfit", alarms["without"]),
        _share("top-1, separable effects, 4 sigma or more", scores["top_1"]),
        _share("- other forms", kinds["form"]),
        _share("- pairs, both named", kinds["pair"]),
        _share("- pairs, one of two named", kinds["pair_either"]),
        _share(
            "95 % credible set: coverage, 2 sigma or more and nulls",
            sets["can_be_seen"]["coverage"],
        ),
        _value(
            "95 % credible set: mean size, 2 sigma or more and nulls",
            sets["can_be_seen"]["mean_size"],
        ),
        _share("95 % credible set: coverage, all devices", sets["all"]["coverage"]),
        _value("95 % credible set: mean size, all devices", sets["all"]["mean_size"]),
        _share("unlisted flagged, 4 sigma or more", unlisted["flagged"]),
        _share("- unlisted in the set", unlisted["in_set"]),
        _share("listed called unlisted, 4 sigma or more", unlisted["listed_called_unlisted"]),
        _share("left out: called unlisted", scores["left_out"]["all"]),
        _closed(scores["closed"]),
        _share("shrinkage holds on unseen scans", seen["inside"]["all"]),
        *(_share(f"- unseen {k}", seen["inside"][k]) for k in ("rate", "amplitude", "waveform")),
        _share("- not worse than promised", seen["no_worse"]["all"]),
        _share("- where the cause is named rightly", seen["named_rightly"]["inside"]["all"]),
        _linearity_row(drives),
        _share("- by the factor promised", drives["inside"]),
        _predicted_linearity_row(drives),
        _error("calibration error, equal mass", honesty["ece_equal_mass"]),
        _error("calibration error, equal width", honesty["ece_equal_width"]),
        _score("Brier score", honesty["brier"]),
        _score("log score", honesty["log"]),
        _scan(scores["next_scan"]),
        _seconds(scores["seconds"]),
    ]
    return [row for row in rows if row[2] != "-" or not row[0].startswith("-")]


def count(record: Record) -> str:
    """`k of n (share; interval)`; a dash where nothing was counted."""
    if not record["n"]:
        return "-"
    share, low, high = (100 * record[name] for name in ("share", "low", "high"))
    return f"{record['k']} of {record['n']} ({share:.3g} %; {low:.3g} to {high:.3g} %)"


def _met(met: bool | None) -> str:
    return "" if met is None else "yes" if met else "NO"


def _target(target: Mapping[str, float] | None, *, percent: bool) -> str:
    if target is None:
        return ""
    ((kind, value),) = target.items()
    sign = ">=" if kind == "least" else "<="
    return f"{sign} {100 * value:g} %" if percent else f"{sign} {value:g}"


def _share(name: str, record: Record) -> Row:
    return name, _target(record["target"], percent=True), count(record), _met(record["met"])


def _value(name: str, record: Record) -> Row:
    seen = "-" if record["value"] is None else f"{record['value']:.3g}"
    return name, _target(record["target"], percent=False), seen, _met(record["met"])


def _closed(record: Record) -> Row:
    seen = "-"
    if record["median"] is not None:
        seen = f"median {record['median']:.3g}; {record['k']} of {record['n']} reach it"
    target = _target(record["target"], percent=False)
    return "closed fraction, cause rightly named", target, seen, _met(record["met"])


def _linearity_row(record: Record) -> Row:
    down, seen = record["down"], "-"
    if down["n"]:
        seen = f"{down['k']} of {down['n']} straighter"
    if record["median_factor"] is not None:
        seen += f", median factor {record['median_factor']:.3g}"
    if record["median_ratio"] is not None:
        seen += f", {record['median_ratio']:.2g} times that promised"
    return "compensated scan with the effect named", "straighter", seen, ""


def _predicted_linearity_row(record: Record) -> Row:
    found = record["median_foreseen"]
    seen = "-" if found is None else f"{found:.3g} times that foreseen (median)"
    return "- nonlinearity without the effect, on the device", "", seen, ""


def _error(name: str, record: Record) -> Row:
    seen = "-"
    if record["value"] is not None:
        seen = f"{record['value']:.3f} ({record['low']:.3f} to {record['high']:.3f}; "
        seen += f"{record['by_chance']:.3f} by chance)"
    return name, _target(record["target"], percent=False), seen, _met(record["met"])


def _score(name: str, record: Record) -> Row:
    if record["value"] is None:
        return name, "below the base rate's", "-", ""
    seen = f"{record['value']:.3f}; base rate {record['base_rate']:.3f}"
    return name, "below the base rate's", seen, _met(record["met"])


def _scan(record: Record) -> Row:
    name, target = "names left, advised scan against random", "fewer, p < 0.05"
    if not record["n"]:
        return name, target, "-", ""
    sizes = record["set_size"]
    seen = (
        f"{sizes['advised']:.3g} against {sizes['random']:.3g} of {sizes['before']:.3g} "
        f"({record['n']} devices: {sizes['better']} better, {sizes['worse']} worse, "
        f"p = {sizes['p_signed_rank']:.2g})"
    )
    return name, target, seen, _met(record["met"])


def _seconds(record: Record) -> Row:
    name, seen = "seconds a diagnosis", "-"
    if record["n"]:
        seen = (
            f"median {record['median']:.3g}, nine of ten within {record['most_of_ten']:.3g}, "
            f"longest {record['longest']:.3g}"
        )
    return name, "", seen, ""
