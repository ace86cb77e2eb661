"""Index of air by P. E. Ciddor, Appl. Opt. 35, 1566 (1996), and its group index.

P. E. Ciddor and R. J. Hill, Appl. Opt. 38, 1663 (1999), for the group index.
"""

from ._moist_air import densities, water_fraction

# Dispersion of dry air, um^-2 (Eq. (1)), and of water vapour, um^-2k (Eq. (3)).
_AIR = ((5792105.0, 238.0185), (167917.0, 57.362))
_WATER = (295.235, 2.6422, -0.032380, 0.004028)
_WATER_SCALE = 1.022  # the correction that fits measured vapour, Eq. (3)
_STANDARD_AIR = (15.0, 101_325.0)  # deg C and Pa, where Eq. (1) holds
_STANDARD_WATER = (20.0, 1_333.0)  # deg C and Pa of pure vapour, where Eq. (3) holds


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
    wavenumber = 1e-12 / wavelength_m**2  # squared, um^-2
    air, vapour = _standard(wavenumber, co2_ppm, group)
    water = water_fraction(temperature_c, pressure_pa, humidity)
    of_air, of_water = densities(temperature_c, pressure_pa, water, co2_ppm)
    standard_air, _ = densities(*_STANDARD_AIR, 0.0, co2_ppm)
    _, standard_water = densities(*_STANDARD_WATER, 1.0, co2_ppm)
    return of_air / standard_air * air + of_water / standard_water * vapour  # Ciddor, Eq. (5)


def _standard(squared: float, co2_ppm: float, group: bool) -> tuple[float, float]:
    """Refractivity of standard air and of standard vapour.

    The group index is n + s dn/ds with s the wavenumber (Ciddor and Hill 1999).
    """
    if group:
        air = sum(a * (b + squared) / (b - squared) ** 2 for a, b in _AIR)
        vapour = sum((2 * k + 1) * w * squared**k for k, w in enumerate(_WATER))
    else:
        air = sum(a / (b - squared) for a, b in _AIR)
        vapour = sum(w * squared**k for k, w in enumerate(_WATER))
    carbon = 1.0 + 0.534e-6 * (co2_ppm - 450.0)  # Eq. (2)
    return 1e-8 * air * carbon, 1e-8 * _WATER_SCALE * vapour
