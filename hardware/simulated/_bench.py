"""A simulated ECDL on its bench: generator, amplifier, laser, optics, digitizer, readout."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from hardware.bench._base import AbstractBench, amplify, check_drives
from hardware.bench._thresholds import THRESHOLDS
from rapi_jax import AfgWaveform, Drive, DriveLimits, Recording
from rapi_jax.internal import POINTS
from rapi_jax.ranging import FringeRecords
from rapi_jax.readout import Fringes, Readout, read_fringes

from ._laboratory import Laboratory
from ._ranging import fringe_records
from .laboratories._current_tuned import current_tuned
from .laboratories._paper import PAPER_LIMITS, paper_laboratory
from .laboratories._paper_ranging import paper_ranging
from .laser._digitizer import Digitizer
from .laser._drift import Drift
from .laser._light_noise import Laser
from .laser._measurement_arm import MeasurementArm
from .laser._optics import Cavity
from .laser.motion._target import Target


class SimulatedBench(AbstractBench):
    """A bench whose physics is a `Laboratory`.

    A drive is what the generator puts out, in V; `limits` hold for the piezo's input behind the
    amplifier. Each measurement plays the drive until it has settled and then records the drive's
    own number of periods, with a margin on either side. Noise is drawn from `seed` and the number
    of the measurement: the same sequence of measurements gives the same numbers, and no two have
    the same noise. `session_s` is the session's time, which measurements and `wait` advance.

    >>> from hardware import SimulatedBench
    >>> from rapi_jax import triangle
    >>> bench = SimulatedBench.like_paper(seed=0)
    >>> (drive,) = triangle(40.0, amplitude=4.5, bias=3.0, samples=1000)
    >>> bench.limits.check(drive)
    >>> bench.limits.high_v  # V
    7.5
    """

    def __init__(
        self,
        laboratory: Laboratory,
        limits: DriveLimits,
        *,
        seed: int = 0,
        points: int = POINTS,
        settling: int = 2,
        margin_s: float = 9e-3,
    ) -> None:
        """`points`: codes a period in the generator; `settling`: periods before a record;
        `margin_s`: recorded before and after it, so that turns at its ends are seen (at most 18 %
        of a period).
        """
        if settling < 1 or not margin_s >= 0:
            raise ValueError("`settling` must be 1 or more, and `margin_s` not negative.")
        self.laboratory = laboratory
        self.limits = limits
        self.seed = seed
        self.points = points
        self.settling = settling
        self.margin_s = margin_s
        self.session_s = 0.0
        self.measured = 0  # number of records so far

    @classmethod
    def like_paper(
        cls,
        seed: int = 0,
        *,
        latency_s: float = 0.0,
        unmodelled: bool = False,
        drift: Drift = Drift(),  # noqa: B008 (frozen)
        laser: Laser = Laser(),  # noqa: B008
        limits: DriveLimits = PAPER_LIMITS,
        cavity: Cavity | None = Cavity(),  # noqa: B008
        digitizer: Digitizer = Digitizer(),  # noqa: B008
        measurement: MeasurementArm | None = None,
    ) -> "SimulatedBench":
        """The paper's bench, with the device that gives Table 1's uncompensated half.

        `unmodelled` adds what RA-PI has no term for: an amplifier of 1.5 kHz, a mirror resonance at
        1.2 kHz with 12 % of critical damping, and an etalon of 20 MHz every 7 GHz. With less than
        9 % a sharp corner would make the laser turn more often than its drive.
        """
        laboratory = paper_laboratory(
            latency_s=latency_s,
            unmodelled=unmodelled,
            drift=drift,
            laser=laser,
            cavity=cavity,
            digitizer=digitizer,
            measurement=measurement,
        )
        return cls(laboratory, limits, seed=seed)

    @classmethod
    def like_paper_range(
        cls,
        target: Target,
        seed: int = 0,
        *,
        sample_hz: float = 30e6,
        laser: Laser = Laser(),  # noqa: B008 (frozen)
        vibration: bool = True,
        wander: bool = True,
        cavity_noise: bool = True,
    ) -> "SimulatedBench":
        """The paper's ranging set-up (Section 4.2) before `target`.

        Vibration, wander and drift were chosen from the paper's uncompensated distances alone
        (`hardware/simulated/laboratories/_paper_ranging.py`); each can be switched off.
        """
        laboratory = paper_ranging(
            target,
            seed=seed,
            digitizer=Digitizer(sample_hz=sample_hz),
            laser=laser,
            vibration=vibration,
            wander=wander,
            cavity_noise=cavity_noise,
        )
        return cls(laboratory, PAPER_LIMITS, seed=seed)

    @classmethod
    def dfb(cls, seed: int = 0, *, measurement: MeasurementArm | None = None) -> "SimulatedBench":
        """A DFB laser at 1550 nm, tuned by its current: 0 to 5 V at its driver, up to 1 kHz.

        Triangles of 4 V peak to peak, centred on 2.5 V (60 to 140 mA), scan some 60 GHz at 100 Hz
        and 50 at 1 kHz. The optical frequency falls as the voltage rises; a reading rises with the
        drive, since fringes do not tell the sign.
        """
        laboratory, limits = current_tuned("dfb", measurement)
        return cls(laboratory, limits, seed=seed)

    @classmethod
    def vcsel(cls, seed: int = 0, *, measurement: MeasurementArm | None = None) -> "SimulatedBench":
        """A VCSEL at 850 nm, tuned by its current: 0 to 5 V at its driver, up to 1 kHz.

        Triangles of 4 V peak to peak, centred on 2.5 V (1.8 to 4.2 mA), scan some 530 GHz. Signs as
        for `dfb`.
        """
        laboratory, limits = current_tuned("vcsel", measurement)
        return cls(laboratory, limits, seed=seed)

    def wait(self, seconds: float) -> None:
        """Let session time pass."""
        if not seconds >= 0:
            raise ValueError(f"Argument `seconds` must not be negative, but is {seconds}.")
        self.session_s += seconds

    def waveform(self, drive: Drive) -> AfgWaveform:
        """What is loaded into the generator for `drive`."""
        return AfgWaveform.of(drive, self.points)

    def fringes(self, drive: Drive) -> Fringes:
        """Play `drive` and give the raw records, times counted from its start."""
        return self._play(self._allowed(drive)[0])[0]

    def read(self, drive: Drive) -> Readout:
        """Play `drive` and give the whole reading: dense frequency, errors, turns, faults."""
        return read_fringes(self.fringes(drive), drive)

    def measure(self, drives: Drive | Sequence[Drive]) -> Recording:
        """Play each drive and read the optical frequency, GHz, on the drive's own samples.

        All drives are checked first: where one is refused, none is played. Each run has an origin
        of its own, as fringes give relative frequency only. Raises `LimitError` for a drive beyond
        `limits`, `DataError` for one that does not repeat.
        """
        runs, notes = [], self._provenance()
        for number, drive in enumerate(self._allowed(drives)):
            fringes, played = self._play(drive)
            readout = read_fringes(fringes, played)
            name = f"run{number:02d}"
            runs.append(readout.run(played, name=name))
            if readout.faults:
                notes[f"{name}_faults"] = "; ".join(readout.faults)
        return Recording(tuple(runs), response_origin="run", provenance=notes)

    def range_records(
        self, drive: Drive, *, periods: int = 1, records: int = 1, target: Target | None = None
    ) -> FringeRecords:
        """Play `drive` with a target in the measurement arm, and give `records` records.

        Each holds `periods` periods. The generator repeats the drive's first period without a gap;
        the first record begins with it, once the drive has settled. `target`: in place of the one
        that the laboratory's measurement arm looks at. All records are held: `stream_range_records`
        holds one. Raises as `measure` does, and `ValueError` where there is neither a measurement
        arm nor a target.
        """
        several = list(
            self.stream_range_records(drive, periods=periods, records=records, target=target)
        )
        return several[0].replace(records=tuple(one.records[0] for one in several))

    def stream_range_records(
        self, drive: Drive, *, periods: int = 1, records: int = 1, target: Target | None = None
    ) -> Iterator[FringeRecords]:
        """The same, one record at a time, each made when it is asked for."""
        if periods < 1 or records < 1:
            raise ValueError("`periods` and `records` must be 1 or more.")
        (drive,) = self._allowed(drive)
        lab = self.laboratory
        if target is not None:
            arm = lab.measurement or MeasurementArm(target)
            lab = dataclasses.replace(lab, measurement=dataclasses.replace(arm, target=target))
        start = self.session_s + self.settling / drive.rate
        lab.arm()  # now, not when the first record is asked for
        stream = fringe_records(
            lab,
            self.waveform(drive),
            np.random.default_rng([self.seed, self.measured]),
            periods=periods,
            records=records,
            start_s=start,
            shape=drive.waveform,
        )
        self.measured += 1
        return self._advance(stream, start, periods / drive.rate)

    def _advance(
        self, stream: Iterator[FringeRecords], start_s: float, record_s: float
    ) -> Iterator[FringeRecords]:
        for number, one in enumerate(stream, 1):
            self.session_s = start_s + number * record_s
            yield one

    def truth(self, drive: Drive) -> np.ndarray:
        """The laser's frequency on the drive's samples, without noise or reading; plays nothing."""
        return self.laboratory.frequency(
            self.waveform(drive), drive.time, periods=drive.periods, start_s=self.session_s
        )

    def _allowed(self, drives: Drive | Sequence[Drive]) -> tuple[Drive, ...]:
        several = (drives,) if isinstance(drives, Drive) else tuple(drives)
        amplifier = self.laboratory.device.amplifier
        behind = [amplify(d, gain=amplifier.gain, offset_v=amplifier.offset_v) for d in several]
        check_drives(behind, self.limits)
        return several

    def _play(self, drive: Drive) -> tuple[Fringes, Drive]:
        rng = np.random.default_rng([self.seed, self.measured])
        start = self.session_s + self.settling / drive.rate
        margin_s = min(self.margin_s, THRESHOLDS.margin_fraction / drive.rate)
        fringes = self.laboratory.record(
            self.waveform(drive),
            rng,
            periods=drive.periods,
            start_s=start,
            margin_s=margin_s,
        )
        self.measured += 1
        self.session_s = start + drive.periods / drive.rate + margin_s
        return fringes, dataclasses.replace(drive, start_s=start)

    def _provenance(self) -> dict[str, str]:
        return {
            "bench": "simulated",
            "seed": str(self.seed),
            "measurements_before": str(self.measured),
            **self.laboratory.provenance(),
            "generator_points": str(self.points),
        }
