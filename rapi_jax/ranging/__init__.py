"""Ranging: distance and velocity from the fringes of a frequency scan (Section 2, Eqs. 1 to 7)."""

from ._records import AirState as AirState
from ._records import FringeRecord as FringeRecord
from ._records import FringeRecords as FringeRecords
