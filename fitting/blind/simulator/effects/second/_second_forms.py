"""Listed effects in second other forms: once unseen, for development now."""

from fitting.blind.simulator.effects._recipe import Maker

from . import _second_forms_drive as on_drive
from . import _second_forms_optical as on_light

MORE_FORMS: dict[str, Maker] = {
    f"{maker.__name__}/2": maker
    for maker in (
        on_drive.amplifier_lowpass, on_drive.amplitude_law, on_light.creep,
        on_light.current_coupling, on_drive.delay, on_light.drift, on_light.etalon,
        on_light.gain_drift, on_light.mode_hop, on_light.pickup, on_drive.quantisation,
        on_drive.rate_law, on_light.resonance, on_drive.saturation, on_drive.slew_limit,
    )
}  # fmt: skip
"""Makers by the listed effect's name and `/2`; their devices' truth is the listed name."""
