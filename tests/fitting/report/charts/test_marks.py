"""Where values lie in a chart, and what is drawn of them."""

import math

import hypothesis
import hypothesis.strategies as st
import pytest

from fitting.report.charts._axis import Axis, make_axis, make_log_axis, round_values
from fitting.report.charts._heatmap import draw_heatmap
from fitting.report.charts._marks import (
    Areas,
    Boxes,
    draw_areas,
    draw_boxes,
    draw_dots,
    draw_line,
    plain_level,
    signed_level,
)

UNIT = (Axis("x", 0.0, 1.0), Axis("y", 0.0, 1.0))


def test_places_are_percent_of_the_axis():
    assert Axis("x", 2.0, 4.0).place(2.5) == 25.0
    assert Axis("x", 1.0, 100.0, log=True).place(10.0) == pytest.approx(50.0)
    assert Axis("x", 1.0, 100.0, log=True).place(0.0) is None
    assert Axis("x", 0.0, 1.0).place(None) is None and Axis("x", 0.0, 1.0).place(math.nan) is None


@hypothesis.given(
    st.floats(-1e6, 1e6, allow_subnormal=False), st.floats(1e-6, 1e6), st.integers(2, 8)
)
def test_ticks_are_round_and_on_the_axis(low, width, count):
    hypothesis.assume(width > 1e-9 * abs(low))
    found = round_values(low, low + width, count)
    assert 1 <= len(found) <= count + 1
    steps = [b - a for a, b in zip(found, found[1:], strict=False)]
    slack = 1e-6 * width + 1e-9 * abs(low)
    assert all(low - slack <= v <= low + width + slack for v in found)
    for step in steps:
        first = step / 10.0 ** math.floor(math.log10(step) + 1e-6)
        assert min(abs(first - m) for m in (1, 2, 5, 10)) < 1e-2


@pytest.mark.parametrize("values", [[], [None], [3.0], [0.0], [math.nan, 2.0]])
@pytest.mark.parametrize("make", [make_axis, make_log_axis])
def test_an_axis_of_few_values_still_has_a_width(make, values):
    axis = make("x", values)
    assert axis.low < axis.high and all(0 <= at <= 100.01 for at, _ in axis.places)


def test_a_line_has_a_gap_where_a_value_is_missing():
    line = draw_line(UNIT, [0.0, 0.5, 0.6, 1.0], [0.0, None, 0.5, 1.0], "red")
    assert line.path == "M0 1000M600 500L1000 0"
    dots = draw_dots(UNIT, [(0.0, 1.0, "a"), (None, 1.0, "b")], "red")
    assert dots.places == [("0", "0", "a", "dot")]


def test_many_rectangles_lose_their_texts_and_most_of_their_size():
    boxes = [(float(i % 50), float(i // 50), 1.0, 1.0, f"p{i % 3}", "text") for i in range(2000)]
    few, many = draw_boxes(boxes[:10]), draw_boxes(boxes)
    assert isinstance(few, Boxes) and few.places[1] == ("1", "0", "1", "1", "p1", "text")
    assert isinstance(many, Areas) and many == draw_areas(boxes)
    assert sum(path.count("z") for _, path in many.paths) == 2000
    assert sum(len(path) for _, path in many.paths) < 25 * 2000


def test_levels_are_symmetric_and_zero_is_the_background():
    assert [signed_level(v, 2.0) for v in (-2.0, -0.01, 0.0, 2.0)] == ["n12", "z", "z", "p12"]
    assert signed_level(1.0, 0.0) == "z"
    assert [plain_level(v) for v in (0.0, 0.5, 1.0, 2.0)] == ["v0", "v6", "v12", "v12"]


def test_cells_meet_half_way_and_say_what_they_are():
    panel = draw_heatmap(
        "k", [1.0, 2.0, 4.0], [("a", [1.0, None, -2.0])], title="x", unit="MHz", x_name="phase"
    )
    boxes = panel.marks[0]
    assert isinstance(boxes, Boxes)
    (x, _, w, _, level, text), last = boxes.places
    assert (float(x), float(w)) == (0.0, pytest.approx(100 * 1.0 / 4.5, abs=0.01))
    assert level == "p6" and text.replace("\xa0", " ") == "a, phase 1.00: +1.00 MHz"
    assert last[4] == "n12" and panel.rows == ["a"]
