"""Units in which sizes are read, and what pictures of many readings show."""

import dataclasses
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rapi_jax import DriveLimits, Recording, compensate, linear_scan, plot, predict, sine, triangle
from rapi_jax.examples import paper_device
from rapi_jax.internal import in_interval, interval_digits, quantity, readable_unit
from rapi_jax.plot._style import DOWN, MEASURED, MODEL, PALETTE, UP


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.004, "uC", "4 nC"),
        (8.86e-7, "uC", "886 fC"),
        (2e-12, "uC", "0.002 fC"),
        (0.0427, "GHz", "42.7 MHz"),
        (3e-9, "V", "3 nV"),
        (5e-7, "um", "0.5 pm"),
        (12.0, "K", "12 K"),
        (0.0042, "mrad", "4.2 urad"),
        (0.5, "rad", "0.5 rad"),
        (1.96e-8, "s", "19.6 ns"),
        (0.45, "s", "450 ms"),
        (2500.0, "mT", "2.5 T"),
        (0.0, "uC", "0 uC"),
    ],
)
def test_a_size_has_one_to_three_digits_before_the_point(value, unit, text):
    assert quantity(value, unit) == text


@pytest.mark.parametrize(
    ("low", "high", "texts"),
    [
        (212.6, 219.9, ("212.6", "219.9")),
        (18.66, 21.14, ("18.7", "21.1")),
        (210.0, 224.2, ("210", "224")),
        (9.96, 10.9, ("9.96", "10.90")),
        (0.0011, 3.4, ("0.0011", "3.4")),  # an end far below the width keeps two digits
        (0.0, 5.0, ("0", "5.0")),
        (-3.2e-5, 4.1e-5, ("-3.2e-05", "4.1e-05")),
        (21234.0, 35678.0, ("21000", "36000")),
        (5.0, 5.0, ("5.00", "5.00")),
        (2.0, float("inf"), ("2.00", "inf")),
    ],
)
def test_ends_of_an_interval_have_the_digits_that_its_width_needs(low, high, texts):
    assert (in_interval(low, high - low), in_interval(high, high - low)) == texts


@given(low=st.floats(1e-6, 1e6), factor=st.floats(1e-6, 1e3))
def test_rounded_ends_lie_within_a_tenth_of_the_width(low, factor):
    """The second digit of the width is at most a tenth of it, and rounding half of that."""
    width = factor * low
    for end in (low, low + width):
        assert 2 <= interval_digits(end, width) <= 12
        assert abs(float(in_interval(end, width)) - end) <= 0.0501 * width + 1e-11 * end


def test_one_unit_for_several_sizes():
    assert readable_unit("um", (0.2, float("nan"), 0.003)) == ("nm", pytest.approx(1e3))


def recorded(drive, factor=1.0, unit="GHz"):
    response = factor * (10.0 * drive.value + 3.0 * np.sin(drive.value))
    return dataclasses.replace(Recording.of([drive], [response]), response_unit=unit)


def labels(picture):
    return [text.get_text() for text in picture.legends[0].get_texts()]


def test_many_readings_of_a_loop_are_a_median_and_a_band():
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=20_000)
    axis = plot.loops(recorded(drive)).axes[0]
    assert len(axis.collections) == 2  # a band for each branch
    assert labels(axis.figure) == ["measured, with 95 % band"]
    assert max(line.get_xdata().size for line in axis.lines) < 1000


def test_few_readings_and_loops_inside_loops_are_points():
    (drive,) = sine(10.0, amplitude=4.0, bias=3.0, samples=400)
    assert labels(plot.loops(recorded(drive))) == ["measured"]
    (drive,) = sine(10.0, amplitude=4.0, bias=3.0, samples=6000)
    several = dataclasses.replace(drive, waveform="multisine")
    assert labels(plot.loops(recorded(several))) == ["measured, one of 10 readings"]


def test_a_loop_of_a_tiny_charge_has_its_unit():
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=400)
    axis = plot.loops(recorded(drive, 1e-6, "uC")).axes[0]
    assert axis.get_ylabel() == "response less a straight line (pC)"


