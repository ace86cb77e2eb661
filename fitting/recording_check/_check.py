"""A recording checked without a fit: its runs, its faults, and what may be asked of it."""

import dataclasses
from typing import Any

import numpy as np

from fitting._units import quantity
from fitting.identification.data_checks._data_checks import check_usable, find_faults
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.data_checks.drives._drive_noise import (
    find_swapped_columns,
    foresee_drive_noise,
)
from fitting.identification.data_checks.drives._drive_reading import (
    describe_cure,
    find_reading_noise,
)
from fitting.identification.data_checks.holds._sweeps import describe_creep, single_sweep
from fitting.identification.data_checks.periods._odd_periods import (
    find_odd_periods,
    find_unsettled,
)
from fitting.identification.data_checks.readings._doubtful import describe_doubtful_readings
from fitting.identification.data_checks.readings._levels import find_resolution
from rapi_jax import DataError, Identified, Recording
from rapi_jax.internal import describe_swap, is_read_from_fringes, takes

from ._following import find_unrelated
from ._questions import Question, ask
from ._runs import RunSummary
from ._thresholds import THRESHOLDS as CHECK

_SWAPPED = "columns: "  # begins the note of exchanged columns


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecordingCheck:
    """What `check_recording` found.

    - `recording`: what was checked. `runs`: each run in numbers.
    - `faults`: what a fit would not be trusted for, with run and samples. `questions`: what may be
      asked. `notes`: what does not speak against a fit.

    >>> from fitting import check_recording
    >>> from rapi_jax.examples import paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> checked = check_recording(recording)
    >>> [question.answer for question in checked.questions][0]
    'yes'
    >>> checked
    <RecordingCheck: sound, 4 run(s), 0 note(s)>
    """

    recording: Recording
    runs: tuple[RunSummary, ...]
    faults: tuple[Fault, ...]
    questions: tuple[Question, ...]
    notes: tuple[str, ...]

    @property
    def sound(self) -> bool:
        """Whether nothing was found for which a fit would not be trusted."""
        return self.questions[0].answer != "no"

    @property
    def unsettled(self) -> tuple[str, ...]:
        """Names of the runs whose first period is unlike their later ones, or did not close."""
        told = {fault.run for fault in self.faults if fault.kind == "unsettled start"}
        return tuple(run.name for run in self.runs if not run.settled or run.name in told)

    @property
    def swapped(self) -> bool:
        """Whether drive and response are likely exchanged: a fault, or a note, that says so."""
        told = any(note.startswith(_SWAPPED) for note in self.notes)
        return told or any(fault.kind == "columns swapped" for fault in self.faults)

    @property
    def noise(self) -> float:
        """Rms of the noise over all runs, in the response's unit."""
        weight = [run.samples - run.masked for run in self.runs]
        return float(np.sqrt(np.average([run.noise**2 for run in self.runs], weights=weight)))

    @property
    def resolution(self) -> float:
        """The largest step between the values of a digitised reading; 0 where none is digitised."""
        return max(find_resolution(run.response[run.valid]) for run in self.recording.runs)

    def summary(self, name: str = "recording") -> str:
        """The same as text for people; `name`: of the recording."""
        from fitting.report.recording_check._terminal import render_text

        return render_text(self, name)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        state = "sound" if self.sound else f"{len(self.faults)} fault(s)"
        return f"<RecordingCheck: {state}, {len(self.runs)} run(s), {len(self.notes)} note(s)>"

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(self.summary())}</pre>"

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, text and lists, as `rapi check --json` prints them."""
        data = self.recording
        return {
            "schema": "rapi.check/1",
            "sound": self.sound,
            "response_unit": data.response_unit,
            "drive_unit": data.drive_unit,
            "response_origin": data.response_origin,
            "response_lag_s": data.response_lag_s,
            "noise": self.noise,
            "identified": Identified.of(data).to_dict(),
            "runs": [run.to_dict() for run in self.runs],
            "faults": [dataclasses.asdict(fault) for fault in self.faults],
            "questions": [question.to_dict() for question in self.questions],
            "notes": list(self.notes),
            "data_sha256": data.sha256(),
        }


UNUSABLE = "unusable run"  # kind of a fault for which a fit raises


@takes(recording=Recording)
def check_recording(recording: Recording) -> RecordingCheck:
    """What is in `recording`, what is wrong with it, and what it allows; without a fit.

    The checks are those that `identify` makes before its fit, and of those after it the one for
    noise of the drive. What shows only beside a model (mode hops, runs that do not belong) is not
    looked for.

    Raises `TypeError` where `recording` is not a `Recording`, `DataError` where a run has no
    reading that is a number.

    >>> from fitting import check_recording
    >>> from rapi_jax.examples import paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> checked = check_recording(recording)
    >>> len(checked.runs), [fault.name for fault in checked.faults]
    (4, [])
    """
    faults = find_recording_faults(recording)
    refused = {fault.run for fault in faults if fault.kind == "unsettled start"}
    # Other faults make periods differ, too; a drive that was read with noise does not.
    comparable = all(fault.kind in ("unsettled start", "noisy drive") for fault in faults)
    found = find_unsettled(recording.runs) if comparable else []
    unsettled = [one for one in found if one.run not in refused]
    late = refused | {one.run for one in unsettled}
    late &= {run.name for run in recording.runs if run.drive.periods > 1}
    runs = tuple(
        RunSummary.of(run, recording.response_lag_s, settled=run.name not in late)
        for run in recording.runs
    )
    questions = ask(recording, runs, faults, unsettled)
    notes = [] if single_sweep(recording) else describe_creep(recording)
    return RecordingCheck(
        recording,
        runs,
        tuple(faults),
        tuple(questions),
        (
            *notes,
            *_swap_notes(recording, faults),
            *_drive_notes(recording, runs, faults),
            *_period_notes(recording, faults),
            *describe_doubtful_readings(recording),
            *_sampling_notes(runs),
        ),
    )


def find_recording_faults(recording: Recording) -> list[Fault]:
    """What a fit would not be trusted for, of all that shows without one.

    Raises `DataError` where a run has no reading that is a number.

    >>> from fitting.recording_check._check import find_recording_faults
    >>> from rapi_jax.examples import paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> find_recording_faults(recording)
    []
    """
    unusable = _find_unusable(recording)
    if any(not run.valid.any() for run in recording.runs):
        raise DataError(unusable[0].message)
    faults = [*unusable, *find_faults(recording), *find_swapped_columns(recording)]
    faults = faults or find_unrelated(recording)
    if all(fault.kind == "unsettled start" for fault in faults):
        faults += foresee_drive_noise(recording)
    return faults


def _find_unusable(recording: Recording) -> list[Fault]:
    """Runs without a complete period, or with a lag that is too long for them, as faults."""
    found = []
    for run in recording.runs:
        try:
            check_usable(dataclasses.replace(recording, runs=(run,)))
        except DataError as error:
            found.append(Fault(UNUSABLE, run.name, str(error), ((0, run.drive.size - 1),)))
    return found


def _swap_notes(recording: Recording, faults: list[Fault]) -> list[str]:
    """Columns that are likely swapped, where no fault says so."""
    told = any(fault.kind == "columns swapped" for fault in faults)
    if told or is_read_from_fringes(recording.provenance):
        return []
    said = describe_swap(recording.runs, THRESHOLDS.commanded_ratio, CHECK.commanded)
    return [] if said is None else [f"{_SWAPPED}{said}."]


def _drive_notes(
    recording: Recording, runs: tuple[RunSummary, ...], faults: list[Fault]
) -> list[str]:
    """Noise of the drive's reading that a fit does not refuse, but will leave."""
    noise = {run.name: run.noise for run in runs}
    large = [
        one
        for one in ([] if faults else find_reading_noise(recording))
        if one.in_response > CHECK.drive_noise_share * noise[one.run.name]
    ]
    if not large:
        return []
    most = max(large, key=lambda one: one.in_response)
    count, unit = len(large), recording.response_unit
    where = f"run {most.run.name!r}" if count == 1 else f"{count} runs, most in {most.run.name!r}"
    size, own = (quantity(x, unit) for x in (most.in_response, noise[most.run.name]))
    return [
        f"drive noise: the drive as written carries noise of {most.rms:.2g} "
        f"{recording.drive_unit} rms ({where}) that the response does not follow: noise of its "
        f"reading, or the steps of its converter. A model turns it into {size} rms of "
        f"response, where the noise of the response is {own} rms. {describe_cure(most.run)}"
    ]


