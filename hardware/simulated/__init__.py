"""The simulated laboratory: the physics of an ECDL and its optics behind a bench."""

from ._afg31000 import SimulatedAFG31052 as SimulatedAFG31052
from ._bench import SimulatedBench as SimulatedBench
from ._device import Device as Device
from ._device import Scan as Scan
from ._digitizer import Digitizer as Digitizer
from ._drift import Drift as Drift
from ._dynamics import AbstractPhysics as AbstractPhysics
from ._dynamics import Amplifier as Amplifier
from ._dynamics import MirrorResonance as MirrorResonance
from ._dynamics import ParasiticEtalon as ParasiticEtalon
from ._faults import Closing as Closing
from ._faults import Cut as Cut
from ._faults import Endless as Endless
from ._faults import Faulty as Faulty
from ._faults import Instead as Instead
from ._faults import Silent as Silent
from ._faults import Slow as Slow
from ._faults import Unplugged as Unplugged
from ._instrument import AbstractInstrument as AbstractInstrument
from ._instrument import Answer as Answer
from ._laboratory import Laboratory as Laboratory
from ._laser import Laser as Laser
from ._link import SimulatedLink as SimulatedLink
from ._optics import Cavity as Cavity
from ._optics import Interferometer as Interferometer
from ._tcp import TcpServer as TcpServer