def residuals_of(samples):
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=samples)
    noise = np.random.default_rng(0).standard_normal(samples)
    recording = Recording.of([drive], [10.0 * drive.value + 0.02 * noise])
    return plot.residuals(recording, [10.0 * drive.value], [np.ones(samples, bool)]).axes[0]


def test_what_is_drawn_of_noise_follows_the_number_of_readings():
    few, some, many = (residuals_of(samples) for samples in (100, 800, 80_000))
    assert [line.get_marker() for line in few.lines[:-1]] == [".", "."]  # the last is the zero
    for axis in (some, many):
        assert len(axis.collections) == 2  # bands
        assert max(len(line.get_xdata()) for line in axis.lines) < 1000
    for axis in (few, some, many):
        assert labels(axis.figure) == ["up", "down"]
        assert axis.get_title().endswith("MHz rms left")


def test_an_error_says_of_which_periods_it_is():
    """Loops show the last one, residuals all."""
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=400, periods=2)
    error = np.where(drive.period == 0, 0.03, 0.01) * np.where(np.arange(400) % 2, 1.0, -1.0)
    recording = Recording.of([drive], [10.0 * drive.value + error])
    model = [10.0 * drive.value]
    (loop,), (left,) = (
        figure.axes
        for figure in (
            plot.loops(recording, model),
            plot.residuals(recording, model, [np.ones(400, bool)]),
        )
    )
    assert loop.get_title().endswith("off by 10.0 MHz rms in the last period")
    assert left.get_title().endswith("22.4 MHz rms left in all periods")


def test_the_band_holds_95_percent_of_few_readings_too():
    band = residuals_of(800).collections[0].get_paths()[0].vertices[:, 1]
    width = np.median(band[band > 0]) - np.median(band[band < 0])  # MHz, of 20 MHz of noise
    assert width == pytest.approx(2 * 1.96 * 20.0, rel=0.1)


def test_titles_name_the_swing_where_runs_differ_in_it():
    small, large = (triangle(10.0, amplitude=v, bias=3.0, samples=400)[0] for v in (2.0, 4.0))
    for drives, names in (
        ((small, large), ["run00, 10 Hz, 2 V", "run01, 10 Hz, 4 V"]),
        ((large, large), ["run00, 10 Hz", "run01, 10 Hz"]),
    ):
        recording = Recording.of(drives, [10.0 * drive.value for drive in drives])
        assert [axis.get_title() for axis in plot.loops(recording).axes] == names


def test_predictions_say_how_far_off_they_are_and_draw_noise_as_a_band():
    (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=4000)
    noise = np.random.default_rng(0).standard_normal(4000)
    recording = Recording.of([drive], [10.0 * drive.value + 0.02 * noise])
    top, bottom = plot.predictions(recording, [10.0 * drive.value]).axes
    assert top.get_title().startswith("run00, 10 Hz: the prediction is off by 2")
    assert (top.get_ylabel(), bottom.get_ylabel()) == ("response (GHz)", "difference (MHz)")
    assert len(bottom.collections) == 1


def test_of_a_drive_alone_the_prediction_fills_the_picture():
    pair = triangle([10.0, 20.0], amplitude=4.0, bias=3.0, samples=400)
    responses = [10.0 * drive.value for drive in pair]
    nothing = np.full(400, np.nan)
    (alone,) = plot.predictions(Recording.of(pair[:1], [nothing]), responses[:1]).axes
    assert alone.get_xlabel() == "time (s)" and alone.get_ylabel() == "response (GHz)"
    both = plot.predictions(Recording.of(pair, [nothing, responses[1]]), responses)
    labels = ["response (GHz)", "response (GHz)", "difference (Hz)"]
    assert [axis.get_ylabel()[:8] for axis in both.axes] == [label[:8] for label in labels]


def test_a_picture_in_a_notebook_is_small_and_a_transparent_one_stays_so():
    axis = residuals_of(800)
    shown = axis.figure._repr_png_()
    assert shown[25] == 3  # a palette
    assert len(shown) < 60_000
    axis.figure.patch.set_alpha(0.0)
    assert axis.figure._repr_png_()[25] == 6  # red, green, blue and alpha


