"""Bench files for the simulated laboratory, and the laboratory behind real wires."""

import threading

from hardware.servers._instrument import AbstractInstrument
from hardware.simulated import Faulty, SimulatedBench, WiredLaboratory, bench_toml


def bench_file(
    folder, *, generator="GEN", laser="LAS", digitizer="DIG", change=None, measurement=False
):
    """Write one; `change`: what to replace by what; `measurement`: with a measurement arm."""
    at = {"generator": generator, "laser": laser, "digitizer": digitizer}
    text = bench_toml(at, delay_s=24.483e-9, measurement=measurement)
    for old, new in (change or {}).items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "bench.toml"
    path.write_text(text)
    return path


class Watched(AbstractInstrument):
    """An instrument; `event` is set when it is sent `when` for the `nth` time."""

    def __init__(self, instrument, when, nth):
        self.instrument, self.event = instrument, threading.Event()
        self._when, self._left = when, nth

    def connected(self):
        self.instrument.connected()

    def feed(self, data):
        self._left -= self._when in data
        if self._left <= 0:
            self.event.set()
        return self.instrument.feed(data)


class Served:
    """A laboratory behind wires, and the bench file that reaches it.

    `wraps`: by instrument, what is served in its place; `change`: as in `bench_file`; `arm`: a
    measurement arm.
    """

    def __init__(self, stack, folder, server, *, wraps=None, change=None, arm=None, **spoilt):
        self.lab = WiredLaboratory(SimulatedBench.like_paper(measurement=arm).laboratory)
        at = {}
        for name, instrument in (
            ("generator", self.lab.generator),
            ("laser", self.lab.laser),
            ("digitizer", self.lab.oscilloscope),
        ):
            served = Faulty(instrument, **spoilt[name]) if name in spoilt else instrument
            served = (wraps or {}).get(name, lambda one: one)(served)
            at[name] = stack.enter_context(server(served)).resource
        self.at = at
        self.bench = bench_file(folder, change=change, measurement=arm is not None, **at)

    def parked(self):
        seen = self.lab.generator.seen[1]
        return self.lab.generator.output(1) is None and seen.relay_v <= 0.0041
