"""The refractive index of air along the measurement arm, with its standard error."""

from ._index import AirIndex as AirIndex
from ._index import group_index as group_index
from ._index import refractive_index as refractive_index
