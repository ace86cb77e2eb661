"""All 27 NIST StRD nonlinear regression problems, from both starts, with default settings."""

import functools
from typing import Any

import jax.numpy as jnp
import nist
import numpy as np
import pytest
from jaxtyping import Array

from fitting import LeastSquares, SolverOptions, least_squares

CASES = [(name, start) for name in nist.MODELS for start in (0, 1)]
PARAMETER_DIGITS = 6.0
STDERR_DIGITS = 4.0


@functools.cache
def _residual(name: str) -> Any:
    """One function a problem: both starts share its compiled code."""

    def residual(values: Array, args: Any) -> Array:
        x, y = args
        return nist.MODELS[name](values, x) - y

    return residual


@functools.cache
def _solve(name: str, start: int) -> tuple[LeastSquares, float, float]:
    """The fit, and the correct digits of its parameters and of its standard errors."""
    problem = nist.read(name)
    args = (problem.x, nist.response(problem))
    fit = least_squares(_residual(name), problem.starts[start], args)
    values = nist.digits(fit.values, problem.values)
    return fit, values, nist.digits(fit.stderr, problem.stderr)


def test_files_are_those_of_the_source():
    found = nist.hashes()
    assert all(told == has for told, has in found.values())
    assert {path.name for path in nist.FOLDER.glob("*.dat")} | {"LICENSE-lmfit"} == set(found)
    assert {f"{name}.dat" for name in nist.MODELS} | {"LICENSE-lmfit"} == set(found)
    assert len(nist.MODELS) == 27


@pytest.mark.parametrize("name", nist.MODELS)
def test_model_reproduces_the_certified_sum_of_squares(name):
    problem = nist.read(name)
    args = (problem.x, nist.response(problem))
    residual = np.asarray(_residual(name)(jnp.asarray(problem.values), args))
    # Eleven digits of the parameters leave 1e-11 in residuals that for Lanczos1 are 1e-13.
    assert np.isclose(residual @ residual, problem.squares, rtol=1e-9, atol=1e-20)
    # Not from the header's degrees of freedom: Rat43 says 9 there, the rest of the file 11.
    degrees = residual.size - problem.values.size
    assert np.isclose(problem.squares / problem.spread**2, degrees, rtol=1e-9)


@pytest.mark.parametrize(("name", "start"), CASES)
def test_parameters(name, start):
    fit, values, _ = _solve(name, start)
    assert values >= PARAMETER_DIGITS
    assert fit.converged and not fit.reason
    assert fit.degrees == fit.residual.size - fit.values.size


def test_standard_errors():
    short = [case for case in CASES if _solve(*case)[2] < STDERR_DIGITS]
    # Residuals of Lanczos1 hold three digits in double precision, and so does their spread.
    assert {name for name, _ in short} <= {"Lanczos1"}
    assert len(CASES) - len(short) >= 52


@pytest.mark.parametrize("steps", [1, 80])
@pytest.mark.parametrize(("name", "start"), CASES)
def test_no_wrong_end_is_called_converged(name, start, steps):
    problem = nist.read(name)
    args = (problem.x, nist.response(problem))
    fit = least_squares(
        _residual(name), problem.starts[start], args, options=SolverOptions(max_steps=steps)
    )
    right = nist.digits(fit.values, problem.values) >= PARAMETER_DIGITS
    assert right or not fit.converged
    assert fit.converged == (not fit.reason)


def test_steps_that_run_out_are_no_success():
    problem = nist.read("MGH10")
    args = (problem.x, nist.response(problem))
    fit = least_squares(
        _residual("MGH10"), problem.starts[0], args, options=SolverOptions(max_steps=80)
    )
    assert not fit.converged and fit.reason == "80 steps were not enough"
