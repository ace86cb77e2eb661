"""Effects that an operator leaves out: one file each, every one the identity at its defaults.

A new one is one file, one export line here, and one entry in `ALL`.
"""

from ._amplifier_lowpass import AmplifierLowpass as AmplifierLowpass
from ._amplitude_law import AmplitudeLaw as AmplitudeLaw
from ._base import AbstractCouplingEffect as AbstractCouplingEffect
from ._base import AbstractDriveEffect as AbstractDriveEffect
from ._base import AbstractEffect as AbstractEffect
from ._base import AbstractFollower as AbstractFollower
from ._base import AbstractInvertible as AbstractInvertible
from ._base import AbstractLagEffect as AbstractLagEffect
from ._base import AbstractLawEffect as AbstractLawEffect
from ._base import AbstractLinearEffect as AbstractLinearEffect
from ._base import AbstractOpticalEffect as AbstractOpticalEffect
from ._base import AbstractSwitch as AbstractSwitch
from ._base import Law as Law
from ._base import Modes as Modes
from ._base import SignatureAxis as SignatureAxis
from ._contribution import Contribution as Contribution
from ._creep import Creep as Creep
from ._current_coupling import CurrentCoupling as CurrentCoupling
from ._delay import Delay as Delay
from ._derived import Derived as Derived
from ._derived import ScanRange as ScanRange
from ._drift import Drift as Drift
from ._etalon import Etalon as Etalon
from ._gain_drift import GainDrift as GainDrift
from ._mode_hop import ModeHop as ModeHop
from ._pickup import Pickup as Pickup
from ._quantisation import Quantisation as Quantisation
from ._rate_law import RateLaw as RateLaw
from ._residual_summary import ResidualSummary as ResidualSummary
from ._resonance import Resonance as Resonance
from ._saturation import Saturation as Saturation
from ._slew_limit import SlewLimit as SlewLimit

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
