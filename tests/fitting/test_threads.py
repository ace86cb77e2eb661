"""Linear algebra with one thread: inside a function, and as before it afterwards."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fitting._threads import ONE_THREAD, one_blas_thread


def blas_threads():
    """Of each library for linear algebra in this process."""
    np.ones((2, 2)) @ np.ones((2, 2))
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


@pytest.fixture(autouse=True)
def three(monkeypatch):
    """A process with three threads, whatever its environment says."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with threadpool_limits(limits=3, user_api="blas"):
        assert set(blas_threads()) == {3}
        yield


@one_blas_thread
def inside(do=blas_threads):
    return do()


def test_inside_there_is_one_and_afterwards_as_many_as_before():
    assert set(inside()) == {1}
    assert set(blas_threads()) == {3}


def test_a_function_inside_another_leaves_the_outer_one_at_one():
    def both():
        return inside(), blas_threads()

    assert all(set(found) == {1} for found in inside(both))
    assert set(blas_threads()) == {3}


def test_an_error_restores_too():
    def fail():
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        inside(fail)
    assert set(blas_threads()) == {3}


def test_a_process_started_with_one_thread_is_left_alone(monkeypatch):
    for name, value in ONE_THREAD.items():
        monkeypatch.setenv(name, value)
    assert set(inside()) == {3}
