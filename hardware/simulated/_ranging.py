"""Fringe records of a simulated laboratory: a drive played on and on before a target."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from rapi_jax import AfgWaveform
from rapi_jax.ranging import FringeRecord, FringeRecords

from ._laboratory import Laboratory
from ._photodiodes import Photodiodes
from .laser._optics import SPEED_OF_LIGHT
from .laser._scan import Scan

# Periods; a turn closer to the beginning (latency, lag) is not read as one.
_AHEAD, _ALONG = 0.01, 0.002


@dataclasses.dataclass(frozen=True)
class _Scans:
    """The laser's frequency in each record of a measurement.

    Where something in the device remembers more than the period, all of the measurement is
    evaluated at once, and the device's drift is that at its start.
    """

    laboratory: Laboratory
    waveform: AfgWaveform
    periods: int
    start_s: float

    def whole(self, records: int) -> Scan | None:
        """All of it, for a device with effects."""
        if self.laboratory.device.repeats:
            return None
        count = self.periods * records
        return self.laboratory.scan(self.waveform, periods=count, start_s=self.start_s)

    def at(self, begin_s: float) -> Scan:
        """With the drift of a record that begins so long after the measurement's start."""
        return self.laboratory.scan(self.waveform, start_s=self.start_s + begin_s)


def fringe_records(
    laboratory: Laboratory,
    waveform: AfgWaveform,
    rng: np.random.Generator,
    *,
    periods: int,
    records: int,
    start_s: float,
    shape: str,
) -> Iterator[FringeRecords]:
    """`records` records of `periods` periods each, one after the other without a gap.

    Each is given with what is known of the set-up, when it is asked for. The drive's start is at
    session time `start_s`; target, drift and the scan's phase go on from record to record.
    """
    hz, rate = laboratory.digitizer.sample_hz, waveform.frequency_hz
    diodes = Photodiodes.of(laboratory, rng)
    scans = _Scans(laboratory, waveform, periods, start_s)
    whole, scan, drifted, centre_ghz = scans.whole(records), None, None, None
    for number in range(records):
        first, end = (round(k * periods / rate * hz) for k in (number, number + 1))
        state = laboratory.drift.at(start_s + first / hz)
        if scan is None or state != drifted:
            scan, drifted = whole or scans.at(first / hz), state
        codes = diodes.codes(scan, first, end - first, start_s=start_s)
        record = FringeRecord(
            measurement=codes[0],
            interferometer=codes[1],
            cavity=codes[2] if len(codes) > 2 else None,
            start_s=start_s + first / hz,
            rising_at_start=_rises(scan, first / hz - laboratory.latency_s),
            name=f"record{number:02d}",
        )
        if centre_ghz is None:  # one for all: the set-up of a measurement does not drift
            centre_ghz = float(scan.nu.min() + scan.nu.max()) / 2.0
        yield set_up(laboratory, record, rate=rate, shape=shape, centre_ghz=centre_ghz)


def set_up(
    laboratory: Laboratory,
    record: FringeRecord,
    *,
    rate: float,
    shape: str,
    centre_ghz: float = 0.0,
) -> FringeRecords:
    """One record with what is known of the laboratory: optics, air, digitizer, scan.

    `centre_ghz`: middle of the scan, where the wavelength is given.
    """
    digitizer, cavity, arm = laboratory.digitizer, laboratory.cavity, laboratory.arm()
    return FringeRecords(
        records=(record,),
        sample_hz=digitizer.sample_hz,
        excitation_hz=rate,
        interferometer_path_m=laboratory.interferometer.delay_s * SPEED_OF_LIGHT,
        cavity_spacing_hz=None if cavity is None else cavity.fsr_ghz * 1e9,
        waveform=shape if shape in ("triangle", "sine") else "other",
        wavelength_m=SPEED_OF_LIGHT / (arm.optical_hz + 1e9 * centre_ghz),
        air=arm.air,
        volts_per_code=digitizer.volts_per_code,
        full_scale=digitizer.full_scale,
    )


def _rises(scan: Scan, at_s: float) -> bool:
    """Whether the frequency rises a hundredth of a period later."""
    now, later = scan.even(at_s + _AHEAD / scan.rate_hz, _ALONG / scan.rate_hz, 2)
    return bool(later > now)
