"""Effects that an operator leaves out: one file each, every one the identity at its defaults.

A new one is one file, one export line here, and one entry in `ALL`.
"""

from ._amplifier_lowpass import AmplifierLowpass as AmplifierLowpass
from ._amplitude_law import AmplitudeLaw as AmplitudeLaw
from ._creep import Creep as Creep
from ._current_coupling import CurrentCoupling as CurrentCoupling
from ._delay import Delay as Delay
from ._drift import Drift as Drift
from ._etalon import Etalon as Etalon
from ._gain_drift import GainDrift as GainDrift
from ._mode_hop import ModeHop as ModeHop
from ._pickup import Pickup as Pickup
from ._quantisation import Quantisation as Quantisation
from ._rate_law import RateLaw as RateLaw
from ._resonance import Resonance as Resonance
from ._saturation import Saturation as Saturation
from ._slew_limit import SlewLimit as SlewLimit
from .base._by_place import AbstractBend as AbstractBend
from .base._by_place import AbstractCouplingEffect as AbstractCouplingEffect
from .base._by_place import AbstractDriveEffect as AbstractDriveEffect
from .base._by_place import AbstractFollower as AbstractFollower
from .base._by_place import AbstractInvertible as AbstractInvertible
from .base._by_place import AbstractOpticalEffect as AbstractOpticalEffect
from .base._by_place import AbstractSwitch as AbstractSwitch
from .base._contribution import Contribution as Contribution
from .base._derived import Derived as Derived
from .base._derived import ScanRange as ScanRange
from .base._effect import AbstractEffect as AbstractEffect
from .base._effect import SignatureAxis as SignatureAxis
from .base._law import AbstractLawEffect as AbstractLawEffect
from .base._law import Law as Law
from .base._linear import AbstractLagEffect as AbstractLagEffect
from .base._linear import AbstractLinearEffect as AbstractLinearEffect
from .base._linear import Modes as Modes
from .base._residual_summary import ResidualSummary as ResidualSummary

# In the order in which light and signal meet them.
ALL: tuple[type[AbstractEffect], ...] = (
    Quantisation,
    SlewLimit,
    Saturation,
    AmplifierLowpass,
    RateLaw,
    AmplitudeLaw,
    Delay,
    Creep,
    Resonance,
    GainDrift,
    Drift,
    CurrentCoupling,
    ModeHop,
    Etalon,
    Pickup,
)
