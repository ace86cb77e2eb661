"""What a measurement wrote of its own reading of fringes, where that was doubtful."""

from rapi_jax import Recording

_FAULTS = "_faults"  # as a bench writes them into a recording's provenance


def describe_doubtful_readings(recording: Recording) -> list[str]:
    """A note for each run whose fringes were read doubtfully.

    >>> from fitting.identification.data_checks.readings._doubtful import describe_doubtful_readings
    >>> from rapi_jax.examples import paper_recording
    >>> describe_doubtful_readings(paper_recording(samples=400, periods=2)[0])
    []
    """
    notes = []
    for name, text in recording.provenance.items():
        if not name.endswith(_FAULTS):
            continue
        notes.append(
            f"fringes: reading run {name.removesuffix(_FAULTS)!r} was doubtful: {shorten(text)}. "
            "Where its noise is larger than that of the other runs, record it again."
        )
    return notes


def shorten(text: str) -> str:
    """The first two of what was doubtful in a run, and how many more there are."""
    lines = [line.strip() for line in text.split(";")]
    more = f", and {len(lines) - 2} more of this kind in the manifest" if lines[2:] else ""
    return f"{'; '.join(lines[:2])}{more}"
