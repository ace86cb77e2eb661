"""Listed effects in third other forms: for sealed banks, on which nothing has been developed."""

from fitting.blind.simulator.effects._recipe import Maker

from . import _third_forms_actuator as on_actuator
from . import _third_forms_drive as on_drive
from . import _third_forms_light as on_light

UNSEEN_FORMS: dict[str, Maker] = {
    f"{maker.__name__}/3": maker
    for maker in (
        on_drive.amplifier_lowpass, on_actuator.amplitude_law, on_actuator.creep,
        on_light.current_coupling, on_drive.delay, on_light.drift, on_light.etalon,
        on_light.gain_drift, on_light.mode_hop, on_light.pickup, on_drive.quantisation,
        on_actuator.rate_law, on_actuator.resonance, on_drive.saturation, on_drive.slew_limit,
    )
}  # fmt: skip
"""Makers by the listed effect's name and `/3`; their devices' truth is the listed name."""
