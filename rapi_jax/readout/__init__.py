"""Readout: from the fringes of photodiodes to optical frequency (Eqs. 1 and 2)."""

from ._fringes import Fringes as Fringes
from ._read_fringes import read_fringes as read_fringes
from ._readout import Peaks as Peaks
from ._readout import Readout as Readout
from ._readout import Turn as Turn
from .cavity._low_finesse import read_etalon as read_etalon
