"""The simulated laboratory: the physics of an ECDL and its optics behind a bench."""

from hardware.servers._instrument import AbstractInstrument as AbstractInstrument
from hardware.servers._instrument import Answer as Answer
from hardware.servers._tcp import TcpServer as TcpServer

from ._bench import SimulatedBench as SimulatedBench
from ._bench_toml import bench_toml as bench_toml
from ._laboratory import Laboratory as Laboratory
from ._wired import WiredLaboratory as WiredLaboratory
from .instruments._afg31000 import SimulatedAFG31052 as SimulatedAFG31052
from .instruments._faults import Closing as Closing
from .instruments._faults import Cut as Cut
from .instruments._faults import Endless as Endless
from .instruments._faults import Faulty as Faulty
from .instruments._faults import Instead as Instead
from .instruments._faults import Silent as Silent
from .instruments._faults import Slow as Slow
from .instruments._faults import Unplugged as Unplugged
from .instruments._infiniivision import SimulatedInfiniiVision as SimulatedInfiniiVision
from .instruments._link import Clock as Clock
from .instruments._link import SimulatedLink as SimulatedLink
from .instruments._tlb6700 import SimulatedTLB6700 as SimulatedTLB6700
from .laser._device import Device as Device
from .laser._device import Scan as Scan
from .laser._digitizer import Digitizer as Digitizer
from .laser._drift import Drift as Drift
from .laser._dynamics import AbstractPhysics as AbstractPhysics
from .laser._dynamics import Amplifier as Amplifier
from .laser._dynamics import MirrorResonance as MirrorResonance
from .laser._dynamics import ParasiticEtalon as ParasiticEtalon
from .laser._light_noise import Laser as Laser
from .laser._optics import Cavity as Cavity
from .laser._optics import Interferometer as Interferometer
