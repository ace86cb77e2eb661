"""Instruments, and what stands in for them: the only package that talks to a laboratory."""

from rapi_jax._limits import DriveLimits as DriveLimits

from ._afg31000 import AFG31000 as AFG31000
from ._afg_channel import AfgChannel as AfgChannel
from ._bench import AbstractBench as AbstractBench
from ._bench_file import BenchFile as BenchFile
from ._bench_file import read_bench as read_bench
from ._bridge import Bridge as Bridge
from ._digitizer import AbstractDigitizer as AbstractDigitizer
from ._digitizer import Acquisition as Acquisition
from ._digitizer import Input as Input
from ._digitizer import Samples as Samples
from ._errors import InstrumentError as InstrumentError
from ._errors import LinkError as LinkError
from ._hislip import HislipServer as HislipServer
from ._infiniivision import InfiniiVision as InfiniiVision
from ._lab_bench import LabBench as LabBench
from ._lab_bench import allowed as allowed
from ._laser_limits import LaserLimits as LaserLimits
from ._laser_link import AbstractLaserLink as AbstractLaserLink
from ._laser_link import VisaLaserLink as VisaLaserLink
from ._link import AbstractLink as AbstractLink
from ._open_bench import dry_run as dry_run
from ._open_bench import open_bench as open_bench
from ._scpi import Scpi as Scpi
from ._tcp import TcpServer as TcpServer
from ._tlb6700 import TLB6700 as TLB6700
from ._vendor_dll import VendorDllLink as VendorDllLink
from ._visa import VisaLink as VisaLink
from .simulated import SimulatedBench as SimulatedBench
