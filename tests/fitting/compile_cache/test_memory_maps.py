"""Compiled programs are forgotten before a process has too many memory maps."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.blind.prediction import _predict, _workers
from fitting.compile_cache._memory_maps import count_maps, forget_programs

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/maps").exists(), reason="this system does not tell memory maps"
)


@pytest.fixture
def program():
    """A compiled program, and how often it was compiled."""
    compiled = []

    @jax.jit
    def double(x):
        compiled.append(x.shape)  # once a compilation
        return 2.0 * x

    double(jnp.ones(3))
    return double, compiled


def test_programs_stay_below_the_limit_and_go_above_it(program):
    double, compiled = program
    forget_programs(most=count_maps() + 1000)
    double(jnp.ones(3))
    assert len(compiled) == 1
    forget_programs(most=10)
    assert np.all(double(jnp.ones(3)) == 2.0)
    assert len(compiled) == 2


def test_programs_of_many_shapes_are_what_takes_maps():
    jax.clear_caches()
    before = count_maps()
    function = jax.jit(lambda x: jnp.cumsum(jnp.sin(x)))
    for size in range(1, 60):
        function(np.ones(size))
    held = count_maps()
    forget_programs(most=0)
    assert held >= before + 59 > count_maps()


def test_a_worker_of_a_bank_forgets_them_after_each_job(program, monkeypatch):
    double, compiled = program
    monkeypatch.setattr(_predict, "predict_one", lambda job, refused: double(jnp.ones(3)))
    monkeypatch.setattr(_workers, "forget_programs", lambda: forget_programs(most=0))
    _workers._run_job(_workers.Job("recording", None, "output", "tree"))
    double(jnp.ones(3))
    assert len(compiled) == 2
