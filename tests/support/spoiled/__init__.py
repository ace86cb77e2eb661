"""Ways to spoil a recording of the paper's device without making it unreadable.

Each takes a healthy recording's columns and gives back spoiled ones, with what the world was like:
a model that is to be trusted has to predict that world.
"""

# Each enters its ways.
from . import _clocks as _clocks
from . import _runs as _runs
from . import _values as _values
from ._causes import CAUSES as CAUSES
from ._columns import Columns as Columns
from ._columns import answers as answers
from ._columns import healthy as healthy
from ._columns import near_paper as near_paper
from ._columns import scaled as scaled
from ._ways import WAYS as WAYS
from ._ways import Spoil as Spoil
from ._ways import every as every
from ._ways import only as only
from ._ways import way as way
