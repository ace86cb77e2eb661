"""What is not searched for: told from one model, the same faults are found as by the searches."""

import pytest
from edge_worlds import drives, record
from worlds import TRUTHS, ordered

from fitting.identification._options import solver_options
from fitting.identification._posed import Posed
from fitting.identification.data_checks.runs._first_order import (
    may_be_changed,
    may_be_exchanged,
    may_be_reversed,
)
from fitting.identification.problem._problem import Problem
from rapi_jax import ECDL, RAPI
from rapi_jax.internal import float64
from tests.support.spoiled import WAYS, healthy

STEPS = solver_options(120)


@float64
def posed_of(recording) -> tuple[Posed, ECDL]:
    model = ECDL(RAPI.guess(recording))
    posed = Posed.of(model, recording, None, "uniform", history=True, drift=None)
    end = posed.problem.solve(posed.problem.start(model), posed.weight, STEPS)
    return posed, posed.problem.model(end.values)


@float64
@pytest.mark.parametrize(
    ("way", "kind", "asks"),
    [
        ("one run times 1.02", "run does not belong", may_be_changed),
        ("responses in another order", "exchanged runs", may_be_exchanged),
        pytest.param(
            "one run times 10", "run does not belong", may_be_changed, marks=pytest.mark.slow
        ),
        pytest.param(
            "one clock wrong", "run does not belong", may_be_changed, marks=pytest.mark.slow
        ),
        pytest.param("time reversed", "reversed time", may_be_reversed, marks=pytest.mark.slow),
        pytest.param("sign flipped, all", "reversed time", may_be_reversed, marks=pytest.mark.slow),
        pytest.param(
            "sign flipped, one run", "run does not belong", may_be_changed, marks=pytest.mark.slow
        ),
    ],
)
def test_a_fault_of_the_runs_is_searched_for_and_found(way, kind, asks):
    """As by the searches of a whole fit, which do not find the last of these ways here."""
    columns = healthy(81)
    WAYS[way](columns)
    posed, model = posed_of(columns.recording())
    problem, weight = posed.problem, posed.weight
    near = problem.evaluate(problem.start(model), weight)
    assert asks(near)
    found = posed.suspicions(model, 60)
    assert [fault.kind for fault in found] == [kind]
    searched = posed.inconsistencies(problem.solve(near.start, weight, STEPS), STEPS)
    assert all((one.kind, one.run) == (found[0].kind, found[0].run) for one in searched)
    assert searched or way == "sign flipped, one run"


@float64
@pytest.mark.parametrize("name", ["etalon", "delay"])
def test_what_an_effect_leaves_no_change_of_runs_explains(name):
    """An order may: these rates are near, and their readings are exchanged at little cost."""
    session = drives((10.0, 20.0, 40.0), amplitudes=(3.0, 2.0))
    posed, model = posed_of(record(session, *ordered((TRUTHS[name],))))
    near = posed.problem.evaluate(posed.problem.start(model), posed.weight)
    assert not may_be_changed(near)
    assert not may_be_reversed(near)


@float64
def test_a_model_that_leaves_noise_is_not_fitted_once_more(monkeypatch):
    session = drives((10.0, 20.0, 40.0), amplitudes=(3.0, 2.0))
    posed, model = posed_of(record(session, *ordered(())))
    for name in ("solve", "refine"):
        monkeypatch.setattr(Problem, name, lambda *_, **__: pytest.fail("fitted once more"))
    assert posed.suspicions(model, 60) == []


@float64
def test_an_evaluation_is_what_a_fit_says_at_its_end():
    """Without the solver: the same errors, values and derivatives; and half their squares."""
    recording = healthy(82).recording()
    model = ECDL(RAPI.guess(recording))
    posed = Posed.of(model, recording, None, "uniform", history=True, drift=None)
    end = posed.problem.solve(posed.problem.start(model), posed.weight, STEPS)
    here = posed.problem.evaluate(end.start, posed.weight)
    assert here.error == pytest.approx(end.error)
    assert here.values == pytest.approx(end.values)
    assert here.jacobian == pytest.approx(end.jacobian)
    assert 0.5 * ((posed.weight * here.error) ** 2).sum() == pytest.approx(end.cost)
