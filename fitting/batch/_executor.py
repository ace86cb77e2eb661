"""What a batch asks of whoever computes its jobs."""

from typing import Protocol, Self

from ._do import Ended
from ._job import Job


class Executor(Protocol):
    """Computes jobs, in an order of its own. A context: left, it computes no more."""

    @property
    def running(self) -> int:
        """Jobs submitted whose end was not yet told."""
        ...

    @property
    def free(self) -> int:
        """How many jobs more it takes now."""
        ...

    def submit(self, job: Job) -> None:
        """Take a job."""
        ...

    def wait(self, timeout: float) -> list[Ended]:
        """The jobs that ended since it was last asked; waits up to `timeout` s for one.

        Raises `BatchError` where nothing can be computed any more.
        """
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...
