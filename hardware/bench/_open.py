"""Instruments from a bench file, connected and identified; or simulated ones in their place."""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass

from hardware.digitizer._base import AbstractDigitizer
from hardware.digitizer._infiniivision import InfiniiVision
from hardware.digitizer._niscope import NiScope
from hardware.digitizer._replay import ReplayDigitizer
from hardware.generator._afg31000 import AFG31000
from hardware.laser._link import AbstractLaserLink, VisaLaserLink
from hardware.laser._tlb6700 import TLB6700
from hardware.laser._vendor_dll import VendorDllLink
from hardware.links._scpi import Scpi
from hardware.links._visa import VisaLink
from hardware.servers._instrument import AbstractInstrument
from hardware.simulated import Clock, Device, Laboratory, SimulatedLink, WiredLaboratory
from rapi_jax.examples import paper_device
from rapi_jax.io._safe import StrPath

from ._file import BenchFile, read_bench
from ._held import held
from ._lab import LabBench
from ._tables import NiScopeTable, ReplayTable

_DIGITIZER_S = 10.0  # an oscilloscope answers slowly while it works on a long record


def open_bench(bench: StrPath | BenchFile) -> LabBench:
    """The bench that `bench.toml` describes: identities matched, outputs off, nothing played.

    `bench`: the file, or what `read_bench` made of it.

    Raises `DataError` for the file, `LimitError` where a limit is missing or cannot be kept,
    `InstrumentError` for an instrument that does not answer, or is another one.
    """
    file = bench if isinstance(bench, BenchFile) else read_bench(bench)
    with contextlib.ExitStack() as stack:
        hold = stack.enter_context(contextlib.ExitStack())
        hold.enter_context(held(_addresses(file)))
        at = file.generator
        generator = stack.enter_context(AFG31000(_scpi(at.resource, at.backend)))
        digitizer = stack.enter_context(_digitizer(file))
        laser = None
        if file.laser is not None:
            limits = file.laser.limits.of()
            laser = stack.enter_context(TLB6700(_laser_link(file), limits=limits))
        opened = LabBench(file, generator, digitizer, laser, release=hold.close)
        stack.pop_all()
    return opened


@dataclass(frozen=True)
class DryRun:
    """A bench on simulated instruments in the same process, and every byte that it sent them."""

    bench: LabBench
    laboratory: WiredLaboratory
    links: Mapping[str, SimulatedLink]

    def sent(self) -> dict[str, bytes]:
        """What each instrument was sent, in order."""
        return {name: bytes(link.sent) for name, link in self.links.items()}


def dry_run(file: BenchFile, *, seed: int = 0) -> DryRun:
    """The same bench with nothing connected: no time passes, and nothing is switched.

    An oscilloscope stands in for any digitizer but a replay.
    """
    clock = Clock()
    lab = WiredLaboratory(Laboratory(Device(paper_device())), seed=seed, clock=clock)

    def link(instrument: AbstractInstrument, resource: str) -> SimulatedLink:
        return SimulatedLink(instrument, resource=resource, clock=clock, keep=True)

    links = {"generator": link(lab.generator, file.generator.resource)}
    if isinstance(file.digitizer, ReplayTable):
        digitizer = ReplayDigitizer(file.digitizer.folder)
    else:
        links["digitizer"] = link(lab.oscilloscope, file.digitizer.resource)
        digitizer = InfiniiVision(Scpi(links["digitizer"]))
    laser = None
    if file.laser is not None:
        links["laser"] = link(lab.laser, file.laser.resource or "")
        laser = TLB6700(VisaLaserLink(links["laser"]), limits=file.laser.limits.of())
    bench = LabBench(
        file,
        AFG31000(Scpi(links["generator"])),
        digitizer,
        laser,
        now=clock,
        sleep=links["generator"].sleep,
    )
    return DryRun(bench, lab, links)


def _addresses(file: BenchFile) -> list[str]:
    """Of all instruments, to be held against other programs."""
    found = [file.generator.resource]
    if not isinstance(file.digitizer, ReplayTable):
        found.append(file.digitizer.resource)
    if file.laser is not None:
        found.append(file.laser.resource or file.laser.serial or "")
    return found


def _digitizer(file: BenchFile) -> AbstractDigitizer:
    at = file.digitizer
    if isinstance(at, ReplayTable):
        return ReplayDigitizer(at.folder)
    if isinstance(at, NiScopeTable):
        return NiScope(at.resource, trigger=at.trigger, level_v=at.level_v)
    return InfiniiVision(_scpi(at.resource, at.backend, timeout_s=_DIGITIZER_S))


def _scpi(resource: str, backend: str, *, timeout_s: float = 2.0) -> Scpi:
    return Scpi(VisaLink(resource, backend=backend), timeout_s=timeout_s)


def _laser_link(file: BenchFile) -> AbstractLaserLink:
    laser = file.laser
    if laser is None or laser.resource is None:
        return VendorDllLink(laser.serial if laser and laser.serial else "")
    return VisaLaserLink(VisaLink(laser.resource, backend=laser.backend))
