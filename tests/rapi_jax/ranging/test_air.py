"""The index of air against published tables, between formulas, and against Monte Carlo."""

import dataclasses
import itertools

import jaxtyping
import numpy as np
import pytest

from rapi_jax import DataError
from rapi_jax.ranging import AirState
from rapi_jax.ranging.air import group_index, refractive_index
from rapi_jax.ranging.air._moist_air import saturation_pressure

# NIST Engineering Metrology Toolbox, documentation, table comparing the two equations:
# deg C, % humidity, kPa, nm, Ciddor, Edlen; 450 ppm.
NIST = (
    (20, 0, 101.325, 633, 1.000271800, 1.000271799),
    (20, 0, 60, 633, 1.000160924, 1.000160920),
    (20, 0, 120, 633, 1.000321916, 1.000321918),
    (50, 0, 100, 633, 1.000243285, 1.000243270),
    (5, 0, 100, 633, 1.000282756, 1.000282750),
    (-40, 0, 100, 633, 1.000337580, 1.000337471),
    (50, 100, 120, 633, 1.000287924, 1.000287864),
    (40, 75, 120, 633, 1.000299418, 1.000299406),
    (20, 100, 100, 633, 1.000267394, 1.000267394),
    (40, 100, 110, 1700, 1.000270247, 1.000270237),
    (20, 0, 101.325, 1700, 1.000268479, 1.000268483),
    (40, 100, 110, 300, 1.000289000, 1.000288922),
    (20, 0, 101.325, 300, 1.000286581, 1.000286579),
    (-40, 0, 120, 300, 1.000427233, 1.000427072),
)

# Ciddor (1996), Table 1 (dry) and Table 3 (extreme): deg C, kPa, % humidity, 1e8 (n - 1); 633 nm.
# Row 3 of Table 3 prints 19996.5, but its column of differences says 19896.5.
CIDDOR = (
    (20, 80, 0, 21458.0),
    (20, 100, 0, 26824.4),
    (20, 120, 0, 32191.6),
    (10, 100, 0, 27774.7),
    (30, 100, 0, 25937.2),
    (20, 80, 75, 21394.0),
    (20, 120, 75, 32127.8),
    (40, 80, 75, 19896.5),
    (40, 120, 75, 29941.8),
    (50, 80, 100, 19058.4),
    (50, 120, 100, 28792.4),
)

# Ciddor (1996), Table 2: deg C, Pa, Pa of water vapour, ppm, 1e8 (n - 1); 633 nm.
MOIST = (
    (19.526, 102094.8, 1065, 510, 27392.9),
    (19.517, 102096.8, 1065, 510, 27394.0),
    (19.173, 102993.0, 641, 450, 27682.4),
    (19.173, 103006.0, 642, 440, 27685.8),
    (19.188, 102918.8, 706, 450, 27658.7),
    (19.189, 102927.8, 708, 440, 27660.8),
    (19.532, 103603.2, 986, 600, 27802.0),
    (19.534, 103596.2, 962, 600, 27800.8),
    (19.534, 103599.2, 951, 610, 27802.2),
)

LABORATORY = [
    AirState(t, p, h)
    for t, p, h in itertools.product((15.0, 20.0, 25.0), (95e3, 101_325.0, 105e3), (0.1, 0.5, 0.7))
]


@pytest.mark.parametrize("row", NIST)
def test_index_is_nists(row):
    """To the last printed digit, though NIST takes the vapour pressure from elsewhere."""
    t, h, kpa, nm, ciddor, edlen = map(float, row)
    air = AirState(t, kpa * 1e3, h / 100)
    assert abs(refractive_index(air, nm * 1e-9).value - ciddor) < 1e-9
    assert abs(refractive_index(air, nm * 1e-9, formula="edlen").value - edlen) < 1e-9


@pytest.mark.parametrize("row", CIDDOR)
def test_index_is_ciddors(row):
    t, kpa, h, expected = map(float, row)
    n = refractive_index(AirState(t, kpa * 1e3, h / 100), 633e-9)
    assert abs(1e8 * (n.value - 1) - expected) < 0.1


@pytest.mark.parametrize("row", MOIST)
def test_index_is_ciddors_in_measured_air(row):
    """To 0.4e-8; the second row differs from the first by more than its inputs say."""
    t, pascal, vapour, ppm, expected = map(float, row)
    n = refractive_index(AirState(t, pascal, vapour / saturation_pressure(t), ppm), 633e-9)
    assert abs(1e8 * (n.value - 1) - expected) < 0.4


@pytest.mark.parametrize("wavelength", (633e-9, 780e-9, 1550e-9))
def test_formulas_agree_in_the_laboratory(wavelength):
    for air in LABORATORY:
        ciddor = refractive_index(air, wavelength).value
        assert abs(refractive_index(air, wavelength, formula="edlen").value - ciddor) < 5e-8
        group = group_index(air, wavelength).value
        assert abs(group_index(air, wavelength, formula="edlen").value - group) < 5e-8


@pytest.mark.parametrize("formula", ("ciddor", "edlen"))
@pytest.mark.parametrize("wavelength", (350e-9, 633e-9, 780e-9, 1550e-9))
def test_group_index_is_the_derivative(formula, wavelength):
    """n - wavelength dn/dwavelength, by a five-point difference."""
    air = AirState(22.0, 98e3, 0.6, 600.0)
    step = 1e-3 * wavelength
    n = {
        k: refractive_index(air, wavelength + k * step, formula=formula).value for k in range(-2, 3)
    }
    slope = (n[-2] - 8 * n[-1] + 8 * n[1] - n[2]) / (12 * step)
    expected = n[0] - wavelength * slope
    assert abs(group_index(air, wavelength, formula=formula).value - expected) < 1e-12


@pytest.mark.parametrize("formula", ("ciddor", "edlen"))
def test_error_is_that_of_monte_carlo(formula):
    air = AirState(20.0, 101_325.0, 0.5)
    found = group_index(air, 780e-9, formula=formula)
    rng = np.random.default_rng(0)
    spread = (air.temperature_stderr, air.pressure_stderr, air.humidity_stderr, air.co2_stderr)
    centre = (air.temperature_c, air.pressure_pa, air.relative_humidity, air.co2_ppm)
    drawn = [
        group_index(AirState(*map(float, one)), 780e-9, formula=formula).value
        for one in rng.normal(centre, spread, (4000, 4))
    ]
    assert abs(np.mean(drawn) - found.value) < 5 * np.std(drawn) / np.sqrt(4000)
    inputs = np.sqrt(found.stderr**2 - found.parts["formula"] ** 2)
    assert abs(np.std(drawn) / inputs - 1) < 0.05


def test_error_is_the_formulas_own_where_the_air_is_known():
    exact = dict.fromkeys(
        ("temperature_stderr", "pressure_stderr", "humidity_stderr", "co2_stderr"), 0.0
    )
    air = dataclasses.replace(AirState(20.0, 101_325.0, 0.5), **exact)
    n = refractive_index(air, 780e-9)
    assert n.stderr == n.parts["formula"] == 1e-8
    assert group_index(air, 780e-9).stderr == 2e-8


def test_wavelength_in_nanometres_is_refused():
    air = AirState(20.0, 101_325.0, 0.5)
    with pytest.raises(DataError, match="is it in metres"):
        refractive_index(air, 780.0)
    with pytest.raises((DataError, jaxtyping.TypeCheckError)):
        refractive_index(air, 780e-9, formula="owens")