def test_lines_keep_their_colours_in_a_png():
    from matplotlib.colors import to_rgb
    from PIL import Image

    figure = plot.Picture(figsize=(6.0, 4.0))
    axis = figure.subplots()
    colours = (MEASURED, MODEL, UP, DOWN, *PALETTE)
    for k, colour in enumerate(colours):
        axis.plot([0.0, 1.0], [k, k], color=colour, lw=2)
        axis.fill_between([0.0, 1.0], k, k + 1.0, color=colour, alpha=0.25, lw=0)
    with Image.open(io.BytesIO(plot.png(figure))) as picture:
        shown = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(float)
    for colour in colours:
        wanted = 255.0 * np.array(to_rgb(colour))
        assert np.abs(shown - wanted).max(1).min() < 8.0


def test_a_narrow_picture_has_its_axes_one_below_another():
    drives = triangle([10.0, 20.0, 40.0], amplitude=4.0, bias=3.0, samples=400)
    recording = Recording.of(drives, [10.0 * drive.value for drive in drives])
    picture = plot.loops(recording)
    plot.narrowed(picture)
    picture.draw_without_rendering()
    boxes = [axis.get_position() for axis in picture.axes if axis.get_visible()]
    assert len(boxes) == 3
    assert len({round(box.x0, 3) for box in boxes}) == 1
    assert boxes[0].y0 > boxes[1].y1 and boxes[1].y0 > boxes[2].y1


@pytest.mark.parametrize("narrow", [False, True])
@pytest.mark.parametrize("count", [2, 12, 24])
def test_a_matrix_fills_its_picture_and_has_its_colour_bar_below(count, narrow):
    picture = plot.correlation([f"parameter {k}" for k in range(count)], np.eye(count))
    picture = plot.narrowed(picture) if narrow else picture
    picture.draw_without_rendering()
    matrix, bar = (axis.get_window_extent() for axis in picture.axes)
    assert bar.y1 < matrix.y0 and bar.height < 0.2 * matrix.height
    assert bar.x0 == pytest.approx(matrix.x0, abs=3.0)
    assert bar.width == pytest.approx(matrix.width, rel=0.02)
    drawn = picture.get_tightbbox().height
    assert picture.get_size_inches()[1] - drawn < 0.05 * drawn + 0.15  # no empty bands


def test_several_drives_are_compared_with_the_slowest():
    limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    targets = [one for rate in (20.0, 10.0) for one in linear_scan(rate, span=60.0, samples=512)]
    made = [compensate(paper_device(), one, bias=3.0, limits=limits) for one in targets]
    axes = plot.compensation(made, "GHz", "V").axes
    assert len(axes) == 4 and "10 Hz" in axes[-1].get_title()
    fast, slow = (np.asarray(line.get_ydata()) for line in axes[-1].lines)
    assert np.abs(slow).max() < 1e-12
    expected = made[0].drive.value - made[1].drive.value  # of equal samples a period
    np.testing.assert_allclose(fast, expected, atol=1e-12)


def test_a_compensation_shows_itself_and_gives_its_numbers():
    limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    (target,) = linear_scan(20.0, span=60.0, samples=512)
    made = compensate(paper_device(), target, bias=3.0, limits=limits)
    table = made.to_dataset()
    assert table.attrs == {"excitation_hz": 20.0, "inverse": "exact"}
    assert [table[name].attrs["units"] for name in table] == ["V", "GHz", "GHz"]
    np.testing.assert_array_equal(table["drive"].values, made.drive.value)
    np.testing.assert_array_equal(table["time_s"].values, made.drive.time)
    own = plot.Picture()
    axis = own.subplots()
    assert made.plot.error(ax=axis) is own and "20 Hz" in axis.get_title()
    (line,) = (one for one in axis.lines if len(one.get_ydata()) == 512)
    assert np.abs(line.get_ydata()).max() < 1.0  # in the finest unit: rounding
    bare = dataclasses.replace(made, predicted=None, inverse="paper")
    assert "predicted" not in bare.to_dataset()
    with pytest.raises(ValueError, match="no forward model"):
        bare.plot.error()


