"""One thread for linear algebra: of processes side by side, and of a function. Imports no NumPy."""

import functools
import os
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

# Read when NumPy and JAX are imported, and when the first program is compiled (XLA: `NPROC`). With
# a thread for each processor, processes side by side wait for each other: eight diagnoses, two at a
# time on two processors, took 85 s, and with these 73, with the same answers to the last digit.
ONE_THREAD = dict.fromkeys(
    ("MKL_NUM_THREADS", "NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
)


def one_blas_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Run `function` with one thread for linear algebra, then leave the process as it was.

    Its products are many and small: a second thread gains nothing, and is waited for wherever
    something else runs. Sums do not depend on the number of processors, either. Of several Python
    threads at once the first one decides, as threadpoolctl does it. Where the process was started
    with one thread, nothing is looked up.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        if os.environ.items() >= ONE_THREAD.items():
            return function(*args, **kwargs)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return wrapped
