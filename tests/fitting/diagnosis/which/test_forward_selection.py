"""Forward selection: beside which effects a second one is looked for."""

import numpy as np
import pytest
from bare import bare
from edge_worlds import drives, record
from worlds import ordered

from fitting.diagnosis.refit._gauss_newton import State
from fitting.diagnosis.refit._whitened_model import WhitenedErrors, WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._excess import exceeds_chance, is_unexplained
from fitting.diagnosis.which._forward_selection import (
    explains_most,
    may_be_two_at_once,
    select_effects,
)
from rapi_jax.effects import Delay, Etalon, Pickup


def test_where_a_pair_explains_the_data_it_is_not_looked_for_from_its_other_member():
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    etalon = Etalon(amplitude=0.3, spacing=15.0, phase=0.4)
    pickup = Pickup.at(amplitude=0.3, hertz=50.0)
    lines: list[str] = []
    fitted = fit_base(WhitenedModel.of(record(session, etalon, pickup)), None)
    found = select_effects(fitted, (Etalon, Pickup), lines.append)
    assert found.best.name == "etalon+pickup"
    assert len([line for line in lines if line.endswith("and another")]) == 1


def test_a_second_effect_is_looked_for_where_more_is_left_than_chance_leaves():
    """Beside an etalon a lag of 12 us: 1.24 of chi-square a line, as a poor base may leave."""
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    etalon = Etalon(amplitude=0.3, spacing=15.0, phase=0.4)
    lag = Delay.at(tau=1.2e-5)
    fitted = fit_base(WhitenedModel.of(record(session, *ordered((lag, etalon)))), None)
    found = select_effects(fitted, (Delay, Etalon), lambda line: None)
    (alone,) = (c.on_flexible_base for c in found.candidates if c.name == "etalon")
    assert exceeds_chance(alone) and not is_unexplained(alone)
    assert found.best.name == "delay+etalon" and not exceeds_chance(found.best.on_flexible_base)


def left(excess: float) -> Candidate:
    """A candidate that leaves so much above the number of its lines, 100."""
    lines = np.full(100, np.sqrt(1.0 + excess / 100.0))
    state = bare(State, errors=WhitenedErrors([], lines, np.zeros(0)))
    return bare(Candidate, on_flexible_base=state)


@pytest.mark.parametrize(
    ("pairs", "most"), [([9000.0, 3900.0], True), ([9000.0, 4100.0], False), ([], False)]
)
def test_a_pair_explains_most_where_it_leaves_less_than_four_tenths(pairs, most):
    assert explains_most(left(10_000.0), [left(x) for x in pairs]) is most


@pytest.mark.parametrize(
    ("singles", "pairs", "searched"),
    [
        ([9000.0, 3900.0], [], False),  # one alone explains most, and nothing beside it
        ([9000.0], [3900.0], False),
        ([9000.0], [], True),
        ([9000.0], [8900.0], True),
        ([], [], True),
    ],
)
def test_two_at_once_are_searched_where_neither_one_nor_a_pair_explains_most(
    singles, pairs, searched
):
    alone, together = ([left(x) for x in some] for some in (singles, pairs))
    assert may_be_two_at_once(left(10_000.0), alone, together) is searched
