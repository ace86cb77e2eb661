"""What a digitizer gave, as fringes of one run or, before a target, as fringe records."""

import numpy as np

from hardware.digitizer._base import Samples
from rapi_jax import Drive
from rapi_jax.ranging import FringeRecord, FringeRecords
from rapi_jax.readout import Fringes

from ._file import BenchFile

_AHEAD = 0.01  # periods; a turn closer to the beginning is not read as one


def to_fringes(samples: Samples, file: BenchFile) -> Fringes:
    """One run, times counted from the drive's start, with what the file says of the optics."""
    optics = file.optics
    return Fringes(
        interferometer=samples.codes["interferometer"],
        cavity=samples.codes.get("cavity"),
        sample_hz=samples.sample_hz,
        start_s=samples.start_s - file.digitizer.latency_s,
        delay_s=optics.delay_s,
        fsr_ghz=optics.fsr_ghz,
        full_scale=samples.full_scale,
    )


def to_fringe_records(
    samples: Samples, file: BenchFile, drive: Drive, *, periods: int, start_s: float, number: int
) -> FringeRecords:
    """One record, cut to `periods` periods from the drive's start on, with what the file says.

    Codes stay codes where all inputs have one scale; otherwise they become volts (float32).
    `start_s`: session time of the drive's start, s.
    """
    hz, latency_s = samples.sample_hz, file.digitizer.latency_s
    first = max(0, int(np.ceil((latency_s - samples.start_s) * hz - 1e-6)))
    part = slice(first, first + round(periods / drive.rate * hz))
    scales = {samples.volts_per_code[name] for name in file.digitizer.range_inputs()}
    if len(scales) == 1:
        columns = {name: codes[part] for name, codes in samples.codes.items()}
        volts_per_code, full_scale = scales.pop(), samples.full_scale
    else:
        columns = {
            name: (samples.zero_v[name] + samples.volts_per_code[name] * codes[part]).astype("f4")
            for name, codes in samples.codes.items()
        }
        volts_per_code, full_scale = 1.0, None
    optics = file.optics
    record = FringeRecord(
        measurement=columns["measurement"],
        interferometer=columns["interferometer"],
        cavity=columns.get("cavity"),
        start_s=start_s + samples.start_s + first / hz - latency_s,
        rising_at_start=_rises(drive, file),
        name=f"record{number:02d}",
    )
    return FringeRecords(
        records=(record,),
        sample_hz=hz,
        excitation_hz=drive.rate,
        interferometer_path_m=optics.interferometer_path_m,
        cavity_spacing_hz=optics.fsr_ghz * 1e9 if "cavity" in columns else None,
        waveform=drive.waveform if drive.waveform in ("triangle", "sine") else "other",
        wavelength_m=optics.wavelength_m,
        air=None if file.air is None else file.air.of(),
        volts_per_code=volts_per_code,
        full_scale=full_scale,
    )


def _rises(drive: Drive, file: BenchFile) -> bool:
    """Whether the optical frequency rises a hundredth of a period after the drive's start."""
    at = np.array([_AHEAD, 2 * _AHEAD]) / drive.rate
    early, late = np.interp(at, drive.time, drive.value)
    up = bool(late > early) == (file.amplifier.gain > 0)
    return up == file.optics.rises_with_voltage
