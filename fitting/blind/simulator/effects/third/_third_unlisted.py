"""Third effects that no list holds: for sealed banks, on which nothing has been developed."""

from fitting.blind.simulator.effects._recipe import Maker

from . import _third_unlisted_device as of_device
from . import _third_unlisted_readout as of_readout

UNSEEN_UNLISTED: dict[str, Maker] = {
    maker.__name__: maker
    for maker in (
        of_device.accommodation, of_device.charge_leak, of_device.converter_ripple,
        of_readout.cycle_slips, of_device.hum_modulation, of_device.injection_locking,
        of_readout.late_reversal, of_device.photothermal, of_device.quadratic_drag,
        of_readout.wavemeter,
    )
}  # fmt: skip
