"""Index of air by Edlen's formula as modified by K. P. Birch and M. J. Downs.

Metrologia 30, 155 (1993) and 31, 315 (1994). The term of water vapour is scaled with absolute
temperature, as in the documentation of NIST's Engineering Metrology Toolbox (J. A. Stone and
J. H. Zimmerman, Appendix A-IV); at 20 deg C, where it was measured, nothing changes.
"""

from ._moist_air import KELVIN, saturation_pressure

_VAPOUR_MEASURED = 292.75  # K


def refractivity(
    temperature_c: float,
    pressure_pa: float,
    humidity: float,
    co2_ppm: float,
    *,
    wavelength_m: float,
    group: bool,
) -> float:
    """Refractivity n - 1 of moist air, of phase or group; vacuum wavelength in m."""
    squared = 1e-12 / wavelength_m**2  # um^-2
    if group:  # n + s dn/ds, s the wavenumber
        standard = 8342.54
        standard += 2406147.0 * (130.0 + squared) / (130.0 - squared) ** 2
        standard += 15998.0 * (38.9 + squared) / (38.9 - squared) ** 2
    else:
        standard = 8342.54 + 2406147.0 / (130.0 - squared) + 15998.0 / (38.9 - squared)
    standard *= 1e-8 * (1.0 + 0.540e-6 * (co2_ppm - 450.0))  # Edlen (1966), Eq. (17)
    compressed = 1.0 + 1e-8 * (0.601 - 0.00972 * temperature_c) * pressure_pa
    dry = standard * pressure_pa / 96095.43 * compressed / (1.0 + 0.0036610 * temperature_c)
    vapour = humidity * saturation_pressure(temperature_c)
    dispersion = 3.7345 - (3.0 if group else 1.0) * 0.0401 * squared
    return dry - 1e-10 * dispersion * vapour * _VAPOUR_MEASURED / (temperature_c + KELVIN)