def _period_notes(recording: Recording, faults: list[Fault]) -> list[str]:
    """Single periods that are unlike the others of their run."""
    notes = []
    for one in [] if faults else find_odd_periods(recording.runs):
        run = next(run for run in recording.runs if run.name == one.run)
        begin, end = (run.drive.time[run.drive.period == one.period][i] for i in (0, -1))
        most, shift = (quantity(x, recording.response_unit) for x in (one.most, abs(one.shift)))
        notes.append(
            f"odd period: period {one.period + 1} of run {one.run!r} ({begin:.4g} to {end:.4g} s) "
            f"is unlike its other periods, by {most} at most, besides a shift of {shift}: more "
            "than noise explains. The device jumped there, or the reading did. Look at the record "
            "there; where it is the reading, record that run again."
        )
    return notes


def _sampling_notes(runs: tuple[RunSummary, ...]) -> list[str]:
    notes = []
    masked = [run for run in runs if run.masked]
    if masked:
        named = ", ".join(f"{run.masked} of run {run.name!r}" for run in masked[:3])
        notes.append(f"masked: readings that are not finite are left out ({named}).")
    held = [run for run in runs if run.holds]
    if held:
        named = ", ".join(f"{run.holds} in run {run.name!r}" for run in held[:3])
        notes.append(
            f"holds: the drive rests ({named}). There creep can be seen, but hysteresis cannot."
        )
    started = [run for run in runs if run.noise_from == "samples" and not run.periods]
    if started:
        named = ", ".join(repr(run.name) for run in started[:3])
        notes.append(
            f"uncycled start: run {named} does not repeat, so what the device did before the "
            "record is not known. It is fitted, too. Let the drive run for two periods before "
            "recording."
        )
    whole = sum(run.samples for run in runs)
    if whole > THRESHOLDS.fitted_samples:
        notes.append(
            f"long recording: a fit uses {THRESHOLDS.fitted_samples} of its {whole} samples."
        )
    return notes
