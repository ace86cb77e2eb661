"""Held-out data tell nothing of an effect beside an operator that misfits more than the effect."""

import numpy as np
import pytest
from bare import bare

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedErrors
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._ranking import is_hidden_by_operator
from rapi_jax.effects import Delay

LINES = 1000
DELAY = Delay(tau=1e-5)


def left(a_line: float) -> State:
    """A refit that leaves so much of chi-square a synchronous line."""
    root = np.full(LINES, np.sqrt(a_line))
    errors = WhitenedErrors(raw=[], synchronous=root, nonsynchronous=np.zeros(0))
    return bare(State, errors=errors, prior_cost=0.0)


def candidate(on_density: float, *, measured: bool = True, effects=(DELAY,)) -> Candidate:
    whitener = bare(Whitener, spectrum=bare(Spectrum, measured=measured))
    return bare(
        Candidate,
        effects=effects,
        refit=bare(Refit, whitener=whitener),
        on_flexible_base=left(on_density),
    )


@pytest.mark.parametrize(
    ("on_density", "without", "end", "hidden"),
    [
        (0.95, 130.0, 126.0, True),  # a density of plays explains what the operator cannot
        (0.95, 130.0, 20.0, False),  # most of the excess is closed on the operator, too
        (4.0, 130.0, 126.0, False),  # more is left than hysteresis: something else is missing
        (0.95, 1.0, 1.0, False),  # nothing to close
    ],
)
def test_only_an_operator_that_misfits_beside_a_density_that_does_not(
    on_density, without, end, hidden
):
    assert is_hidden_by_operator(candidate(on_density), left(without), left(end)) is hidden


def test_never_without_measured_noise_or_without_an_effect():
    assert not is_hidden_by_operator(candidate(0.95, measured=False), left(130.0), left(126.0))
    assert not is_hidden_by_operator(candidate(0.95, effects=()), left(130.0), left(126.0))
