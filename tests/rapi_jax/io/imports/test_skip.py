"""The beginning of each run left out, by periods or by time."""

import numpy as np
import pytest
from scope_files import scanned

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording, read_recording, write_import

T, U, Y = scanned((10.0, 3, 4.5), (40.0, 4, 4.5), sample_hz=8000.0, noise=0.0)


def imported(folder, t=T, u=U, y=Y, **options):
    np.savez(folder / "a.npz", time=t, drive=u, response=y)
    return import_recording(
        folder / "a.npz", ImportOptions(drive_unit="V", response_unit="GHz", **options)
    )


@pytest.mark.parametrize(
    ("options", "asked", "begins", "periods"),
    [
        ({"skip_periods": 1}, "1 period(s)", (800, 2600), [2, 3]),
        ({"skip_periods": 2}, "2 period(s)", (1600, 2800), [1, 2]),
        ({"skip_seconds": 0.025}, "0.025 s", (200, 2600), [2, 3]),
    ],
)
def test_each_run_begins_later_and_says_so(tmp_path, options, asked, begins, periods):
    made = imported(tmp_path, **options)
    runs = made.recording.runs
    assert [run.drive.periods for run in runs] == periods
    for run, first, begin in zip(runs, begins, (0, 2400), strict=True):
        assert run.drive.time[0] == 0.0
        np.testing.assert_allclose(run.drive.start_s, first / 8000.0, rtol=1e-9)
        inside = run.drive.period >= 0
        np.testing.assert_array_equal(run.response[inside], Y[first:][: run.drive.size][inside])
        said = f"{run.name}: the first {asked} are left out, as asked: {first - begin} samples"
        assert any(said in note for note in made.notes)
    write_import(made, tmp_path / "r")
    written = " ".join(map(str, read_recording(tmp_path / "r").provenance.values()))
    assert f"the first {asked} are left out, as asked" in written


def test_a_first_period_from_rest_is_gone(tmp_path):
    """What `rapi check` calls an unsettled start is found with it, and not without it."""
    from fitting import check_recording

    y = Y.copy()
    for begin, period in ((0, 800), (2400, 200)):
        y[begin : begin + period] -= 5.0 * np.exp(-np.arange(period) / (period / 5.0))
    with_it, without = (imported(tmp_path, y=y, skip_periods=n).recording for n in (0, 1))
    assert {fault.kind for fault in check_recording(with_it).faults} == {"unsettled start"}
    assert "--skip-periods 1" in check_recording(with_it).faults[0].message
    assert check_recording(without).faults == ()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"skip_periods": 3}, r"run00: 3 period\(s\) are to be left out .* only 3 whole one"),
        ({"skip_seconds": 0.28}, r"run00: 0\.28 s are to be left out .* none would be left"),
        ({"skip_seconds": 9.0}, r"run00: 9 s are to be left out .* it lasts only 0\.3\d* s"),
    ],
)
def test_what_leaves_nothing_is_refused(tmp_path, options, words):
    with pytest.raises(DataError, match=words):
        imported(tmp_path, **options)


def test_a_drive_that_does_not_repeat_has_no_periods_to_leave_out(tmp_path):
    walk = np.cumsum(np.random.default_rng(0).standard_normal(500))
    t = np.arange(500) / 1000.0
    with pytest.raises(DataError, match="does not repeat. Give a time instead: `--skip-seconds`"):
        imported(tmp_path, t=t, u=walk, y=walk, skip_periods=1)
    (run,) = imported(tmp_path, t=t, u=walk, y=walk, skip_seconds=0.1).recording.runs
    np.testing.assert_array_equal(run.drive.value, walk[100:])


def test_wrong_options_are_refused():
    with pytest.raises(ValueError, match="must be 0 or more"):
        ImportOptions(skip_periods=-1)
    with pytest.raises(ValueError, match="must be 0 or more"):
        ImportOptions(skip_seconds=float("inf"))
    with pytest.raises(ValueError, match="not both"):
        ImportOptions(skip_periods=1, skip_seconds=1.0)
