"""The paper's laboratory: the device that gives Table 1's uncompensated half, and its limits."""

from hardware.simulated._laboratory import Laboratory
from hardware.simulated.laser._device import Device
from hardware.simulated.laser._digitizer import Digitizer
from hardware.simulated.laser._drift import Drift
from hardware.simulated.laser._dynamics import Amplifier, MirrorResonance, ParasiticEtalon
from hardware.simulated.laser._light_noise import Laser
from hardware.simulated.laser._measurement_arm import MeasurementArm
from hardware.simulated.laser._optics import Cavity
from rapi_jax import DriveLimits
from rapi_jax.examples import paper_device

PAPER_LIMITS = DriveLimits(0.0, 7.5, 2000.0, max_frequency_hz=100.0)


def paper_laboratory(
    *,
    latency_s: float,
    unmodelled: bool,
    drift: Drift,
    laser: Laser,
    cavity: Cavity | None,
    digitizer: Digitizer,
    measurement: MeasurementArm | None,
) -> Laboratory:
    """The laboratory; `unmodelled` adds what RA-PI has no term for."""
    device = Device(paper_device())
    if unmodelled:
        after = (MirrorResonance(1200.0, 0.12), ParasiticEtalon(0.02, 7.0, 0.4))
        device = Device(paper_device(), Amplifier(bandwidth_hz=1500.0), after)
    return Laboratory(
        device,
        latency_s=latency_s,
        drift=drift,
        laser=laser,
        cavity=cavity,
        digitizer=digitizer,
        measurement=measurement,
    )
