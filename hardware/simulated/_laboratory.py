"""The physics of a bench without instruments: a waveform in, raw photodiode records out."""

import dataclasses

import numpy as np

from rapi_jax import AfgWaveform
from rapi_jax.readout import Fringes

from .laser._abstract_device import AbstractDevice
from .laser._comb_jitter import CombJitter
from .laser._digitizer import Digitizer
from .laser._drift import Drift
from .laser._light_noise import Laser, PhaseNoise
from .laser._measurement_arm import MeasurementArm
from .laser._optics import Cavity, Interferometer
from .laser._scan import Scan
from .laser.motion._base import AbstractMotion

_CHUNK = 1 << 17  # samples: what stays in a processor's cache


@dataclasses.dataclass(frozen=True, eq=False)
class Laboratory:
    """Amplifier, laser and optics in front of a digitizer; no instrument and no session.

    - `device`: amplifier and laser. `latency_s`: from the generator to the laser, s.
    - `cavity`: `None` where there is none; the interferometer is always there.
    - `measurement`: the measurement arm of a ranging set-up, with its target; `None` without one.
    - `drift`: of the device over session time; constant during one record.
    - `wander`: of the optical frequency in ranging records, GHz over session time (a motion whose
      metres are GHz): what a free-running laser does between one scan and the next. `None`: none.
    """

    device: AbstractDevice
    latency_s: float = 0.0
    laser: Laser = Laser()
    interferometer: Interferometer = Interferometer.fibre()
    cavity: Cavity | None = Cavity()
    digitizer: Digitizer = Digitizer()
    drift: Drift = Drift()
    measurement: MeasurementArm | None = None
    wander: AbstractMotion | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.latency_s) and self.latency_s >= 0):
            raise ValueError(f"`latency_s` must be zero or positive, but is {self.latency_s}.")

    def arm(self) -> MeasurementArm:
        """The measurement arm. Raises `ValueError` where there is none."""
        if self.measurement is None:
            raise ValueError(
                "This laboratory has no measurement arm, so it sees no target: give it one "
                "(`measurement=MeasurementArm(Target(0.7))`)."
            )
        return self.measurement

    def provenance(self) -> dict[str, str]:
        """What it is made of, as text."""
        return {
            **self.device.provenance(),
            "latency_s": repr(self.latency_s),
            "laser": repr(self.laser),
            "interferometer": repr(self.interferometer),
            "cavity": repr(self.cavity),
            "digitizer": repr(self.digitizer),
            "drift": repr(self.drift),
        }

    def scan(self, waveform: AfgWaveform, *, periods: int = 1, start_s: float = 0.0) -> Scan:
        """The laser's frequency without noise; latency is in it.

        `start_s`: session time at which the first of the `periods` begins.
        """
        state = self.drift.at(start_s)
        return self.device.scan(waveform, periods=periods, start_s=start_s, state=state)

    def frequency(
        self, waveform: AfgWaveform, time: np.ndarray, *, periods: int = 1, start_s: float = 0.0
    ) -> np.ndarray:
        """The laser's frequency (GHz) at increasing times after the drive's start, without noise.

        The truth that a reading can be judged by.
        """
        scan = self.scan(waveform, periods=periods, start_s=start_s)
        return scan.at(time - self.latency_s)

    def record(
        self,
        waveform: AfgWaveform,
        rng: np.random.Generator,
        *,
        periods: int = 1,
        start_s: float = 0.0,
        margin_s: float = 0.0,
    ) -> Fringes:
        """Raw codes of interferometer and cavity over `periods` periods and a margin on both sides.

        The target is not seen here: `fringe_records` gives all three channels.
        """
        scan = self.scan(waveform, periods=periods, start_s=start_s)
        hz = self.digitizer.sample_hz
        before = int(np.ceil(margin_s * hz))
        count = int(np.ceil((periods / waveform.frequency_hz) * hz)) + 2 * before
        channels = np.empty((1 if self.cavity is None else 2, count), dtype=np.int16)
        phase_noise = PhaseNoise(self.laser, self.interferometer.delay_s, hz, rng)
        phase = float(rng.uniform())  # the fibre's length drifts by wavelengths between records
        centre = float(scan.nu.min() + scan.nu.max()) / 2.0
        comb = None
        if self.cavity is not None and self.cavity.jitter_ghz:
            comb = CombJitter(self.cavity.jitter_ghz, int(rng.integers(1 << 62)), scan)
        for begin in range(0, count, _CHUNK):
            part = slice(begin, min(begin + _CHUNK, count))
            size = part.stop - begin
            time = (np.arange(begin, part.stop) - before) * (1.0 / hz) - self.latency_s
            nu = scan.at(time)
            light = None if scan.light is None else scan.light.at(time).astype(np.float32)
            at_s = (begin - before) / hz - self.latency_s
            off = None if comb is None else comb.even(at_s, 1.0 / hz, size)
            walks, power = phase_noise.draw(size), self._power(nu, centre, rng)
            if light is not None:
                power = light if power is None else power * light
            self._chunk(channels[:, part], nu, walks, phase, off, power, rng)
        return Fringes(
            interferometer=channels[0],
            cavity=None if self.cavity is None else channels[1],
            sample_hz=hz,
            start_s=-before / hz,
            delay_s=self.interferometer.delay_s,
            fsr_ghz=1.5 if self.cavity is None else self.cavity.fsr_ghz,
            full_scale=self.digitizer.full_scale,
        )

    def _chunk(self, out, nu, noise, phase, comb, power, rng) -> None:
        walk, jitter = (None, None) if noise is None else noise
        lights = [(self.interferometer.light(nu, walk, phase), self.interferometer.noise_v)]
        if self.cavity is not None:
            lights.append((self.cavity.light(nu, jitter, comb), self.cavity.noise_v))
        for channel, (volts, noise_v) in zip(out, lights, strict=True):
            if power is not None:
                volts *= power
            if noise_v:
                dark = rng.standard_normal(nu.size, dtype=np.float32)
                dark *= np.float32(noise_v)
                volts += dark
            self.digitizer.codes(volts, out=channel)

    def _power(self, nu, centre, rng) -> np.ndarray | None:
        rms, slope = self.laser.rin_rms(self.digitizer.sample_hz), self.laser.power_per_ghz
        if not rms and not slope:
            return None
        power = rng.standard_normal(nu.size, dtype=np.float32)
        power *= np.float32(rms)
        power += np.float32(1.0)
        if slope:
            power += ((nu - centre) * slope).astype(np.float32)
        return power
