"""The sim-to-real gap: where it lies, which effect causes it, how far it shrinks."""

from ._diagnose import diagnose as diagnose
from ._diagnosis import Diagnosis as Diagnosis
from ._diagnosis import Verdict as Verdict
