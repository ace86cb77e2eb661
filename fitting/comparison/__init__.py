"""Two recordings of one device: what changed between them, with intervals."""

from ._compare import compare as compare
from ._comparison import Comparison as Comparison
from ._differences import EffectPresence as EffectPresence
from ._differences import GapChange as GapChange
from ._differences import Interval as Interval
from ._differences import ParameterDifference as ParameterDifference
