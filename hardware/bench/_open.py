"""Instruments of a bench file: connected and identified, or simulated for a dry run."""

import contextlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from hardware._driver import AbstractConnector, AbstractDriver, AbstractDriverTable
from hardware.links._link import AbstractLink
from hardware.links._visa import VisaLink
from hardware.servers._instrument import AbstractInstrument
from hardware.simulated import (
    Clock,
    Device,
    Laboratory,
    MeasurementArm,
    SimulatedLink,
    Target,
    WiredLaboratory,
)
from rapi_jax import DataError
from rapi_jax.examples import paper_device
from rapi_jax.internal import StrPath

from ._drivers import Driver, Drivers, collect_drivers, find_driver
from ._file import BenchFile, read_bench
from ._lab import LabBench
from ._lock import lock_instruments


class VisaConnector(AbstractConnector):
    """Connections over VISA."""

    dry_run = False

    def connect(self, resource: str, *, backend: str = "") -> AbstractLink:
        """To the instrument itself."""
        return VisaLink(resource, backend=backend)


class SimulatedConnector(AbstractConnector):
    """Connections to one simulated instrument, whatever the address; `links`: all of them."""

    dry_run = True

    def __init__(self, instrument: AbstractInstrument, clock: Clock) -> None:
        self._instrument, self._clock = instrument, clock
        self.links: list[SimulatedLink] = []

    def connect(self, resource: str, *, backend: str = "") -> AbstractLink:
        """To the simulated instrument; every byte sent is kept."""
        del backend
        link = SimulatedLink(self._instrument, resource=resource, clock=self._clock, keep=True)
        self.links.append(link)
        return link


def open_bench(bench: StrPath | BenchFile, *, drivers: Iterable[Driver] = ()) -> LabBench:
    """The bench that `bench.toml` describes: identities matched, outputs off, nothing played.

    `bench`: the file, or what `read_bench` made of it. `drivers`: classes beside those of this
    package that the file names by their `kind`.

    Raises `DataError` for the file, also where it lacks a limit, `LimitError` where the instruments
    cannot keep one,
    `InstrumentError` for an instrument that does not answer, or is another one.

    >>> from pathlib import Path
    >>> from hardware import open_bench
    >>> from hardware.simulated import Device, Laboratory, WiredLaboratory, bench_toml
    >>> from rapi_jax.examples import paper_device
    >>> laboratory = WiredLaboratory(Laboratory(Device(paper_device())))
    >>> with laboratory.served() as at:  # needs the extra `lab`
    ...     _ = Path("bench.toml").write_text(bench_toml(at, delay_s=24.5e-9))
    ...     with open_bench("bench.toml") as bench:
    ...         bench.limits.high_v  # V
    7.5
    """
    own = tuple(drivers)
    file = bench if isinstance(bench, BenchFile) else read_bench(bench, drivers=own)
    known, tables = collect_drivers(own), _tables(file)
    with contextlib.ExitStack() as stack:
        hold = stack.enter_context(contextlib.ExitStack())
        hold.enter_context(
            lock_instruments(one for table in tables.values() for one in table.resources)
        )
        opened = {
            family: stack.enter_context(_driver(known, family, table).open(table, VisaConnector()))
            for family, table in tables.items()
        }
        assembled = _assemble(file, opened, release=hold.close)
        stack.pop_all()
    return assembled


@dataclass(frozen=True)
class DryRun:
    """A bench on simulated instruments in the same process, and every byte that it sent them."""

    bench: LabBench
    laboratory: WiredLaboratory
    links: Mapping[str, SimulatedLink]

    def sent(self) -> dict[str, bytes]:
        """What each instrument was sent, in order."""
        return {name: bytes(link.sent) for name, link in self.links.items()}


def dry_run(file: BenchFile, *, seed: int = 0, drivers: Iterable[Driver] = ()) -> DryRun:
    """The bench of `file` with nothing connected: no time passes, and nothing is switched.

    A driver connects to the simulated instrument of its family. Raises `DataError` for a driver
    that does not support this, `InstrumentError` for one that takes it for another instrument.

    >>> from pathlib import Path
    >>> from hardware import dry_run, read_bench
    >>> from hardware.simulated import bench_toml
    >>> at = {"generator": "GEN", "laser": "LAS", "digitizer": "DIG"}  # VISA addresses
    >>> _ = Path("bench.toml").write_text(bench_toml(at, delay_s=24.5e-9))
    >>> dry = dry_run(read_bench("bench.toml"))
    >>> with dry.bench:
    ...     "*IDN?" in dry.sent()["generator"].decode()
    True
    """
    known, clock = collect_drivers(drivers), Clock()
    arm = None if file.digitizer.measurement is None else MeasurementArm(Target(0.7))
    laboratory = Laboratory(Device(paper_device()), measurement=arm)
    lab = WiredLaboratory(laboratory, seed=seed, clock=clock)
    instruments = {"generator": lab.generator, "laser": lab.laser, "digitizer": lab.oscilloscope}
    opened: dict[str, AbstractDriver] = {}
    links: dict[str, SimulatedLink] = {}
    for family, table in _tables(file).items():
        driver = _driver(known, family, table)
        if not driver.supports_dry_run:
            raise DataError(f"A {family} of kind '{driver.kind}' does not support a dry run.")
        connector = SimulatedConnector(instruments[family], clock)
        opened[family] = driver.open(table, connector)
        for number, link in enumerate(connector.links):
            links[f"{family}_{number + 1}" if number else family] = link
    return DryRun(_assemble(file, opened, now=clock, sleep=clock.sleep), lab, links)


def _tables(file: BenchFile) -> dict[str, AbstractDriverTable]:
    """The instruments' tables by family, in the order in which they are opened."""
    tables = {"generator": file.generator, "digitizer": file.digitizer, "laser": file.laser}
    return {family: table for family, table in tables.items() if table is not None}


def _driver(known: Drivers, family: str, table: AbstractDriverTable) -> Driver:
    driver = find_driver(known, family, table.kind)
    if not isinstance(table, driver.Table):
        raise DataError(f"The {family}'s table was read for another driver of kind {table.kind!r}.")
    return driver


def _assemble(file: BenchFile, opened: Mapping[str, Any], **options: Any) -> LabBench:
    for family, driver in opened.items():
        if not driver.identity:
            raise DataError(f"The driver of the {family} does not say what the instrument is.")
    return LabBench(file, opened["generator"], opened["digitizer"], opened.get("laser"), **options)
