"""The simulated laboratory: the physics of an ECDL and its optics behind a bench."""

from ._bench import SimulatedBench as SimulatedBench
from ._device import Device as Device
from ._device import Scan as Scan
from ._digitizer import Digitizer as Digitizer
from ._drift import Drift as Drift
from ._dynamics import AbstractPhysics as AbstractPhysics
from ._dynamics import Amplifier as Amplifier
from ._dynamics import MirrorResonance as MirrorResonance
from ._dynamics import ParasiticEtalon as ParasiticEtalon
from ._laboratory import Laboratory as Laboratory
from ._laser import Laser as Laser
from ._optics import Cavity as Cavity
from ._optics import Interferometer as Interferometer
