"""Optical effects of the size they have on a device like the paper's: 75 GHz, 10 to 40 Hz."""

from rapi_jax.effects._creep import Creep
from rapi_jax.effects._current_coupling import CurrentCoupling
from rapi_jax.effects._drift import Drift
from rapi_jax.effects._etalon import Etalon
from rapi_jax.effects._gain_drift import GainDrift
from rapi_jax.effects._mode_hop import ModeHop
from rapi_jax.effects._pickup import Pickup
from rapi_jax.effects._resonance import Resonance
from rapi_jax.effects.base._effect import AbstractEffect

EXAMPLES: dict[str, AbstractEffect] = {
    "creep": Creep.at(gain=0.02, history=0.3, lead_periods=2.0),
    "resonance": Resonance.at(hertz=700.0, damping=0.05, share=1.0),
    "drift": Drift.at(amplitude=0.8, tau=2.0),
    "gain_drift": GainDrift.at(rate=0.02),
    "mode_hop": ModeHop.at(size=2.3, threshold=70.0, width=6.0, settle_s=1e-10),
    "etalon": Etalon.at(amplitude=0.15, phase=0.7, spacing=6.5),
    "pickup": Pickup.at(amplitude=0.05, hertz=50.0, phase=0.4),
    # 120 to 360 V/s: 12 to 36 MHz.
    "current_coupling": CurrentCoupling.at(coupling=1e-4, lag_s=1e-9),
}
