"""Two recordings of one device: what changed between them, with intervals."""

from ._compare import compare as compare
from ._comparison import Comparison as Comparison
from ._comparison import EffectPresence as EffectPresence
from ._comparison import GapChange as GapChange
from ._comparison import Interval as Interval
from ._comparison import ParameterDifference as ParameterDifference
