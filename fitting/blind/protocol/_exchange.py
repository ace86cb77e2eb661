"""A simulated session as a recording, without anything of the answer."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rapi_jax import DataError, Drive, Recording
from rapi_jax import Run as RecordedRun
from rapi_jax.io import printable, read_recording, write_recording

if TYPE_CHECKING:
    from fitting.blind.simulator._simulated_device import Run


def to_recording(runs: "Sequence[Run]") -> Recording:
    """The runs as a recording in GHz and V."""
    return Recording(tuple(to_run(run, f"run{k:02d}") for k, run in enumerate(runs)))


def to_run(run: "Run", name: str) -> RecordedRun:
    """One run. Steps do not repeat, so they have no rate."""
    rate = None if run.waveform == "step" else run.excitation_hz
    drive = Drive(run.time_s, run.drive, rate, run.waveform, run.start_s)  # pyright: ignore
    return RecordedRun(drive, run.response, name)


def write_verified(recording: Recording, folder: Path) -> None:
    """Write a recording, or keep the same one that is there, and read every number back.

    Raises `DataError` where the folder holds another recording, or numbers come back changed.
    """
    if not folder.exists():
        write_recording(recording, folder)
    if read_recording(folder).sha256() != recording.sha256():
        raise DataError(
            f"{printable(folder)}: holds another recording than its device's, so it was "
            "changed, or another version made it. Remove the bank, or choose another folder."
        )
