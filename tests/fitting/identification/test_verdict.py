"""What a verdict says of starts, rank, misfit and held-out data, whatever was fitted."""

import numpy as np
import pytest

from fitting import Claim
from fitting.identification.assessment._cross_validation import HeldOut
from fitting.identification.assessment._ends import Start
from fitting.identification.assessment._noise import Noise
from fitting.identification.assessment._reasons import (
    check_convergence,
    check_held_out,
    check_misfit,
    check_rank,
    check_starts,
)
from fitting.identification.assessment._verdict import judge
from fitting.identification.data_checks._fault import Fault
from fitting.identification.problem._problem import Problem
from fitting.solver._least_squares import SolverOptions
from rapi_jax.examples import paper_device, paper_recording


def test_held_out_data_are_judged_where_the_fit_leaves_nothing():
    """As where one run alone moves: fits of the others are exact."""
    held_out = [HeldOut("last third", 0.2, 0.2, 0.1, 0.0, 100)]
    reasons, notes = check_held_out(held_out, 1.0, 0.0, repeats=True)
    assert notes == [] and len(reasons) == 1
    assert "held-out rmse 0.2 is larger than that of the fitted part, which is zero" in reasons[0]


def test_the_error_of_held_out_data_is_given_in_times_that_of_the_fitted_part():
    held_out = [HeldOut("last third", 0.2, 0.2, 0.1, 0.02, 100)]
    (reason,), _ = check_held_out(held_out, 1.0, 0.01, repeats=True)
    assert "held-out rmse 0.2 is 10.0 times that of the fitted part" in reason
    (reason,), _ = check_held_out(held_out, 1.0, 0.01, repeats=True, unit="um")
    assert "held-out rmse 200 nm is 10.0 times" in reason


def test_last_periods_that_are_unlike_the_others_are_looked_at_by_check():
    held_out = [HeldOut("last third", 0.3, 0.3, 0.01, 0.003, 100)]
    reasons, notes = check_held_out(held_out, 100.0, 0.01, repeats=True)
    assert reasons == [] and "unlike those before them. `rapi check` names" in notes[0]


def test_runs_that_do_not_predict_one_another_are_said_to():
    """Two devices in one recording, or two rates and swings too far apart to tell."""
    missed = [
        HeldOut(f"rate {row} Hz", 0.2, 0.2, 0.2, 0.01, 100, runs=(row,), inside=False)
        for row in range(2)
    ]
    reasons, notes = check_held_out(missed, 1.0, 0.01, repeats=True)
    assert reasons == [] and "no run is predicted from the others" in notes[-1]
    predicted = [missed[0], HeldOut("rate 1 Hz", 0.01, 0.01, 0.01, 0.01, 100, runs=(1,))]
    _, notes = check_held_out(predicted, 1.0, 0.01, repeats=True)
    assert not any("no run is predicted" in note for note in notes)


def test_an_error_beyond_the_span_left_out_is_no_prediction():
    far = HeldOut("swing 3 V", 6.6e6, 6.6e6, 1.8e5, 0.05, 100, runs=(0,), inside=False)
    assert not far.determined and HeldOut("rate 5 Hz", 0.2, 0.2, 0.9, 0.05, 100).determined
    reasons, (note, *_) = check_held_out([far], 1.0, 0.01, repeats=True, unit="GHz")
    assert reasons == [] and "the rest does not determine the model" in note and "THz" not in note


SPAN, NOISE = 50.0, 0.02  # GHz


def scheme(name, rmse, *, fraction, runs=(), inside=True):
    return HeldOut(name, rmse, rmse, fraction, 0.02, 100, runs=runs, inside=inside)


def test_a_last_third_that_is_not_predicted_speaks_against_the_fit():
    reasons, notes = check_held_out(
        [scheme("last third", 5.0, fraction=0.1)], SPAN, NOISE, repeats=True
    )
    assert reasons[0].startswith("does not generalise") and notes == []


def test_a_run_among_the_others_that_is_not_predicted_speaks_against_the_fit():
    one = scheme("rate 20 Hz", 5.0, fraction=0.1, runs=(1,))
    reasons, _ = check_held_out([one], SPAN, NOISE, repeats=True)
    assert reasons[0].startswith("not predicted: rate 20 Hz")


