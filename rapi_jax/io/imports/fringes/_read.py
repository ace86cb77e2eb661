"""Optical frequency of one run from its fringes, and what is to be said of the reading."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._run import Run

from ._optics import cavity_spacing_ghz, interferometer_delay_s

if TYPE_CHECKING:
    from rapi_jax.readout import Fringes, Readout

Samples = Float[np.ndarray, " samples"]


@dataclasses.dataclass(frozen=True)
class FringeOptics:
    """Delay of the interferometer (s), spacing of the cavity (GHz), and sign of the tuning."""

    delay_s: float
    fsr_ghz: float
    sign: float

    @classmethod
    def of(cls, interferometer: str, cavity_spacing: str | None, sign: float) -> "FringeOptics":
        """From numbers with their units. Raises `DataError` where a unit is missing or wrong."""
        spacing = 1.5 if cavity_spacing is None else cavity_spacing_ghz(cavity_spacing)
        return cls(interferometer_delay_s(interferometer), spacing, sign)


def read_fringe_run(
    drive: Drive,
    light: Samples,
    cavity: Samples | None,
    optics: FringeOptics,
    name: str,
) -> tuple[Run, list[str]]:
    """The run of `drive` whose response is the optical frequency, GHz; and notes on it.

    Raises `DataError` where there are no fringes to read.
    """
    from rapi_jax.readout import Fringes, read_fringes  # loads SciPy, which a first fit does not

    fringes = Fringes(
        light, cavity, 1.0 / drive.step_s, delay_s=optics.delay_s, fsr_ghz=optics.fsr_ghz
    )
    quiet = quiet_drive(drive)
    check_present(fringes, quiet)
    readout = read_fringes(fringes, quiet)
    if readout.fringe_noise > THRESHOLDS.fringe_noise:
        raise DataError(
            "no fringes can be followed: the signal departs from fringes by "
            f"{readout.fringe_noise:.2g} rms of their amplitude. Is that the interferometer's "
            "channel, does its light reach the detector, and are there four samples or more a "
            "fringe?"
        )
    run = readout.run(drive, name=name)
    run = dataclasses.replace(run, response=optics.sign * run.response)
    notes = [_describe(readout), *_masked(run), *_undersampled(readout, drive), *readout.faults]
    return run, [f"{name}: {line}" for line in notes]


def check_present(fringes: "Fringes", quiet: Drive) -> None:
    """Raise `DataError` where the fringes are gone for a while: nothing counts them there."""
    from rapi_jax.readout._vanished import find_vanished

    gone = find_vanished(fringes, quiet)
    if gone:
        first, last = (quiet.start_s + at for at in gone[0])
        more = f" (and {len(gone) - 1} more)" if len(gone) > 1 else ""
        raise DataError(
            f"no fringes pass from {first:.6g} to {last:.6g} s of the record{more} although the "
            "drive moves, so their count is lost. Was the light blocked, the laser off or at its "
            "limit there? Leave that part out, or record again."
        )


def quiet_drive(drive: Drive) -> Drive:
    """The drive without the noise of a recorded channel, which would hide where it turns.

    One that repeats becomes its mean period, on a clock of its own; any other one is smoothed.
    """
    each = 1.0 / (drive.rate * drive.step_s) if drive.repeats else 0.0
    bins = min(THRESHOLDS.quiet_samples, int(each / 2))
    if bins < 64:
        width = max(1, drive.size // (2 * THRESHOLDS.quiet_samples))
        from scipy import ndimage

        value = ndimage.uniform_filter1d(drive.value, width, mode="nearest")
        return dataclasses.replace(drive, value=value)
    place = np.floor(drive.time * drive.rate * bins + 0.5).astype(int) % bins
    count = np.bincount(place, minlength=bins)
    if count.min() == 0:
        return drive
    mean = np.bincount(place, drive.value, minlength=bins) / count
    clock = np.arange(bins) / (bins * drive.rate)
    return Drive(clock, mean, drive.excitation_hz, drive.waveform, drive.start_s)


def check_fringes(label: str, what: str, column: Samples) -> None:
    """Raise `DataError` where a sample is not a number: a gap in fringes loses their count."""
    bad = np.flatnonzero(~np.isfinite(column))
    if bad.size:
        raise DataError(
            f"{label}: the {what} has {bad.size} value(s) that are missing or beyond the range, "
            f"the first at sample {bad[0]}. Fringes cannot be counted across a gap: record again, "
            "with a larger vertical range."
        )


def _masked(run: Run) -> list[str]:
    missing = np.flatnonzero(~run.valid)
    if not missing.size:
        return []
    return [
        f"{missing.size} reading(s) of the optical frequency are masked, the first at sample "
        f"{missing[0]} of the run: the fringes are not read there"
    ]


def _undersampled(readout: "Readout", drive: Drive) -> list[str]:
    slope = np.abs(np.diff(readout.frequency)) / np.diff(readout.time)
    fast = float(np.quantile(slope, 0.99)) * readout.delay_s * 1e9  # fringes a second
    each = 1.0 / (fast * drive.step_s)
    if each >= THRESHOLDS.fringe_samples:
        return []
    return [
        f"the fastest fringes have {each:.2g} samples each: fringes faster than half the sampling "
        "rate cannot be told from slower ones. Sample faster, or take a shorter interferometer"
    ]


def _describe(readout: "Readout") -> str:
    span, error = np.ptp(readout.frequency), 1e3 * np.median(readout.stderr)
    text = (
        f"optical frequency from fringes: {span:.4g} GHz, {len(readout.turns)} turn(s) of the "
        f"laser, standard error {error:.2g} MHz a reading, noise "
        f"{100 * readout.fringe_noise:.2g} % rms of a fringe's amplitude"
    )
    if np.isfinite(readout.delay_stderr_s):
        return text + (
            f"; {readout.peaks.size} peaks of the cavity calibrate the interferometer: "
            f"{1e-6 / readout.delay_s:.6g} MHz, {readout.delay_s * 1e9:.6g} ns"
        )
    return text + "; the scale is the interferometer's, as given"
