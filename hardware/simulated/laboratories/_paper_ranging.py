"""The paper's ranging set-up: noise figures chosen from its uncompensated distances alone.

Fixed before any compensated distance was simulated, and not changed since. What they were chosen
by is the column "Without compensation" of Table 2: ten standard deviations of 43 to 58 um (mean 51)
that do not grow with distance.

- The nonlinearity of the scan alone, by counting over the region of interest with both fractions
  interpolated in time (Eq. 4), gives 24 to 32 um at 0.60 to 0.78 m, in proportion to distance: up
  to 72 um of bias on the down-scans, as the cavity's comb lies.
- `WANDER`: where the comb lies changes within seconds, by a frequency that wanders over half an
  order. Three times slower or faster changes the largest spread by 4 %.
- `VIBRATION`: fills what is left, since vibration does not grow with distance: 5 nm give 45 to
  58 um together, 3 nm 33 to 43, 6 nm 51 to 65.
- Of the cavity's ends no more than 0.1 MHz (1.8 um) is assumed: their part would grow with
  distance, which the column's does not.
- `AMPLIFIER_HZ`: the piezo's input smooths the generator's steps of 4.7 MHz, as any does.
- Drift of the path: 1 um in an hour. The displacement deviations of Table 3, 43 um at most, are not
  reached: 18 um. Steady errors of 20 um at a node have no named cause in the paper.
"""

from hardware.simulated._laboratory import Laboratory
from hardware.simulated.laser._device import Device
from hardware.simulated.laser._digitizer import Digitizer
from hardware.simulated.laser._dynamics import Amplifier
from hardware.simulated.laser._light_noise import Laser
from hardware.simulated.laser._measurement_arm import MeasurementArm
from hardware.simulated.laser._optics import Cavity
from hardware.simulated.laser.motion._motions import RandomVibration, ThermalDrift
from hardware.simulated.laser.motion._target import Target
from rapi_jax.examples import paper_device

WANDER_GHZ, WANDER_HZ = 0.75, 0.3
VIBRATION_M, VIBRATION_HZ = 5e-9, (20.0, 200.0)
CAVITY_GHZ = 1e-4
AMPLIFIER_HZ = 2000.0
DRIFT_M = 1e-6


def paper_ranging(
    target: Target,
    *,
    seed: int = 0,
    digitizer: Digitizer = Digitizer(),  # noqa: B008 (frozen)
    laser: Laser = Laser(),  # noqa: B008
    vibration: bool = True,
    wander: bool = True,
    cavity_noise: bool = True,
) -> Laboratory:
    """The laboratory; each of its disturbances can be switched off. `seed`: of wander, vibration
    and drift, which are functions of session time.
    """
    if vibration:
        low, high = VIBRATION_HZ
        target = target + RandomVibration(VIBRATION_M, low, high, seed=2 * seed)
        target = target + ThermalDrift(DRIFT_M, seed=2 * seed + 1)
    return Laboratory(
        Device(paper_device(), Amplifier(bandwidth_hz=AMPLIFIER_HZ)),
        laser=laser,
        digitizer=digitizer,
        cavity=Cavity(jitter_ghz=CAVITY_GHZ if cavity_noise else 0.0),
        measurement=MeasurementArm(target),
        wander=RandomVibration(WANDER_GHZ, 0.0, WANDER_HZ, seed=seed) if wander else None,
    )
