"""Drives in place of their noisy readings, where they repeat."""

import dataclasses
from collections.abc import Sequence
from typing import Literal

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.display._readable_unit import quantity
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._run import Run
from rapi_jax.recording._waveform_miss import describe_swap
from rapi_jax.sampling._white_noise import white_noise_rms

from ._mean_period import average_periods
from ._nearest_waveform import waveform_misses
from ._run_start import start_at_turn
from ._shared_levels import share_levels
from ._waveform_fit import FittedWaveform, fit_waveform

_AVERAGE = "Take the average of its periods instead: `--drive-as averaged`."

DriveAs = Literal["measured", "averaged", "fitted"]


def clean_drives(runs: Sequence[Run], way: DriveAs, unit: str) -> tuple[list[Run], list[str]]:
    """The runs with their drives as `way` says, and what was done: of each run, then of several.

    - "averaged": the mean over a run's periods at equal phases; of a triangle or sine that
      waveform, and beside it as many harmonics as stand above the noise.
    - "fitted": the triangle or sine that lies nearest; runs of equal levels share them.

    `unit` is that of the drives. A drive that does not repeat stays. Raises `DataError` where a
    triangle or sine is asked for and a drive is another waveform.

    >>> import numpy as np
    >>> from rapi_jax import Drive, Run, triangle
    >>> from rapi_jax.io.imports.cleaning._clean import clean_drives
    >>> (sent,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=600, periods=3)  # Hz, V
    >>> noise = 0.002 * np.random.default_rng(0).standard_normal(600)  # V
    >>> run = Run(Drive(sent.time, sent.value + noise, 10.0, "triangle"), sent.value, "run00")
    >>> (made,), notes = clean_drives([run], "fitted", "V")
    >>> bool(np.abs(made.drive.value - sent.value).max() < 1e-3)  # V
    True
    """
    if way == "measured":
        return list(runs), []
    drives = [run.drive for run in runs]
    found = share_levels(drives, [fit_waveform(drive) for drive in drives])
    made, notes, slower = [], [], []
    swap = describe_swap(runs, THRESHOLDS.commanded_ratio, THRESHOLDS.commanded)
    for run, one in zip(runs, found, strict=True):
        try:
            drive, note = _clean(run.drive, one, way, run.name, unit)
        except DataError as error:
            if swap is None:
                raise
            what = str(error).removesuffix(_AVERAGE)
            raise DataError(
                f"{what}But {swap}; then give `--drive-as averaged`, the average of its periods."
            ) from error
        whole = dataclasses.replace(run, drive=drive)
        made.append(whole if one is None else start_at_turn(whole, one))
        notes.append(f"{run.name}: {note}")
        slower += [run.name] if drive is not run.drive and _is_slow(run.drive, drive) else []
    if any(one is not None for one in found):
        notes.append(
            "The standard errors of a fit do not include how uncertain the drives are that stand "
            "in place of their readings"
        )
    if slower:
        notes.append(
            f"{', '.join(slower)}: from sample to sample the drive's readings change by less than "
            "they differ from what stands in their place, so the difference is slower than noise. "
            "If the device saw it, too, keep the readings (`--drive-as measured`)"
        )
    return made, notes


def _clean(
    drive: Drive, found: FittedWaveform | None, way: DriveAs, name: str, unit: str
) -> tuple[Drive, str]:
    if not drive.periods or drive.u_pp == 0:
        return drive, "the drive does not repeat, so its readings stay as they are"
    base = np.zeros(drive.size) if found is None else found(drive.time)
    rate = drive.rate if found is None else found.rate
    rest, kept = average_periods(drive, drive.value - base, rate, constant=found is None)
    step = _resolution(drive.value)
    if way == "fitted":
        _check_shape(found, rest, step, drive, name, unit)
    if way == "fitted" or (found is not None and np.abs(rest).max() <= step):
        rest, kept = np.zeros(drive.size), 0  # less than a step may be the converter's rounding
    value = base + rest
    whole = drive.period >= 0  # a broken end may be that of another run
    left = float(np.std((drive.value - value)[whole]))
    note = (
        f"in place of the drive's readings is {_describe(drive, way, found, kept, unit)}; the "
        f"readings differ from it by {quantity(left, unit)} rms"
    )
    if found is not None:  # four quantities are fitted: two levels, phase and rate
        known = 2.0 * left / float(np.sqrt(whole.sum()))
        note += f", and it is uncertain by about {quantity(known, unit)}"
    made = dataclasses.replace(drive, value=value)
    own = dataclasses.replace(made, excitation_hz=rate)
    return (own if own.periods >= drive.periods else made), note


def _is_slow(measured: Drive, made: Drive) -> bool:
    """Whether readings differ from what was made of them by more than their white noise."""
    whole = measured.period >= 0
    left = float(np.std((measured.value - made.value)[whole]))
    white = max(white_noise_rms(measured.value), _resolution(measured.value) / np.sqrt(12.0))
    return bool(left > THRESHOLDS.averaged_noise * white)


def _check_shape(
    found: FittedWaveform | None,
    rest: np.ndarray,
    step: float,
    drive: Drive,
    name: str,
    unit: str,
) -> None:
    """Refuse a waveform that the mean period departs from by more than a `step` of the converter.

    `rest`: by how much, at each sample.
    """
    if found is None:
        raise DataError(
            f"{name}: its drive is a {drive.waveform}, and only a triangle or a sine is fitted by "
            f"`--drive-as fitted`. {_AVERAGE}"
        )
    most = float(np.abs(rest).max())
    if most > max(THRESHOLDS.waveform_miss * drive.u_pp, step):
        raise DataError(
            f"{name}: its drive is no {drive.waveform}: the mean of its periods departs from the "
            f"nearest one by up to {most:.2g} {unit}, {100 * most / drive.u_pp:.2g} % of the "
            f"swing. {_other_waveform(drive)}{_AVERAGE}"
        )


def _other_waveform(drive: Drive) -> str:
    """What to say where a drive is a sine and was taken for a triangle, or the other way round."""
    kind, miss = min(waveform_misses(drive).items(), key=lambda item: item[1])
    if kind == drive.waveform or miss >= THRESHOLDS.shape:
        return ""
    return (
        f"It is nearer to a {kind}, from which it departs by {100 * miss:.2g} % of its swing rms: "
        f"give `--waveform {kind}`. Or: "
    )


def _describe(
    drive: Drive, way: str, found: FittedWaveform | None, kept: int | None, unit: str
) -> str:
    if found is not None and way == "fitted":
        return found.describe(unit)
    text = f"the average over its {drive.periods} period(s)"
    if kept is None:
        return text
    harmonics = f"harmonics up to number {kept}"
    if found is None:
        return f"{text}, by {harmonics}"
    return f"{text}, {found.describe(unit)}" + (f", with {harmonics} beside it" if kept else "")


def _resolution(value: np.ndarray) -> float:
    """The usual step between the levels of a converter; 0 where values hardly repeat."""
    levels = np.unique(value)
    if not 1 < levels.size < THRESHOLDS.converter_levels * value.size:
        return 0.0
    return float(np.median(np.diff(levels)))
