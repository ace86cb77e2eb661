"""The same readings given twice: a file named twice, or copied."""

from collections.abc import Sequence

from rapi_jax._errors import DataError
from rapi_jax.recording._identical import identical_runs
from rapi_jax.recording._run import Run


def check_repeats(runs: Sequence[Run], sources: Sequence[str]) -> None:
    """Refuse two runs of the same readings; `sources`: where each run is from, for the message."""
    found = identical_runs(runs)
    if found:
        one, other = found[0]
        raise DataError(
            f"{runs[one].name} (of {sources[one]}) and {runs[other].name} (of {sources[other]}) "
            "hold the same readings, sample for sample. Give each file once: a run that stands "
            "twice is predicted from its own copy."
        )
