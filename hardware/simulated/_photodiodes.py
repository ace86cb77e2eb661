"""Three photodiodes behind one laser, digitized over a measurement, chunk by chunk."""

import dataclasses

import numpy as np

from ._laboratory import Laboratory
from .laser._comb_jitter import CombJitter
from .laser._normal import TableNormal
from .laser._scan import Scan
from .laser._shared_phase_noise import SharedPhaseNoise
from .laser.motion._target import Target

_CHUNK = 1 << 15  # samples: what a chunk needs stays in a processor's second cache


@dataclasses.dataclass(frozen=True, eq=False)
class Photodiodes:
    """Measurement arm, auxiliary interferometer and cavity of a laboratory in one measurement.

    - `rng`: of all noise. `phase`: of the auxiliary interferometer, cycles; its fibre drifts by
      wavelengths between measurements. `comb_key`: of the cavity's jitter.
    """

    laboratory: Laboratory
    rng: np.random.Generator
    phase: float
    comb_key: int

    @classmethod
    def of(cls, laboratory: Laboratory, rng: np.random.Generator) -> "Photodiodes":
        """Those of one measurement, with a phase and a jitter of its own."""
        return cls(laboratory, rng, float(rng.uniform()), int(rng.integers(1 << 62)))

    def codes(self, scan: Scan, first: int, count: int, *, start_s: float) -> np.ndarray:
        """Codes (int16, channels x `count`) from sample `first` after the drive's start on.

        Channels: measurement, interferometer, and the cavity where there is one. `start_s`: session
        time of the drive's start, s.
        """
        lab = self.laboratory
        arm, hz = lab.arm(), lab.digitizer.sample_hz
        normal = TableNormal(self.rng)
        middle_s = start_s + (first + count / 2) / hz
        delays = (lab.interferometer.delay_s, arm.delay_s(middle_s))
        noise = SharedPhaseNoise(lab.laser, delays, hz, normal)
        comb = None
        if lab.cavity is not None and lab.cavity.jitter_ghz:
            comb = CombJitter(lab.cavity.jitter_ghz, self.comb_key, scan)
        wander = None if lab.wander is None else Target(0.0, (lab.wander,))
        centre = float(scan.nu.min() + scan.nu.max()) / 2.0
        out = np.empty((2 if lab.cavity is None else 3, count), dtype=np.int16)
        for begin in range(0, count, _CHUNK):
            size = min(_CHUNK, count - begin)
            at_s = (first + begin) / hz
            nu = scan.even(at_s - lab.latency_s, 1.0 / hz, size)
            if wander is not None:
                off_ghz = wander.displacement(start_s + at_s, hz, size)
                nu = nu if off_ghz is None else nu + off_ghz
            walks, jitter = noise.draw(size) or ((None, None), None)
            moved = arm.target.displacement(start_s + at_s, hz, size)
            lights = [
                (arm.light(nu, moved, walks[1]), arm.noise_v),
                (lab.interferometer.light(nu, walks[0], self.phase), lab.interferometer.noise_v),
            ]
            if lab.cavity is not None:
                off = None if comb is None else comb.even(at_s - lab.latency_s, 1.0 / hz, size)
                lights.append((lab.cavity.light(nu, jitter, off), lab.cavity.noise_v))
            power = self._power(nu, centre, normal)
            if scan.light is not None:
                light = scan.light.even(at_s - lab.latency_s, 1.0 / hz, size).astype(np.float32)
                power = light if power is None else power * light
            for codes, (volts, noise_v) in zip(out, lights, strict=True):
                if power is not None:
                    volts *= power
                if noise_v:
                    volts += normal.draw(size, noise_v)
                lab.digitizer.codes(volts, out=codes[begin : begin + size])
        return out

    def _power(self, nu: np.ndarray, centre: float, normal: TableNormal) -> np.ndarray | None:
        laser = self.laboratory.laser
        rms, slope = laser.rin_rms(self.laboratory.digitizer.sample_hz), laser.power_per_ghz
        if not rms and not slope:
            return None
        power = normal.draw(nu.size, rms)
        power += np.float32(1.0)
        if slope:
            power += ((nu - centre) * slope).astype(np.float32)
        return power
