"""Ranging: distance and velocity from the fringes of a frequency scan (Section 2, Eqs. 1 to 7)."""

from ._range import range_records as range_records
from ._ranging import Ranging as Ranging
from ._ranging import Target as Target
from ._records import AirState as AirState
from ._records import FringeRecord as FringeRecord
from ._records import FringeRecords as FringeRecords
from ._scan_table import ScanTable as ScanTable
from ._summary import RangeSummary as RangeSummary
from .distance._estimators import BEST as BEST
from .distance._estimators import Method as Method
