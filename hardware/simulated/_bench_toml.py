"""A `bench.toml` for the simulated laboratory, as a template."""

from collections.abc import Mapping

from rapi_jax import DriveLimits

from ._laboratory import Laboratory
from .laser.current_tuning._current_tuned import CurrentTunedLaser

_TEXT = """\
# A simulated laboratory. For your own, change the addresses, and first of all the limits.
schema = "rapi.bench/1"
settling = 2  # periods played before a record

[limits]  # of the voltage at the piezo's input
low_v = 0.0
high_v = 7.5
slew_v_per_s = 2000.0
step_v = 0.1  # from one sample to the next, and where the period closes
max_frequency_hz = 100.0

[generator]  # AFG31052
resource = "{generator}"
load_ohm = inf  # what is connected; a 50 ohm setting doubles the voltage into high impedance

[laser]  # TLB-6700: `resource` of `rapi bench bridge`, or `serial` on Windows
resource = "{laser}"

[laser.limits]
wavelength_nm = [765.0, 781.0]
piezo_percent = [0.0, 100.0]
current_ma = [30.0, 140.0]
diode_c = [15.0, 30.0]
cavity_c = [20.0, 40.0]

[digitizer]  # InfiniiVision; the generator's trigger output at its external trigger
resource = "{digitizer}"
interferometer = {{ connector = 1, low_v = -0.2, high_v = 1.2 }}
cavity = {{ connector = 2, low_v = -0.2, high_v = 1.2 }}
{measurement}sample_hz = 10e6

[optics]
delay_s = {delay_s!r}  # of the auxiliary interferometer
fsr_ghz = 1.5  # of the cavity
"""

_CURRENT_TUNED = """\
# A simulated laser diode that its current tunes. For your own, change the addresses, and first of
# all the limits.
schema = "rapi.bench/1"
settling = 20  # periods played before a record: the slowest thermal lag is some ms

[limits]  # of the voltage at the current driver's modulation input
low_v = {limits.low_v!r}
high_v = {limits.high_v!r}
slew_v_per_s = {limits.slew_v_per_s!r}
step_v = 0.1  # from one sample to the next, and where the period closes
max_frequency_hz = {limits.max_frequency_hz!r}

[generator]  # AFG31052
resource = "{generator}"
load_ohm = inf  # what is connected; a 50 ohm setting doubles the voltage into high impedance

[digitizer]  # InfiniiVision; the generator's trigger output at its external trigger
resource = "{digitizer}"
interferometer = {{ connector = 1, low_v = -0.2, high_v = 1.2 }}
cavity = {{ connector = 2, low_v = -0.2, high_v = 1.2 }}
{measurement}sample_hz = {laboratory.digitizer.sample_hz!r}

[optics]
delay_s = {laboratory.interferometer.delay_s!r}  # of the auxiliary interferometer
fsr_ghz = {fsr_ghz!r}  # of the cavity
wavelength_m = {wavelength_m!r}
rises_with_voltage = false  # more current, more heat, longer wavelength
"""

_MEASUREMENT = "measurement = { connector = 3, low_v = -0.2, high_v = 1.2 }  # of a target\n"


def bench_toml(at: Mapping[str, str], *, delay_s: float, measurement: bool = False) -> str:
    """The file's text. `at`: VISA addresses of "generator", "laser" and "digitizer"; `delay_s`: of
    the auxiliary interferometer; `measurement`: whether a measurement arm is at input 3.
    """
    return _TEXT.format(**at, delay_s=delay_s, measurement=_MEASUREMENT if measurement else "")


def current_tuned_toml(
    at: Mapping[str, str], laboratory: Laboratory, *, limits: DriveLimits
) -> str:
    """The text for a laser that its current tunes, without a laser controller.

    `at`: VISA addresses of "generator" and "digitizer"; optics and sampling are `laboratory`'s.
    """
    cavity, device = laboratory.cavity, laboratory.device
    if not isinstance(device, CurrentTunedLaser):
        raise ValueError(f"A {type(device).__name__} is not tuned by its current.")
    return _CURRENT_TUNED.format(
        **at,
        laboratory=laboratory,
        limits=limits,
        wavelength_m=device.wavelength_m,
        fsr_ghz=1.5 if cavity is None else cavity.fsr_ghz,
        measurement="" if laboratory.measurement is None else _MEASUREMENT,
    )
