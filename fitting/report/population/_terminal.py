"""A population and a change on a terminal, and as text."""

import io
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from fitting.report.fit._table import round_with_error

if TYPE_CHECKING:
    from fitting.population._change import Change
    from fitting.population._population import Effect, Population, PopulationParameter

_SIGNIFICANT = 0.05


def render_population(population: "Population") -> Group:
    """Means, drift and scatter of each parameter, outliers, and what was left out."""
    outliers, used = population.outliers, len(population.recordings) - len(population.outliers)
    head = Text(f"Population of {used} recordings", style="bold")
    head.append(_span(population), style="not bold")
    rows: list[RenderableType] = [head, _tabulate(population)]
    for one in outliers:
        rows.append(
            Text(
                f"  x {one.label} is an outlier, and left out: the others predict it with "
                f"p = {one.p_value:.2g}",
                style="red",
            )
        )
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


def _tabulate(population: "Population") -> Table:
    names = population.covariates.names
    table = Table(
        title="Parameters at the mean time and temperature; p-values are for all together",
        title_justify="left",
    )
    heads = ["parameter", "mean", "unit"]
    heads += ["a year", "p"] if "time" in names else []
    heads += ["a kelvin", "p"] if "temperature" in names else []
    for name in (*heads, "scatter (95 %)", "drift"):
        left = name in ("parameter", "unit", "drift")
        table.add_column(name, justify="left" if left else "right")
    for p in population.parameters:
        cells = [p.name, _with_error(p.mean), "" if p.unit == "1" else p.unit]
        for effect in (p.per_year, p.temperature):
            if effect is not None:
                bold = "bold" if effect.p_holm < _SIGNIFICANT else ""
                cells += [Text(_with_error(effect), style=bold), f"{effect.p_holm:.2g}"]
        table.add_row(*cells, _scatter(p), _drift(p))
    return table


def _drift(p: "PopulationParameter") -> str:
    if p.time is None:
        return ""
    if p.smooth:
        return "a curve"
    return "a line" if p.time.p_holm < _SIGNIFICANT else ""


def _with_error(effect: "Effect") -> str:
    value, error = round_with_error(effect.value, effect.stderr)
    return f"{value} +- {error}"


def _scatter(p: "PopulationParameter") -> str:
    low = "0" if p.scatter_low == 0 else f"{p.scatter_low:.2g}"
    return f"{p.scatter:.2g} ({low} to {p.scatter_high:.2g})"


def render_change(change: "Change", label: str) -> Group:
    """What a new recording changed, with a row a parameter."""
    colour = "red" if change.changed else "green"
    head = Text(f"{label}: ", style="bold")
    head.append(change.sentence, style=f"bold {colour}")
    table = Table(title="The new recording", title_justify="left")
    heads = (
        "parameter", "unit", "expected", "measured", "p", "if it alone changed", "p given others",
        "probability",
    )  # fmt: skip
    for name in heads:
        table.add_column(name, justify="left" if name in ("parameter", "unit") else "right")
    for p in change.parameters:
        unit = "" if p.unit == "1" else p.unit
        cells = [p.name, unit, " +- ".join(round_with_error(p.expected, p.expected_stderr))]
        if not np.isfinite(p.measured):
            table.add_row(*cells, *["-"] * 5)
            continue
        style = "bold" if change.changed and p.name in change.set else ""
        table.add_row(
            *cells, " +- ".join(round_with_error(p.measured, p.stderr)), f"{p.p_holm:.2g}",
            p.amount, f"{p.p_given_others_holm:.2g}", f"{p.probability:.2g}", style=style,
        )  # fmt: skip
    others = {name: change.probabilities.get(name, 0.0) for name in ("none", "several")}
    words = ", ".join(f"{name} {value:.2g}" for name, value in others.items())
    rows: list[RenderableType] = [
        head,
        table,
        Text(
            f"  - all parameters together: p = {change.p_value:.2g}; probability of {words}. "
            "P-values of parameters are for all of them together."
        ),
    ]
    return Group(*rows, *(Text(f"  - {note}") for note in change.notes))


def render_text(population: "Population") -> str:
    """The tables of a population as plain text."""
    buffer = io.StringIO()
    console = Console(
        file=buffer, width=130, color_system=None, highlight=False, force_jupyter=False
    )
    console.print(render_population(population))
    return buffer.getvalue()
