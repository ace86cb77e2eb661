"""A part of a record that is one run."""

import dataclasses

from rapi_jax.recording._drive import Waveform


@dataclasses.dataclass(frozen=True)
class Piece:
    """Samples `first` to `last` of a record as one run, and what its drive is."""

    first: int
    last: int
    excitation_hz: float | None
    waveform: Waveform
