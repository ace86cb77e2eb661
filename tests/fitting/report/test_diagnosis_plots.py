"""The pictures and the table of a diagnosis show the figures of its file."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis._diagnosis import Diagnosis
from fitting.report.diagnosis._plots import DiagnosisPlots
from rapi_jax import plot

X = [0.1, 0.2, 0.3]


def entry(**changes):
    rows = [
        {"row": f"run{k}", "x": X, "without": [s, -s, s], "with": [0.0, None, 0.0]}
        for k, s in enumerate((0.001, 0.02, 0.003, 0.004, 0.005))
    ]
    return {"effect": "etalon", "axis": "response", "unit": "GHz", "period": 7.0, "rows": rows} | (
        changes
    )


def diagnosis(**changes):
    runs = [
        {"run": 1, "name": "b", "before": 0.3, "after": 0.02},
        {"run": 0, "name": "a", "before": 0.1, "after": None},
    ]
    content = {
        "hypotheses": [
            {"name": "etalon", "mechanism": "etalon", "probability": 0.9,
             "closed_fraction": {"value": 0.95, "low": 0.9, "high": 0.99}},
            {"name": "none", "mechanism": "none", "probability": 0.1, "closed_fraction": None},
        ],
        "signature": [entry()],
        "shrinkage": {"by_run": runs, "floor": 0.015},
    }  # fmt: skip
    return SimpleNamespace(
        content=content | changes,
        recording=SimpleNamespace(response_unit="GHz"),
        verdict=SimpleNamespace(set=("etalon",)),
    )


def test_bars_are_the_probabilities():
    axis = DiagnosisPlots(diagnosis()).answers().axes[0]
    assert [label.get_text() for label in axis.get_yticklabels()] == ["etalon", "none"]
    assert [bar.get_width() for bar in axis.patches] == [0.9, 0.1]


def test_an_answer_without_any_probability_is_not_drawn_unless_it_is_the_only_one():
    assert len(plot.answers([("a", 0.9999), ("b", 1e-5)]).axes[0].patches) == 1
    assert len(plot.answers([("a", 0.0)]).axes[0].patches) == 1


def test_the_line_is_what_the_effect_explains():
    axis = DiagnosisPlots(diagnosis()).signature().axes[0]
    largest = axis.lines[1].get_ydata()
    np.testing.assert_allclose(largest, [20.0, np.nan, 20.0])  # MHz
    assert axis.get_ylabel() == "mean residual (MHz)"
    assert axis.get_xlabel() == "optical frequency, folded (GHz)"
    drawn = [text.get_text() for text in axis.figure.legends[0].get_texts()]
    assert drawn[:4] == ["run1", "run4", "run3", "run2"]  # by what it explains, four at most


@pytest.mark.parametrize(
    ("axis", "unit", "label", "first"),
    [
        ("since_turn", "s", "time since the turning point (ms)", 100.0),
        ("drive", "V", "drive (V)", 0.1),
        ("session", "s", "time in the session (s)", 0.1),
        ("phase", "1", "phase of the period", 0.1),
    ],
)
def test_each_axis_has_its_name_and_unit(axis, unit, label, first):
    drawn = plot.signature(entry(axis=axis, unit=unit, period=None), "GHz").axes[0]
    assert drawn.get_xlabel() == label
    assert drawn.lines[0].get_xdata()[0] == pytest.approx(first)


def test_the_slope_of_a_gain_is_in_percent():
    axis = plot.signature(entry(axis="gain", unit="s", period=None), "GHz").axes[0]
    assert axis.get_ylabel() == "slope of the residual (%)"
    assert axis.lines[0].get_ydata()[0] == pytest.approx(2.0)


def test_runs_stand_in_their_order_beside_the_noise():
    axis = DiagnosisPlots(diagnosis()).runs().axes[0]
    assert [label.get_text() for label in axis.get_xticklabels()] == ["a", "b"]
    assert [bar.get_height() for bar in axis.patches] == pytest.approx([100, 300, 0, 20])
    assert axis.lines[0].get_ydata()[0] == pytest.approx(15.0)


def test_pictures_go_into_axes_of_the_users_own():
    figure = plot.Picture()
    axis, other = figure.subplots(1, 2)
    plots = DiagnosisPlots(diagnosis())
    assert plots.answers(ax=axis) is figure and plots.runs(ax=other) is figure


def test_without_a_signature_the_error_says_where_to_look():
    with pytest.raises(ValueError, match=r"names no effect .*\.plot\.runs\(\)"):
        DiagnosisPlots(diagnosis(signature=[])).signature()


def test_another_effect_is_refused_with_those_there_are():
    with pytest.raises(ValueError, match="'creep', but there are signatures of etalon alone"):
        DiagnosisPlots(diagnosis()).signature("creep")


def test_the_table_has_a_row_for_each_answer():
    table = Diagnosis.to_dataframe(diagnosis())  # pyright: ignore[reportArgumentType]
    assert list(table.index) == ["etalon", "none"]
    assert table.loc["etalon", ["probability", "closed", "in_set"]].tolist() == [0.9, 0.95, True]
    assert np.isnan(table.loc["none", "closed"])
