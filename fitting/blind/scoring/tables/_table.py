"""The scores as Markdown that a terminal shows as well: tables, and every failure by name."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ._rows import count, summary_rows

Scores = Mapping[str, Any]


def markdown(scores: Scores) -> str:
    """All tables of `score`'s dictionary."""
    parts = [
        _table(("measure", "target", "seen", "met"), summary_rows(scores)),
        "## By size",
        "Right verdicts; size in multiples of the noise, after projection off the base.",
        _by_size(scores),
        "## By what survives the base",
        "Single listed effects of 4 sigma or more: the share of the effect that no base absorbs.",
        _by_survival(scores),
        "## By effect",
        "Single listed effects and other forms of them, 4 sigma or more.",
        _table(("effect", "right"), [(k, count(v)) for k, v in scores["by_effect"].items()]),
        "## Baselines",
        "On the same devices.",
        _baselines(scores),
        *_left_out(scores),
        *_refused(scores),
        "## Confusion",
        _confusion(scores),
        "## Failures",
        _failures(scores),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def short(record: Scores) -> str:
    """`k/n`."""
    return f"{record['k']}/{record['n']}" if record["n"] else "-"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Columns of one width, so that plain text is a table too."""
    cells = [list(heads), *([_plain(cell) for cell in row] for row in rows)]
    if len(cells) == 1:
        return "None."
    width = [max(len(row[k]) for row in cells) for k in range(len(heads))]
    lines = [
        "| " + " | ".join(c.ljust(w) for c, w in zip(r, width, strict=True)) + " |" for r in cells
    ]
    rule = "|" + "|".join("-" * (w + 2) for w in width) + "|"
    return "\n".join([lines[0], rule, *lines[1:]])


def _plain(cell: str) -> str:
    """On one line, and with no bar that would end the cell."""
    return " ".join(cell.split()).replace("|", "\\|")


def _range(row: Scores) -> str:
    if row["from"] is None:
        return "not known"
    return f"{row['from']:g} to {row['to']:g}" if row["to"] is not None else f"{row['from']:g} up"


def _by_size(scores: Scores) -> str:
    kinds = ("all", "listed", "form", "pair", "unlisted")
    rows = [
        (_range(r), count(r["all"]), *(short(r[k]) for k in kinds[1:])) for r in scores["by_size"]
    ]
    return _table(("size", *kinds), rows)


def _by_survival(scores: Scores) -> str:
    rows = [(_range(row), count(row)) for row in scores["by_survival"] if row["n"]]
    return _table(("unabsorbed", "right"), rows)


def _baselines(scores: Scores) -> str:
    heads = ("detection", "false alarms", "top-1", "unlisted flagged", "listed called unlisted")
    keys = (
        "detection", "false_alarms", "top_1", "unlisted_flagged", "listed_called_unlisted",
    )  # fmt: skip
    rows = [
        (name, *(_share(found[key]) for key in keys)) for name, found in scores["baselines"].items()
    ]
    return _table(("", *heads), rows)


def _share(record: Scores) -> str:
    return f"{100 * record['share']:.3g} % ({short(record)})" if record["n"] else "-"


def _left_out(scores: Scores) -> list[str]:
    found = scores["left_out"]
    if not found["all"]["n"]:
        return []
    rows = [(name, count(record)) for name, record in found["by_effect"].items()]
    return [
        "## Leave one effect out",
        "The true effect was taken from the candidates: right is `unlisted`.",
        _table(("effect", "called unlisted"), [*rows, ("all", count(found["all"]))]),
    ]


def _refused(scores: Scores) -> list[str]:
    realised = scores["realised"]
    rows = [(r["name"], r["verdict"], r["reason"]) for r in realised["compensated"]["refused"]]
    rows += [(w["name"], w["verdict"], w["error"]) for w in realised["worlds"] if w["error"]]
    if not rows:
        return []
    return [
        "## Promises that could not be tried",
        _table(("device", "verdict", "reason"), rows),
    ]


def _confusion(scores: Scores) -> str:
    rows = []
    for truth, verdicts in scores["confusion"].items():
        said = ", ".join(f"{name} {number}" for name, number in verdicts.items())
        rows.append((truth, str(sum(verdicts.values())), said))
    return _table(("truth", "worlds", "verdicts"), rows)


def _failures(scores: Scores) -> str:
    heads = ("device", "truth", "size", "base", "verdict", "probability", "set", "counts against")
    rows = []
    for f in scores["failures"]:
        truth = f"{f['truth']} (form)" if f["kind"] == "form" else f["truth"]
        truth += f", {f['withheld']} left out" if f["withheld"] else ""
        sure = "-" if f["probability"] is None else f"{100 * f['probability']:.3g} %"
        verdict = f["verdict"] if f["error"] is None else f"error: {f['error']}"
        rows.append(
            (
                f["name"],
                truth,
                f"{f['size']:.3g}",
                "misfit" if f["base_misfit"] else "exact",
                verdict,
                sure,
                ", ".join(f["set"]) or "-",
                ", ".join(f["against"]) or "-",
            )  # fmt: skip
        )
    return _table(heads, rows)
