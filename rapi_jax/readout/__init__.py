"""Readout: from the fringes of photodiodes to optical frequency (Eqs. 1 and 2)."""

from ._etalon import read_etalon as read_etalon
from ._fringes import Fringes as Fringes
from ._read import read_fringes as read_fringes
from ._readout import Peaks as Peaks
from ._readout import Readout as Readout
from ._readout import Turn as Turn
