"""Recordings in files: read and written whole, in stated units, from files that are not trusted."""

from ._atomic import OutputError as OutputError
from ._atomic import atomic_path as atomic_path
from ._atomic import write_atomic as write_atomic
from ._model_file import read_model as read_model
from ._model_file import write_model as write_model
from ._safe import printable as printable
from ._units import check_plausible as check_plausible
from .drives._drive_file import read_afg as read_afg
from .drives._drive_file import read_drive as read_drive
from .drives._drive_file import write_afg as write_afg
from .drives._drive_file import write_drive as write_drive
from .drives._limits_file import read_limits as read_limits
from .fringes._read import read_fringe_records as read_fringe_records
from .fringes._write import FringeWriter as FringeWriter
from .fringes._write import write_fringe_records as write_fringe_records
from .imports._import import Imported as Imported
from .imports._import import import_recording as import_recording
from .imports._options import ImportOptions as ImportOptions
from .imports._options import MadeDrive as MadeDrive
from .imports._write import check_output as check_output
from .imports._write import write_import as write_import
from .recordings._oscilloscope import join_runs as join_runs
from .recordings._oscilloscope import read_oscilloscope as read_oscilloscope
from .recordings._read_write import read_recording as read_recording
from .recordings._read_write import write_recording as write_recording