def noisy(unit: str = "um", size: float = 0.1) -> tuple:
    """A recording of two swings with noise of 2 nm, its model's response, and what is used."""
    drives = [
        *triangle([10.0, 20.0, 40.0], amplitude=4.5, bias=3.0, samples=400),
        *triangle([10.0, 20.0, 40.0], amplitude=0.9, bias=3.0, samples=400),
    ]
    truth = [size * np.asarray(predict(paper_device(), drive)) for drive in drives]
    noise = 0.02 * size * np.random.default_rng(0).standard_normal((6, 400))
    recording = Recording.of(drives, list(np.array(truth) + noise), response_unit=unit)
    return recording, truth, [np.ones(400, bool)] * 6


@pytest.mark.parametrize("narrow", [False, True])
def test_no_legend_lies_on_what_is_drawn(narrow):
    recording, truth, used = noisy()
    for picture in (
        plot.residuals(recording, truth, used),
        plot.spectrum(recording, truth, used),
        plot.loops(recording, truth),
    ):
        picture = plot.narrowed(picture) if narrow else picture
        picture.draw_without_rendering()
        (legend,) = picture.legends
        box = legend.get_window_extent()
        assert 0.0 <= box.x0 and box.x1 <= picture.bbox.width
        shown = [axis for axis in picture.axes if axis.get_visible()]
        assert not any(box.overlaps(axis.get_tightbbox()) for axis in shown)


def test_a_picture_gives_one_quantity_in_one_unit():
    recording, truth, used = noisy()
    for picture, unit in (
        (plot.residuals(recording, truth, used), "nm"),
        (plot.loops(recording, truth), "nm"),  # the smallest loop is below 1 um
        (plot.spectrum(recording, truth, used), "nm/√Hz"),
    ):
        labels = {axis.get_ylabel() for axis in picture.axes}
        assert len(labels) == 1 and labels.pop().endswith(f"({unit})")
    differences = {axis.get_ylabel() for axis in plot.predictions(recording, truth).axes}
    assert differences == {"response (μm)", "difference (nm)"}
    straight = Recording.of(
        [run.drive for run in recording.runs],
        [20.0 * run.drive.value for run in recording.runs],
    )
    bent = Recording.of([run.drive for run in recording.runs], [10.0 * y for y in truth])
    axes = plot.scans(bent, straight).axes
    assert len({axis.get_ylabel() for axis in axes[2:]}) == 1


def test_an_overview_names_axes_in_the_colours_of_their_lines_and_says_what_is_left_out():
    drives = triangle(list(10.0 * np.arange(1, 9)), amplitude=2790.0, bias=3.0, samples=100)
    recording = Recording.of(drives, [drive.value for drive in drives], response_unit="um")
    picture = plot.overview(recording)
    assert picture.get_suptitle() == "the first 6 of 8 runs"
    left = [axis for axis in picture.axes if axis.get_ylabel() and axis.get_lines()]
    for axis in left:
        if axis.get_ylabel().startswith("drive") or axis.yaxis.get_label_position() == "right":
            assert axis.yaxis.label.get_color() == axis.get_lines()[0].get_color()
    assert {axis.get_ylabel() for axis in left} == {"drive (V)", "response (μm)"}
    assert any("ms" in axis.get_xlabel() for axis in left)
    whole = Recording.of(drives[:6], [drive.value for drive in drives[:6]])
    assert plot.overview(whole).get_suptitle() == ""


def test_titles_have_no_power_of_ten():
    drives = [*triangle([201770.0], amplitude=2790.0, bias=0.0, samples=64)]
    drives += triangle([201770.0], amplitude=1000.0, bias=0.0, samples=64)
    recording = Recording.of(drives, [drive.value for drive in drives])
    titles = [axis.get_title() for axis in plot.loops(recording).axes]
    assert titles == ["run00, 201.77 kHz, 2790 V", "run01, 201.77 kHz, 1000 V"]
    assert "time (μs)" in {axis.get_xlabel() for axis in plot.overview(recording).axes}


def test_starts_that_no_step_improved_are_told_in_words():
    (axis,) = plot.convergence([("a", [(0, 1.01e-3)], True), ("b", [(0, 1.01e-3)], True)]).axes
    assert not axis.axison and not axis.lines
    assert "2 of 2 ended with nearly the response of the lowest cost" in axis.texts[0].get_text()
    (axis,) = plot.convergence([("a", [(0, 9.0), (1, 1.0)], True), ("b", [(0, 1.0)], True)]).axes
    assert axis.axison and len(axis.lines) == 2
