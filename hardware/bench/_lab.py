"""A bench of instruments: drives are played within limits, and their fringes read."""

import contextlib
import math
import time
from collections.abc import Callable, Sequence

from hardware._closes import ClosesOnExit
from hardware.digitizer._base import AbstractDigitizer, Acquisition
from hardware.digitizer._raw import check_raw_folder, write_samples
from hardware.generator._base import AbstractGenerator, AbstractOutput
from hardware.laser._base import AbstractLaser
from rapi_jax import DataError, Drive, Recording, Run, repeated
from rapi_jax.internal import StrPath
from rapi_jax.ranging import FringeRecords
from rapi_jax.readout import read_fringes

from ._base import AbstractBench
from ._drive_limits import check_against_bench, limits_before_amplifier, refuse_wider
from ._file import BenchFile
from ._fringes import to_fringe_records, to_fringes
from .playback._player import DrivePlayer

Progress = Callable[[int, int, str], None]


class LabBench(AbstractBench, ClosesOnExit):
    """Generator, laser controller and digitizer, opened by `open_bench`; a context manager.

    A drive is what the generator puts out, in V; `limits` hold for the piezo's input behind the
    amplifier. Each run is loaded while the output is off, played from park until it has settled,
    recorded, and parked and switched off again. Settings are read before and after each record; one
    that another user changes meanwhile ends the measurement. `so_far` holds what was recorded when
    a measurement fails; `history` says what was played in this session, and `settings` what the
    instruments were set to in the last scan, as JSON.

    >>> from pathlib import Path
    >>> from hardware import dry_run, read_bench
    >>> from hardware.simulated import bench_toml
    >>> at = {"generator": "GEN", "laser": "LAS", "digitizer": "DIG"}  # VISA addresses
    >>> _ = Path("bench.toml").write_text(bench_toml(at, delay_s=24.5e-9))
    >>> with dry_run(read_bench("bench.toml")).bench as bench:  # `open_bench` for instruments
    ...     bench.limits.high_v  # V at the piezo
    7.5
    """

    def __init__(
        self,
        file: BenchFile,
        generator: AbstractGenerator,
        digitizer: AbstractDigitizer,
        laser: AbstractLaser | None,
        *,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        release: Callable[[], None] = lambda: None,
    ) -> None:
        """Nothing is switched on. `release` is called last when the bench is closed.

        Raises `LimitError`, `InstrumentError`.
        """
        self.limits = file.limits.of()
        self.so_far: tuple[Run, ...] = ()
        self._file = file
        self._generator, self._digitizer, self._laser = generator, digitizer, laser
        self._release = release
        began_s = now()
        generator.set_trigger()
        asked = limits_before_amplifier(self.limits, file)
        self._channel = generator.channel(
            file.generator.channel,
            limits=asked,
            load_ohm=file.generator.load_ohm,
            park_v=file.generator.park_v,
        )
        refuse_wider(self._channel, asked, file.generator.load_ohm)
        self._player = DrivePlayer(
            file, self._channel, digitizer, laser, began_s=began_s, now=now, sleep=sleep
        )

    @property
    def channel(self) -> AbstractOutput:
        """The generator's output."""
        return self._channel

    @property
    def digitizer(self) -> AbstractDigitizer:
        """What reads the photodiodes."""
        return self._digitizer

    @property
    def laser(self) -> AbstractLaser | None:
        """The laser controller, if there is one."""
        return self._laser

    @property
    def history(self) -> list[str]:
        """What was played in this session, a line each."""
        return self._player.history

    @property
    def settings(self) -> str:
        """What the instruments were set to in the last scan, as JSON."""
        return self._player.settings

    def measure(
        self,
        drives: Drive | Sequence[Drive],
        *,
        progress: Progress | None = None,
        raw: StrPath | None = None,
    ) -> Recording:
        """Play each drive and read the optical frequency, GHz, on the drive's own samples.

        All drives are checked first: where one is refused, none is played. Each run has an origin
        of its own, as fringes give relative frequency only. `progress`: called for each run.
        `raw`: an empty folder for what the digitizer gave, written before it is read, for a
        `ReplayDigitizer`. Raises `LimitError`, `DataError`, `OutputError`, `InstrumentError`.
        """
        several = check_against_bench(drives, self._file)
        if raw is not None:
            check_raw_folder(raw)
        for drive in several:
            self._player.count(drive, self._player.acquisition(drive))
        self.so_far, notes = (), {}
        for number, drive in enumerate(several):
            if progress is not None:
                progress(number, len(several), f"{drive.rate:g} Hz")
            name = f"run{number:02d}"
            samples, played, settings = self._player.record(drive)
            notes[f"{name}_settings"] = settings
            if raw is not None:
                about = {"history": self.history[-1], "settings": settings}
                write_samples(samples, raw, name, notes=about)
            readout = read_fringes(to_fringes(samples, self._file), played)
            self.so_far = (*self.so_far, readout.run(played, name=name))
            if readout.faults:
                notes[f"{name}_faults"] = "; ".join(readout.faults)
        if progress is not None:
            progress(len(several), len(several), "")
        return self.recording(notes)

    def record_fringes(
        self,
        drive: Drive,
        *,
        periods: int = 1,
        records: int = 1,
        progress: Progress | None = None,
        store: Callable[[FringeRecords], None] | None = None,
    ) -> FringeRecords:
        """Play `drive` with a target in the measurement arm, and take `records` records.

        Each holds `periods` periods. The drive's first period is repeated; it is played, settled,
        parked and switched off as in `measure`. Each record is of one trigger and begins with the
        drive: between records some periods are missed, and how long a record can be is limited by
        the digitizer's memory at the rate that the file asks for (an error says so). `start_s` of a
        record is known to a period; records are whole periods apart.

        `store`: takes each record as soon as it is there. `so_far` stays empty. Raises
        `DataError`, also where the file names no input for the measurement arm, `LimitError`,
        `InstrumentError`.
        """
        if periods < 1 or records < 1:
            raise ValueError("`periods` and `records` must be 1 or more.")
        (drive,) = check_against_bench(repeated(drive, 1), self._file)
        at, taken = self._file.digitizer, []
        self.so_far = ()
        length_s = periods / drive.rate + at.latency_s
        asked = Acquisition(at.range_inputs(), 0.0, length_s, at.sample_hz)
        with self._player.playing(drive, asked, records) as settings:
            first_s = self._player.session_s()
            for number in range(records):
                if progress is not None:
                    progress(number, records, f"{drive.rate:g} Hz")
                since_s = self._player.session_s() - first_s
                start_s = first_s + math.ceil(since_s * drive.rate) / drive.rate
                samples = self._player.fetch(drive, asked)
                settings.check()
                one = to_fringe_records(
                    samples, self._file, drive, periods=periods, start_s=start_s, number=number
                )
                taken.append(one)
                if store is not None:
                    store(one)
                    del taken[:-1]
        if progress is not None:
            progress(records, records, "")
        return taken[-1].replace(records=tuple(one.records[0] for one in taken))

    def recording(self, notes: dict[str, str] | None = None) -> Recording:
        """What was recorded so far, with every setting as the instruments report it."""
        if not self.so_far:
            raise DataError("Nothing was recorded.")
        return Recording(
            self.so_far, response_origin="run", provenance=self.provenance() | (notes or {})
        )

    def incomplete(self) -> Recording:
        """The same after a failure: the instruments are not asked any more."""
        notes = {"incomplete": "yes", "history": "; ".join(self.history)}
        return Recording(self.so_far, response_origin="run", provenance=notes)

    def provenance(self) -> dict[str, str]:
        """Identities, settings read back, and the drives of this session."""
        settings = {
            "bench": "laboratory",
            "generator": self._generator.identity,
            "digitizer": self._digitizer.identity,
            "file": self._file.model_dump_json(by_alias=True),
            "history": "; ".join(self.history),
        }
        undone = getattr(self._channel, "undone", ())
        found_on = getattr(self._channel, "found_on", "")
        if found_on:
            settings["generator_found_on"] = f"{found_on}; it was parked and switched off"
        if undone:
            settings["generator_undone"] = ", ".join(undone)
        if self._laser is not None:
            settings |= {f"laser_{key}": value for key, value in self._laser.snapshot().items()}
        return settings

    def close(self) -> None:
        """Park, switch off and disconnect; each step is tried whatever fails."""
        with contextlib.ExitStack() as stack:  # the generator first
            stack.callback(self._release)
            if self._laser is not None:
                stack.callback(self._laser.close)
            stack.callback(self._digitizer.close)
            stack.callback(self._generator.close)
