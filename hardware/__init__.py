"""Instruments, and what stands in for them: the only package that talks to a laboratory."""

from rapi_jax._limits import DriveLimits as DriveLimits

from ._bench import AbstractBench as AbstractBench
from .simulated import SimulatedBench as SimulatedBench
