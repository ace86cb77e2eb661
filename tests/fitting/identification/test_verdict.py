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
