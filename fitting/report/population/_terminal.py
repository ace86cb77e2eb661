"""A population and a change on a terminal, and as text."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fitting._units import in_interval
from fitting.report._plain_text import plain_text
from fitting.report.fit._table import round_with_error

if TYPE_CHECKING:
    from fitting.population._change import Change
    from fitting.population._parameters import Effect
    from fitting.population._population import Population

_SIGNIFICANT = 0.05
_DRIFTS = (("time", "per_year", "a year"), ("temperature", "temperature", "a kelvin"))


def render_population(population: "Population") -> Group:
    """Means, drift and scatter of each parameter, outliers, and what was left out."""
    used = len(population.recordings) - len(population.outliers)
    head = Text(f"Population of {used} recordings", style="bold")
    head.append(_span(population), style="not bold")
    rows: list[RenderableType] = [head, _tabulate_means(population)]
    rows += [
        _tabulate_drift(population, field, words)
        for name, field, words in _DRIFTS
        if name in population.covariates.names
    ]
    rows += [
        Text(
            f"  x {one.label} is an outlier and is left out: the others predict it with "
            f"p = {one.p_value:.2g}",
            style="red",
        )
        for one in population.outliers
    ]
    rows += [Text(f"  x {label} is left out: {why}") for label, why in population.left_out]
    rows += [Text(f"  - {note}") for note in population.notes]
    return Group(*rows)


def _span(population: "Population") -> str:
    parts = []
    used = [one for one in population.recordings if not one.outlier]
    if "time" in population.covariates.names:
        days = [float(one.days) for one in used if one.days is not None]
        parts.append(f"{max(days) - min(days):.4g} days")
    if "temperature" in population.covariates.names:
        warm = [one.temperature_c for one in used if one.temperature_c is not None]
        parts.append(f"{min(warm):.4g} to {max(warm):.4g} deg C")
    return f", {', '.join(parts)}" if parts else ""


def _table(title: str, heads: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left")
    for head in heads:
        left = head in ("name", "unit", "drift")
        table.add_column(head, justify="left" if left else "right")
    return table


def _tabulate_means(population: "Population") -> Table:
    table = _table(
        "Parameters at the mean time and temperature, and their scatter between recordings",
        ("name", "mean", "std. error", "unit", "scatter", "95 %"),
    )
    for p in population.parameters:
        width = p.scatter_high - p.scatter_low
        scatter, low, high = (
            in_interval(x, width) for x in (p.scatter, p.scatter_low, p.scatter_high)
        )
        table.add_row(
            p.name, *_cells(p.mean), "" if p.unit == "1" else p.unit,
            scatter, f"{low} to {high}",
        )  # fmt: skip
    return table


def _tabulate_drift(population: "Population", field: str, words: str) -> Table:
    shape = ("drift",) if field == "per_year" else ()
    table = _table(
        f"Change {words} (p for all parameters together)",
        ("name", words, "std. error", "unit", "% of the mean", "p", *shape),
    )
    for p in population.parameters:
        effect: Effect = getattr(p, field)
        found = effect.p_holm < _SIGNIFICANT
        share = "-"
        if abs(p.mean.value) > 3.0 * p.mean.stderr:
            share = f"{100.0 * effect.value / abs(p.mean.value):+.2g}"
        drift = "curve" if p.smooth else "line" if found else "-"
        unit = "" if p.unit == "1" else p.unit
        table.add_row(
            p.name, *_cells(effect), unit, share, f"{effect.p_holm:.2g}",
            *([drift] if shape else ()), style="bold" if found else "",
        )  # fmt: skip
    return table


def _cells(effect: "Effect") -> tuple[str, str]:
    value, error = round_with_error(effect.value, effect.stderr)
    if len(value) > 9:
        value = f"{effect.value:.4g}"
    return value, f"{effect.stderr:.2g}"


def render_change(change: "Change") -> Group:
    """What a new recording changed, with a row per parameter."""
    head = Text(f"{change.label}: ", style="bold")
    head.append(change.sentence, style="bold red" if change.changed else "bold green")
    table = _table(
        "The new recording beside what the population predicts (p for all parameters together)",
        ("name", "expected", "measured", "p", "if it alone", "p of that", "probability"),
    )
    for p in change.parameters:
        expected = round_with_error(p.expected, p.expected_stderr)[0]
        if not np.isfinite(p.measured):
            table.add_row(p.name, expected, *["-"] * 5)
            continue
        table.add_row(
            p.name, expected, round_with_error(p.measured, p.stderr)[0], f"{p.p_holm:.2g}",
            p.amount, f"{p.p_given_others_holm:.2g}", f"{p.probability:.2g}",
            style="bold" if change.changed and p.name in change.set else "",
        )  # fmt: skip
    none, several = (change.probabilities.get(name, 0.0) for name in ("none", "several"))
    facts = (
        f"all parameters together: p = {change.p_value:.2g}",
        f"probability that nothing changed {none:.2g}, several parameters {several:.2g}",
        *change.notes,
    )
    return Group(head, table, *(Text(f"  - {fact}") for fact in facts))


def render_text(population: "Population") -> str:
    """The tables of a population as plain text."""
    return plain_text(render_population(population))
