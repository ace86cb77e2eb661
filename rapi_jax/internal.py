"""What the sibling packages need beyond the public names; no stability is promised.

Imports nothing that `import rapi_jax` does not, so it costs nothing.
"""

from ._ecdl import drive_side as drive_side
from ._ecdl import laws as laws
from ._ecdl import optical_side as optical_side
from ._precision import float64 as float64
from ._threshold import threshold as threshold
from .io._safe import StrPath as StrPath
from .io._safe import cause as cause
from .io._safe import inside as inside
from .io._safe import located as located
from .io._safe import open_regular as open_regular
from .io._safe import read_text as read_text
from .io.drives._afg_waveform import FULL as FULL
from .io.drives._afg_waveform import POINTS as POINTS
from .io.drives._afg_waveform import codes_of as codes_of
from .io.drives._afg_waveform import period_volts as period_volts
from .sampling._batch import DriveBatch as DriveBatch
from .sampling._batch import on_device as on_device
