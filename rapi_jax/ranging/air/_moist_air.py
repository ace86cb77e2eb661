"""Water vapour in air and its density, as Ciddor (1996) takes them from the BIPM.

P. Giacomo, Metrologia 18, 33 (1982); R. S. Davis, Metrologia 29, 67 (1992) (CIPM-81/91).
"""

import math

GAS_CONSTANT = 8.314510  # J/(mol K), of CIPM-81/91, which the other constants were fitted with
WATER_MOLAR_MASS = 0.018015  # kg/mol
KELVIN = 273.15


def saturation_pressure(temperature_c: float) -> float:
    """Saturation vapour pressure in Pa, over water or, below 0 deg C, over ice (Ciddor, App. C)."""
    kelvin = temperature_c + KELVIN
    if temperature_c < 0.0:
        return 10.0 ** (-2663.5 / kelvin + 12.537)
    return math.exp(
        1.2378847e-5 * kelvin**2 - 1.9121316e-2 * kelvin + 33.93711047 - 6.3431645e3 / kelvin
    )


def enhancement(temperature_c: float, pressure_pa: float) -> float:
    """How much more vapour saturates air than a vacuum (Ciddor, App. C)."""
    return 1.00062 + 3.14e-8 * pressure_pa + 5.6e-7 * temperature_c**2


def water_fraction(temperature_c: float, pressure_pa: float, humidity: float) -> float:
    """Molar fraction of water vapour at a relative humidity of 0 to 1."""
    saturated = enhancement(temperature_c, pressure_pa) * saturation_pressure(temperature_c)
    return humidity * saturated / pressure_pa


def compressibility(temperature_c: float, pressure_pa: float, water: float) -> float:
    """Compressibility Z of moist air (Ciddor, Eq. (12)); `water` is a molar fraction."""
    t, ratio = temperature_c, pressure_pa / (temperature_c + KELVIN)
    first = 1.58123e-6 - 2.9331e-8 * t + 1.1043e-10 * t**2
    first += (5.707e-6 - 2.051e-8 * t) * water + (1.9898e-4 - 2.376e-6 * t) * water**2
    return 1.0 - ratio * first + ratio**2 * (1.83e-11 - 0.765e-8 * water**2)


def air_molar_mass(co2_ppm: float) -> float:
    """Molar mass of dry air, kg/mol."""
    return 1e-3 * (28.9635 + 12.011e-6 * (co2_ppm - 400.0))


def densities(
    temperature_c: float, pressure_pa: float, water: float, co2_ppm: float
) -> tuple[float, float]:
    """Partial densities of dry air and of water vapour, kg/m^3 (Ciddor, Eq. (4))."""
    z = compressibility(temperature_c, pressure_pa, water)
    moles = pressure_pa / (z * GAS_CONSTANT * (temperature_c + KELVIN))
    return moles * (1.0 - water) * air_molar_mass(co2_ppm), moles * water * WATER_MOLAR_MASS
