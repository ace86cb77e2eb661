"""One drive at a time through the generator's output, while the digitizer records."""

import contextlib
import dataclasses
from collections.abc import Callable, Iterator

from hardware.bench._file import BenchFile
from hardware.bench._thresholds import THRESHOLDS
from hardware.digitizer._base import AbstractDigitizer, Acquisition, Samples
from hardware.generator._base import AbstractOutput
from hardware.laser._base import AbstractLaser
from rapi_jax import Drive

from ._settings import RecordSettings
from ._watchdog import allowed_s, count_cycles, watchdog_of


class DrivePlayer:
    """Loads a drive while the output is off, plays it, and records it once it has settled.

    `history`: what was played in this session. `settings`: what the instruments were set to in the
    last scan, as JSON.
    """

    def __init__(
        self,
        file: BenchFile,
        output: AbstractOutput,
        digitizer: AbstractDigitizer,
        laser: AbstractLaser | None,
        *,
        began_s: float,
        now: Callable[[], float],
        sleep: Callable[[float], None],
    ) -> None:
        """`began_s`: when the session began, by `now`.

        Raises `DataError` where the file asks for a watchdog that the output does not have.
        """
        self.history: list[str] = []
        self.settings = "{}"
        self._file = file
        self._output, self._digitizer, self._laser = output, digitizer, laser
        self._began_s, self._now, self._sleep = began_s, now, sleep
        self._watchdog = watchdog_of(output, file)

    def session_s(self) -> float:
        """Time since the session began, s."""
        return self._now() - self._began_s

    def record(self, drive: Drive) -> tuple[Samples, Drive, str]:
        """One drive: loaded, played, settled, recorded, parked and off; with all settings."""
        asked = self.acquisition(drive)
        with self.playing(drive, asked) as settings:
            start_s = self.session_s()
            samples = self.fetch(drive, asked)
            settings.check()
        return samples, dataclasses.replace(drive, start_s=start_s), settings.text()

    def acquisition(self, drive: Drive) -> Acquisition:
        """The record of one drive."""
        at = self._file.digitizer
        margin_s = min(at.margin_s, THRESHOLDS.margin_fraction / drive.rate)
        length_s = drive.periods / drive.rate + at.latency_s
        return Acquisition(at.inputs(), margin_s, length_s + margin_s, at.sample_hz)

    def count(self, drive: Drive, asked: Acquisition, records: int = 1) -> int | None:
        """After how many periods the output ends the drive by itself; `None`: it does not."""
        if self._watchdog is None:
            return None
        most = self._watchdog.most_cycles
        return count_cycles(drive, asked, self._file, most=most, records=records)

    @contextlib.contextmanager
    def playing(
        self, drive: Drive, asked: Acquisition, records: int = 1
    ) -> Iterator[RecordSettings]:
        """The drive is loaded, played and settled; in the end parked and off.

        Gives the settings, which were the same before and after the settling.
        """
        file, output = self._file, self._output
        cycles = self.count(drive, asked, records)
        instruments = {"generator": output, "digitizer": self._digitizer, "laser": self._laser}
        settings = RecordSettings(instruments)
        if self._laser is not None:
            self._laser.check()
            self._laser.check_emission()
        self._digitizer.configure(asked)
        if self._watchdog is not None:
            self._watchdog.set_watchdog(cycles)
        wave = output.load_drive(drive, points=file.generator.points)
        try:
            output.start()
            settings.begin()
            self.settings = settings.text()
            self.history.append(
                f"{self.session_s():.3f} s: {wave.low_v:g} to {wave.high_v:g} V at "
                f"{wave.frequency_hz:g} Hz, {drive.waveform}"
            )
            self._sleep(file.settling / drive.rate)
            settings.check()
            yield settings
        finally:
            output.off()

    def fetch(self, drive: Drive, asked: Acquisition) -> Samples:
        """The record of the next trigger."""
        self._digitizer.arm()
        resource = getattr(self._output, "resource", "")
        seconds = allowed_s(self._watchdog, drive, asked, resource=resource)
        return self._digitizer.fetch(seconds).check(asked)
