"""Laboratories for lasers that are tuned by their current: optics, digitizer and limits for each.

The auxiliary interferometer is as long as fringe rates at the highest scan rate and linewidths
allow. A scan's phase noise over a delay tau is `2 pi linewidth tau` (rad^2), and the limits on
slope and rate keep a fringe five or more samples long.
"""

import dataclasses
from typing import Literal

from hardware.simulated._laboratory import Laboratory
from hardware.simulated.laser._digitizer import Digitizer
from hardware.simulated.laser._light_noise import Laser
from hardware.simulated.laser._measurement_arm import MeasurementArm
from hardware.simulated.laser._optics import Cavity, Interferometer
from hardware.simulated.laser.current_tuning._lasers import dfb, vcsel
from rapi_jax import DriveLimits

_LIMITS = DriveLimits(0.0, 5.0, 2.5e4, max_frequency_hz=1000.0)
_VOLTS = 0.55  # of a bright fringe at the middle current: power rises by half over a scan


def current_tuned(
    laser: Literal["dfb", "vcsel"], measurement: MeasurementArm | None = None
) -> tuple[Laboratory, DriveLimits]:
    """The laboratory of one, and the limits at its driver's modulation input.

    Linewidths: 1 MHz (DFB) and 20 MHz (VCSEL), as catalogues have them. `measurement`: an arm that
    looks at a target; its wavelength becomes the laser's.
    """
    if laser == "dfb":
        device, light = dfb(), Laser(linewidth_hz=1e6)
        fibre_m, cavity = 2.0, Cavity(fsr_ghz=4.0, finesse=100.0, volts=_VOLTS)
    else:
        device, light = vcsel(), Laser(linewidth_hz=2e7)
        fibre_m, cavity = 0.3, Cavity(fsr_ghz=25.0, finesse=80.0, volts=_VOLTS)
    interferometer = dataclasses.replace(Interferometer.fibre(fibre_m), volts=_VOLTS)
    if measurement is not None:
        measurement = dataclasses.replace(
            measurement, wavelength_m=device.wavelength_m, volts=_VOLTS
        )
    return (
        Laboratory(
            device,
            laser=light,
            interferometer=interferometer,
            cavity=cavity,
            digitizer=Digitizer(sample_hz=5e7),
            measurement=measurement,
        ),
        _LIMITS,
    )
