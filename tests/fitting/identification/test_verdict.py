"""What a verdict says of held-out data, whatever was fitted."""

from fitting.identification.assessment._cross_validation import HeldOut
from fitting.identification.assessment._verdict import _check_held_out


def test_held_out_data_are_judged_where_the_fit_leaves_nothing():
    """As where one run alone moves: fits of the others are exact."""
    held_out = [HeldOut("last third", 0.2, 0.2, 0.1, 0.0, 100)]
    reasons, notes = _check_held_out(held_out, 1.0, 0.0, repeats=True)
    assert notes == [] and len(reasons) == 1
    assert "held-out rmse 0.2 is not the zero of the fitted part" in reasons[0]


def test_the_error_of_held_out_data_is_given_in_times_that_of_the_fitted_part():
    held_out = [HeldOut("last third", 0.2, 0.2, 0.1, 0.02, 100)]
    (reason,), _ = _check_held_out(held_out, 1.0, 0.01, repeats=True)
    assert "held-out rmse 0.2 is 10.0 times that of the fitted part" in reason


def test_runs_that_do_not_predict_one_another_are_said_to():
    """Two devices in one recording, or two rates and swings too far apart to tell."""
    missed = [
        HeldOut(f"rate {row} Hz", 0.2, 0.2, 0.2, 0.01, 100, runs=(row,), inside=False)
        for row in range(2)
    ]
    reasons, notes = _check_held_out(missed, 1.0, 0.01, repeats=True)
    assert reasons == [] and "no run is predicted from the others" in notes[-1]
    predicted = [missed[0], HeldOut("rate 1 Hz", 0.01, 0.01, 0.01, 0.01, 100, runs=(1,))]
    _, notes = _check_held_out(predicted, 1.0, 0.01, repeats=True)
    assert not any("no run is predicted" in note for note in notes)
