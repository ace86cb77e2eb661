"""Instruments, and what stands in for them: the only package that talks to a laboratory."""

from rapi_jax._limits import DriveLimits as DriveLimits

from ._errors import InstrumentError as InstrumentError
from ._errors import LinkError as LinkError
from .bench._base import AbstractBench as AbstractBench
from .bench._file import BenchFile as BenchFile
from .bench._file import read_bench as read_bench
from .bench._lab import LabBench as LabBench
from .bench._lab import allowed as allowed
from .bench._open import dry_run as dry_run
from .bench._open import open_bench as open_bench
from .digitizer._base import AbstractDigitizer as AbstractDigitizer
from .digitizer._base import Acquisition as Acquisition
from .digitizer._base import Input as Input
from .digitizer._base import Samples as Samples
from .digitizer._infiniivision import InfiniiVision as InfiniiVision
from .digitizer._niscope import NiScope as NiScope
from .digitizer._raw import read_samples as read_samples
from .digitizer._raw import write_samples as write_samples
from .digitizer._replay import ReplayDigitizer as ReplayDigitizer
from .generator._afg31000 import AFG31000 as AFG31000
from .generator._channel import AfgChannel as AfgChannel
from .laser._bridge import Bridge as Bridge
from .laser._limits import LaserLimits as LaserLimits
from .laser._link import AbstractLaserLink as AbstractLaserLink
from .laser._link import VisaLaserLink as VisaLaserLink
from .laser._tlb6700 import TLB6700 as TLB6700
from .laser._vendor_dll import VendorDllLink as VendorDllLink
from .links._link import AbstractLink as AbstractLink
from .links._scpi import Scpi as Scpi
from .links._visa import VisaLink as VisaLink
from .servers._hislip import HislipServer as HislipServer
from .servers._tcp import TcpServer as TcpServer
from .simulated import SimulatedBench as SimulatedBench
