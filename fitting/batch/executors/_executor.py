"""What a batch asks of whoever computes its jobs."""

import abc

from fitting.batch._do import Ended
from fitting.batch.jobs._job import Job


class AbstractExecutor(abc.ABC):
    """Computes jobs, in an order of its own."""

    @property
    @abc.abstractmethod
    def running(self) -> int:
        """Jobs submitted whose end was not yet told."""

    @property
    @abc.abstractmethod
    def free(self) -> int:
        """How many jobs more it takes now."""

    @abc.abstractmethod
    def submit(self, job: Job) -> None:
        """Take a job."""

    @abc.abstractmethod
    def wait(self, timeout: float) -> list[Ended]:
        """The jobs that ended since it was last asked; waits up to `timeout` s for one.

        Raises `BatchError` where nothing can be computed any more.
        """