def test_a_run_beyond_the_others_that_is_not_predicted_is_a_note():
    one = scheme("rate 40 Hz", 5.0, fraction=0.1, runs=(3,), inside=False)
    reasons, notes = check_held_out([one], SPAN, NOISE, repeats=True)
    assert reasons == [] and notes[0].endswith("do not trust it.")


def test_what_is_predicted_is_not_spoken_of():
    small = [scheme("last third", 0.02, fraction=4e-4), scheme("rate", 0.03, fraction=6e-4)]
    assert check_held_out(small, SPAN, NOISE, repeats=True) == ([], [])


@pytest.mark.parametrize(
    ("agree", "said"),
    [
        ([True], "one start only"),
        ([True, False], "starts disagree"),
        ([True, False, False], "starts disagree"),
        ([True, False, True], None),
    ],
)
def test_two_starts_must_end_at_the_best(agree, said):
    starts = [Start("guess", 9, 1.0, True, one, ()) for one in agree]
    reasons = check_starts(starts)
    assert reasons == [] if said is None else reasons[0].startswith(said)


def test_parameters_that_nothing_fixes_are_named():
    assert check_rank(()) == []
    (reason,) = check_rank(("zeta", "alpha"))
    assert reason.startswith("unidentifiable") and "zeta, alpha" in reason


@pytest.fixture(scope="module")
def problem():
    """A recording of a device, as a fit sees it."""
    recording, _ = paper_recording(samples=100, periods=3, noise=NOISE)
    return Problem.of(paper_device(), recording, lambda e: e.operator)


def misfit(problem, rmse, *, span=SPAN, curvature=5.0):
    data = problem.data
    runs = data.use.shape[0]
    noise = Noise(np.full(runs, NOISE), np.full(runs, True), data.use)
    claim = Claim(0.02, 0.018, 0.022, NOISE, curvature, (10.0, 40.0), (4.5, 4.5), 1.0, runs=4)
    return check_misfit(problem, rmse, span, noise, claim)


@pytest.mark.parametrize(
    ("rmse", "said"),
    [
        (NOISE, None),
        (0.5, None),  # a tenth of the curvature
        (0.8, "poor fit: beyond noise"),
        (3.0, "poor fit: beyond noise"),
        (30.0, "nothing explained"),
    ],
)
def test_what_a_model_leaves_is_held_against_curvature_and_variance(problem, rmse, said):
    reasons = misfit(problem, rmse)
    assert reasons == [] if said is None else reasons[0].startswith(said)
    if rmse == 3.0:
        assert (
            "a scan compensated with this model would still be about 60 % as nonlinear"
            in (reasons[0])
        )


def test_a_response_that_never_changes_is_no_signal(problem):
    assert misfit(problem, 0.0, span=0.0) == ["no signal: the response never changes."]


@pytest.fixture(scope="module")
def ends(problem):
    """Where the solver begins, at a rate dependence twice too large, and where it ends."""
    weight = problem.weights(np.ones(problem.data.use.shape[0]))
    far = problem.start(paper_device())
    far[problem.vector.names.index("zeta")] *= 2.0
    return weight, *(problem.solve(far, weight, SolverOptions(max_steps=n)) for n in (0, 300))


def test_a_fit_that_a_further_step_improves_has_not_converged(problem, ends):
    weight, begun, ended = ends
    (reason,) = check_convergence(problem, weight, begun, rmse=1.0, span=SPAN)
    assert reason.startswith("not converged: one more step takes away")
    assert check_convergence(problem, weight, ended, rmse=NOISE, span=SPAN) == []
    # What is left is rounding: no step is asked for.
    assert check_convergence(problem, weight, begun, rmse=0.0, span=SPAN) == []


@pytest.mark.parametrize("left_out", [False, True])
def test_a_fault_of_the_data_speaks_against_the_fit_unless_it_was_left_out(problem, ends, left_out):
    weight, _, ended = ends
    fault = Fault("clipping", "r0", "r0: 3 readings.", left_out=left_out)
    starts = [Start("guess", 9, 1.0, True, True, ())] * 2
    noise = Noise(np.full(4, NOISE), np.full(4, True), problem.data.use)
    stderr = np.zeros(problem.vector.size)
    verdict = judge(problem, weight, ended, starts, [], [fault], stderr, noise, None)
    said = "clipping: r0: 3 readings."
    assert verdict.reasons == (() if left_out else (said,))
    assert verdict.trusted == left_out == (said in verdict.notes)
