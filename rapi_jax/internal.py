"""What the sibling packages need beyond the public names; no stability is promised.

Imports nothing that `import rapi_jax` does not, so it costs nothing.
"""

from ._arguments import takes as takes
from ._ecdl import compiled_respond as compiled_respond
from ._ecdl import drive_side as drive_side
from ._ecdl import laws as laws
from ._ecdl import operator_response as operator_response
from ._ecdl import optical_side as optical_side
from ._ecdl import respond as respond
from ._limits import closing_step as closing_step
from ._metrics import SPEED_OF_LIGHT as SPEED_OF_LIGHT
from ._metrics import Branch as Branch
from ._parameter import follow as follow
from ._precision import float64 as float64
from ._threshold import threshold as threshold
from .display._readable_unit import quantity as quantity
from .display._readable_unit import readable_unit as readable_unit
from .display._readable_unit import significant as significant
from .display._recording import recording_dataset as recording_dataset
from .display._signature_axes import signature_axis as signature_axis
from .inversion._inverse_effects import refuse as refuse
from .io._safe import StrPath as StrPath
from .io._safe import cause as cause
from .io._safe import check_name as check_name
from .io._safe import inside as inside
from .io._safe import located as located
from .io._safe import open_regular as open_regular
from .io._safe import read_text as read_text
from .io._toml import read_toml as read_toml
from .io.drives._afg_waveform import FULL as FULL
from .io.drives._afg_waveform import POINTS as POINTS
from .io.drives._afg_waveform import codes_of as codes_of
from .io.drives._afg_waveform import period_volts as period_volts
from .operators._origin import scan_origin as scan_origin
from .plays._contact_intervals import Band as Band
from .plays._monotone_stretches import Stretches as Stretches
from .plays._monotone_stretches import stretches_on_device as stretches_on_device
from .plays._monotone_stretches import turning_places as turning_places
from .plays._plays import Plays as Plays
from .recording._conditions import parse_recorded_at as parse_recorded_at
from .recording._conditions import parse_temperature as parse_temperature
from .recording._drive import Waveform as Waveform
from .recording._identical import identical_runs as identical_runs
from .recording._waveform_miss import describe_swap as describe_swap
from .recording._waveform_miss import waveform_miss as waveform_miss
from .sampling._batch import Batch as Batch
from .sampling._batch import DriveBatch as DriveBatch
from .sampling._batch import on_device as on_device
from .sampling._batch import to_batch as to_batch
from .sampling._batch import usable as usable
from .sampling._phase import are_whole_samples as are_whole_samples
from .sampling._phase import branch_fraction as branch_fraction
from .sampling._phase import turning_samples as turning_samples
from .sampling._white_noise import white_noise_rms as white_noise_rms
