"""The simulated laboratory as instruments on a network: generator, laser, oscilloscope."""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator

import numpy as np

from hardware.servers._hislip import HislipServer
from hardware.servers._instrument import AbstractInstrument
from hardware.servers._listener import AbstractListener
from rapi_jax import AfgWaveform

from ._laboratory import Laboratory
from ._photodiodes import Photodiodes
from .instruments._infiniivision import SimulatedInfiniiVision
from .instruments._tlb6700 import SimulatedTLB6700
from .instruments.afg31000._instrument import SimulatedAFG31052
from .laser._digitizer import Digitizer

INTERFEROMETER, CAVITY, MEASUREMENT = 1, 2, 3  # connectors of the oscilloscope
# Samples from a drive's start to a record's end, and codes of all its periods: more is refused.
_MOST = 1 << 24
_FINE = (16, -10.0, 10.0)  # before the oscilloscope's own converter


class WiredLaboratory:
    """Three instruments that share one `laboratory`'s physics.

    The generator's channel 1 drives it; its trigger output is at the oscilloscope's external
    trigger; the interferometer is at the oscilloscope's input 1, the cavity at 2, the measurement
    arm, where the laboratory has one, at 3.

    - `clock`: the time, s, for all of them. `seed`: of all noise.
    - `controller`: whether the laser is a TLB-6700's, so that this is served, too.
    - `trigger_connected`: whether the generator's trigger output is at the oscilloscope.
    """

    def __init__(
        self,
        laboratory: Laboratory,
        *,
        seed: int = 0,
        clock: Callable[[], float] = time.monotonic,
        controller: bool = True,
    ) -> None:
        self.laboratory = laboratory
        self._controller = controller
        self.generator = SimulatedAFG31052(clock=clock)
        self.laser = SimulatedTLB6700(clock=clock, emits=True)
        self.oscilloscope = SimulatedInfiniiVision(self._light, clock=clock)
        self.trigger_connected = True
        self._seed = seed
        self._records = 0
        self._began = clock()

    @contextlib.contextmanager
    def served(
        self, server: Callable[[AbstractInstrument], AbstractListener] = HislipServer
    ) -> Iterator[dict[str, str]]:
        """Put them on 127.0.0.1; VISA addresses of "generator", "digitizer", and "laser" where
        there is a controller.
        """
        instruments: dict[str, AbstractInstrument] = {"generator": self.generator}
        if self._controller:
            instruments["laser"] = self.laser
        instruments["digitizer"] = self.oscilloscope
        with contextlib.ExitStack() as stack:
            yield {
                name: stack.enter_context(server(one)).resource for name, one in instruments.items()
            }

    def _light(
        self, now_s: float, first_s: float, count: int, sample_hz: float
    ) -> dict[int, np.ndarray] | None:
        """What the photodiodes give about the next trigger; nothing while none comes.

        Nothing, too, where the record lies so far from the trigger that it would not fit in memory.
        """
        pulse = self.generator.pulse_s(1, now_s)
        if pulse is None or not self.trigger_connected:
            return None
        now_s, end_s = pulse
        waveform = self.generator.output(1, now_s)
        if waveform is None:
            return None
        if self._controller and not self.laser.emits:
            return {n: np.zeros(count) for n in (INTERFEROMETER, CAVITY, MEASUREMENT)}
        last_s = first_s + (count - 1) / sample_hz
        rate = waveform.frequency_hz
        periods = max(int(np.ceil(last_s * rate)), 1)
        margin_s = max(-first_s, last_s - periods / rate, 0.0) + 2 / sample_hz
        samples = (periods / rate + 2 * margin_s) * sample_hz
        steps = 0 if self.laboratory.device.repeats else periods * waveform.codes.size
        if max(samples, steps, count) > _MOST:
            return None
        bits, low, high = _FINE
        fine = Digitizer(sample_hz, bits, low, high)
        lab = dataclasses.replace(self.laboratory, digitizer=fine)
        rng = np.random.default_rng([self._seed, self._records])
        self._records += 1
        if lab.measurement is not None:
            light = _three(lab, waveform, rng, periods, now_s - self._began, first_s, count)
            return _at_rest(light, (end_s - now_s - first_s) * sample_hz)
        fringes = lab.record(
            waveform,
            rng,
            periods=periods,
            start_s=now_s - self._began,
            margin_s=margin_s,
        )
        begin = round((first_s - fringes.start_s) * sample_hz)
        part = slice(begin, begin + count)
        light = {INTERFEROMETER: fine.volts(fringes.interferometer[part].astype(float))}
        if fringes.cavity is not None:
            light[CAVITY] = fine.volts(fringes.cavity[part].astype(float))
        return _at_rest(light, (end_s - now_s - first_s) * sample_hz)


def _at_rest(light: dict[int, np.ndarray], end: float) -> dict[int, np.ndarray]:
    """The light that does not change any more after sample `end`, where the drive stops."""
    for volts in light.values():
        if end < volts.size:
            last = max(int(end), 0)
            volts[last:] = volts[last]
    return light


def _three(
    lab: Laboratory,
    waveform: AfgWaveform,
    rng: np.random.Generator,
    periods: int,
    start_s: float,
    first_s: float,
    count: int,
) -> dict[int, np.ndarray]:
    """Volts at the three inputs from `first_s` about a drive's start at session time `start_s`."""
    scan = lab.scan(waveform, periods=periods, start_s=start_s)
    first = round(first_s * lab.digitizer.sample_hz)
    codes = Photodiodes.of(lab, rng).codes(scan, first, count, start_s=start_s)
    connectors = (MEASUREMENT, INTERFEROMETER, CAVITY)[: len(codes)]
    return {
        connector: lab.digitizer.volts(one.astype(float))
        for connector, one in zip(connectors, codes, strict=True)
    }
