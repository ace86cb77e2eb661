"""Models of piezo-scanned lasers: recordings, play operators, RA-PI, and what they predict."""

from ._ecdl import ECDL as ECDL
from ._ecdl import predict as predict
from ._errors import DataError as DataError
from ._errors import ModelError as ModelError
from ._parameter import Parameter as Parameter
from ._parameter import parameter as parameter
from ._parameter import parameters as parameters
from ._play import memory as memory
from ._play import play as play
from ._recording import Drive as Drive
from ._recording import Recording as Recording
from ._recording import Run as Run
from .operators import PI as PI
from .operators import RAPI as RAPI
from .operators import AbstractOperator as AbstractOperator
