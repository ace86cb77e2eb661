"""Runs that are copies of others."""

from rapi_jax import Recording
from rapi_jax.internal import identical_runs

from ._fault import Fault


def find_copies(recording: Recording) -> list[Fault]:
    """Runs that hold the samples of an earlier run: noise does not repeat, so one is a copy."""
    runs = recording.runs
    return [
        Fault(
            "copied run",
            runs[other].name,
            f"run {runs[other].name!r} holds the same drive and the same readings as run "
            f"{runs[one].name!r}, sample for sample: a file was given twice. A run left out would "
            "be predicted from its own copy, and standard errors would be too small. Leave one of "
            "the two out.",
            ((0, runs[other].drive.size - 1),),
        )
        for one, other in identical_runs(runs)
    ]
