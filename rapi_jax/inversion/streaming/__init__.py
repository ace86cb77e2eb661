"""Compensation sample by sample: a response wanted goes in, the drive for it comes out."""

from ._compensator import StreamingCompensator as StreamingCompensator
from ._compensator import StreamingState as StreamingState
from ._fixed_point import FixedPointCompensator as FixedPointCompensator
from ._operator import StreamingOperator as StreamingOperator
from ._word_length import WordLengthError as WordLengthError
from ._word_length import word_length_errors as word_length_errors
