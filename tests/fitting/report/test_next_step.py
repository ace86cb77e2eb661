"""What a fit, a batch and an interrupted command say is to be done next."""

import types

import pytest
from cyclopts import App

from fitting.commands.run import INTERRUPTED, run
from fitting.report.batch._text import write_headline
from fitting.report.fit._next_step import describe_next
from fitting.report.fit._table import held_out_sizes

GAP = "poor fit: beyond noise the model leaves 125 MHz rms."


def advice(*reasons: str, gap: bool = False) -> str:
    return describe_next(reasons, with_gap=gap, source="lab/my scans")


def test_where_the_model_lacks_something_a_diagnosis_comes_first():
    for reasons in ((GAP,), (GAP, "not predicted: rate 10 Hz")):
        assert "`rapi diagnose 'lab/my scans' -o diagnosis`" in advice(*reasons)
        assert "Mend" not in advice(*reasons)


def test_readings_left_out_are_not_called_nothing():
    note = (
        "outliers: run 'run00': 47 readings far from those before and after. Left out of the fit."
    )
    plain, other = (
        describe_next((GAP,), notes=(n,)) for n in ("one scan rate: record more.", note)
    )
    assert plain.startswith("Nothing was found wrong with the recording: ")
    assert other.startswith("Nothing was found wrong with the recording but for the readings left")
    assert "rapi diagnose" in other


def test_where_the_recording_has_a_fault_that_comes_first():
    assert advice(GAP, "noisy drive: run 'run00'").startswith("Mend what is listed")
    assert advice("starts disagree: 6 starts").startswith("Mend what is listed")


def test_a_run_that_is_not_predicted_may_be_sound():
    said = advice("not predicted: run run05: held-out rmse 353 nm is 3.2 times that")
    assert "Mend" not in said and "`rapi diagnose 'lab/my scans' -o diagnosis`" in said


def test_an_operator_that_another_note_names_is_no_better_law():
    """With one swing the laws of the thresholds are one, and the advice would repeat itself."""
    note = "no inverse: by this model ... Fit another operator (`--operator FixedRAPI`), or record."
    for reasons, gap in (((GAP,), False), ((), True)):
        said = describe_next(reasons, with_gap=gap, source="r", notes=(note,))
        assert "Another law" not in said


def test_trusted_models():
    said = describe_next((), folder="lab/my fit")
    assert said.startswith("`rapi compensate 'lab/my fit' --span SPAN --frequency HZ -o drives`")
    assert "`rapi compensate`" in advice() and "`rapi diagnose" in advice(gap=True)


def test_another_law_of_the_thresholds_comes_before_a_diagnosis():
    note = "thresholds fixed in V describe these runs better: rapi fit R --operator FixedRAPI"
    wanted = "`rapi fit 'lab/my scans' -o result --operator FixedRAPI`"
    for reasons, gap in (((GAP,), False), ((), True)):
        said = describe_next(reasons, with_gap=gap, source="lab/my scans", notes=(note,))
        assert wanted in said
    assert wanted not in describe_next(("noisy drive: r",), source="lab/my scans", notes=(note,))
    assert wanted not in describe_next((), source="lab/my scans", notes=(note,))


def test_another_law_comes_before_fewer_parameters():
    """A `lam` for each play stands in for thresholds of another law, and is then not determined."""
    free = "unidentifiable: these data cannot fix lam_1. Give all plays one value."
    note = "thresholds fixed in V describe these runs better: rapi fit R --operator FixedRAPI"
    wanted = "`rapi fit r -o result --operator FixedRAPI`"
    for reasons in ((free,), (free, GAP)):
        assert wanted in describe_next(reasons, source="r", notes=(note,))
    assert wanted not in describe_next((free, "clipped: r"), source="r", notes=(note,))
    assert describe_next((free,), source="r").startswith("Mend what is listed")


def test_a_law_that_predicts_another_swing_comes_first_too():
    note = (
        "thresholds fixed in V predict a swing that was left out better, to 40 nm rms and not 300 "
        "nm: rapi fit R --operator FixedRAPI"
    )
    said = describe_next((), with_gap=True, source="r", notes=(note,))
    assert said.startswith(
        "Another law of the thresholds predicts a swing that was left out better: `rapi fit r -o "
        "result --operator FixedRAPI`."
    )


def test_a_batch_without_a_trusted_model_says_how_to_diagnose():
    row = {"status": "done", "trusted": False}
    assert "--do diagnose" in write_headline([row, row])
    assert "--do diagnose" not in write_headline([row, row | {"trusted": True}])
    assert "--do diagnose" not in write_headline([row | {"verdict": "creep"}])


@pytest.mark.parametrize(
    ("command", "says"),
    [("fit", "from the start"), ("batch", "to go on"), ("measure", "finished runs are kept")],
)
def test_an_interrupted_command_says_whether_it_goes_on(capsys, command, says):
    app = App(suppress_keyboard_interrupt=False)

    @app.command(name=command)
    def stopped() -> None:
        raise KeyboardInterrupt

    assert run(app, [command]) == INTERRUPTED
    err = capsys.readouterr().err
    others = {"from the start", "to go on", "finished runs are kept"} - {says}
    assert says in err and not any(other in err for other in others)


def test_a_prediction_that_is_none_does_not_set_the_unit_of_a_table():
    def held(rmse: float, determined: bool) -> types.SimpleNamespace:
        return types.SimpleNamespace(rmse=rmse, train_rmse=0.1, determined=determined)

    table = types.SimpleNamespace(held_out=[held(0.2, True), held(6.6e6, False)])
    assert held_out_sizes(table) == [0.2]  # type: ignore[arg-type]
    table.held_out = table.held_out[1:]
    assert held_out_sizes(table) == [0.1]  # type: ignore[arg-type]
