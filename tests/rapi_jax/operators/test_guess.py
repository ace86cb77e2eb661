"""First guesses: programs that are compiled once, however many recordings of one shape follow."""

import jax
import pytest

from rapi_jax import RAPI, GeneralRAPI
from rapi_jax.examples import paper_recording


@pytest.mark.parametrize("operator", [RAPI, GeneralRAPI])
def test_another_recording_of_the_same_shape_compiles_nothing(operator, caplog):
    """What each fit adds is never freed: after some hundred the process would run out of maps."""
    first, second = (paper_recording(samples=300, periods=1, seed=k)[0] for k in (1, 2))
    operator.initial_guesses(first)
    with jax.log_compiles(), caplog.at_level("WARNING"):
        operator.initial_guesses(second)
        assert not [m for m in caplog.messages if "ompil" in m]
        operator.initial_guesses(second, plays=3)
        assert [m for m in caplog.messages if "ompil" in m]  # so the log would have shown one
