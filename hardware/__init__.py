"""Instruments, and what stands in for them: the only package that talks to a laboratory."""

from rapi_jax._limits import DriveLimits as DriveLimits

from ._afg31000 import AFG31000 as AFG31000
from ._afg_channel import AfgChannel as AfgChannel
from ._bench import AbstractBench as AbstractBench
from ._errors import InstrumentError as InstrumentError
from ._errors import LinkError as LinkError
from ._link import AbstractLink as AbstractLink
from ._scpi import Scpi as Scpi
from ._visa import VisaLink as VisaLink
from .simulated import SimulatedBench as SimulatedBench
