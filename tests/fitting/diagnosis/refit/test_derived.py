"""Derived quantities against their definitions, errors against drawn parameters."""

import numpy as np
import pytest
from edge_worlds import drives, record
from worlds import TRUTHS

from fitting.diagnosis.refit.estimates._derived import derive_quantities
from rapi_jax import Recording
from rapi_jax.effects import ALL, ScanRange

RECORDING = record(drives((10.0, 40.0), periods=2, samples=50))
C = 299.792458  # mm GHz

KNOWN = {
    "amplifier_lowpass": ("-3 dB bandwidth", "tau", 1e-4, 1591.549431, "Hz"),
    "delay": ("phase at the fastest scan", "tau", 1e-4, 1.44, "deg"),
    "quantisation": ("resolution", "step", 3.0 / 1024.0, 10.0, "bit"),
    "etalon": ("optical length", "spacing", 10.0, C / 20.0, "mm"),
    "mode_hop": ("cavity, if one mode", "size", -3.0, C / 6.0, "mm"),
    "resonance": ("quality factor", "damping", 0.05, 10.0, "1"),
    "creep": ("creep a decade of time", "gain", 0.02, 2.0, "%"),
    "gain_drift": ("change of gain a minute", "rate", 1e-4, 0.6, "%"),
}


@pytest.mark.parametrize("name", KNOWN)
def test_by_hand(name):
    said, parameter, value, wanted, unit = KNOWN[name]
    found = {parameter: {"value": value, "stderr": 0.01 * abs(value), "unit": ""}}
    (got,) = derive_quantities((TRUTHS[name],), found, RECORDING).items()
    assert got[0] == said and got[1]["unit"] == unit
    assert got[1]["value"] == pytest.approx(wanted, rel=1e-6)
    if name not in ("quantisation",):
        assert got[1]["stderr"] == pytest.approx(0.01 * wanted, rel=1e-3)


def test_an_error_is_that_of_drawn_parameters():
    rng = np.random.default_rng(1)
    found = {"tau": {"value": 1e-4, "stderr": 5e-6, "unit": "s"}}
    (got,) = derive_quantities((TRUTHS["amplifier_lowpass"],), found, RECORDING).values()
    drawn = 1.0 / (2.0 * np.pi * (1e-4 + 5e-6 * rng.standard_normal(100_000)))
    assert got["stderr"] == pytest.approx(drawn.std(), rel=0.02)


def test_a_reciprocal_of_what_may_be_nought_is_not_told():
    """A damping of 0.019 with an error of 19: no quality factor of 26.259 with one of 0.026."""
    found = {"damping": {"value": 0.019, "stderr": 19.0, "unit": "1"}}
    (got,) = derive_quantities((TRUTHS["resonance"],), found, RECORDING).values()
    assert got["value"] == pytest.approx(1.0 / 0.038) and got["stderr"] == np.inf
    linear = {"tau": {"value": 1e-6, "stderr": 1e-4, "unit": "s"}}
    (got,) = derive_quantities((TRUTHS["delay"],), linear, RECORDING).values()
    assert got["stderr"] == pytest.approx(100.0 * got["value"])


def test_what_is_not_finite_or_not_optical_is_left_out():
    none = {"tau": {"value": 0.0, "stderr": 1e-6, "unit": "s"}}
    assert derive_quantities((TRUTHS["amplifier_lowpass"],), none, RECORDING) == {}
    volts = Recording(RECORDING.runs, response_unit="V")
    spacing = {"spacing": {"value": 10.0, "stderr": 0.1, "unit": "V"}}
    assert derive_quantities((TRUTHS["etalon"],), spacing, volts) == {}
    unknown = {"spacing": {"value": 10.0, "stderr": float("inf"), "unit": "GHz"}}
    (got,) = derive_quantities((TRUTHS["etalon"],), unknown, RECORDING).values()
    assert got["value"] > 0 and not got["stderr"] < 1e9


def test_two_effects_carry_their_names():
    pair = (TRUTHS["delay"], TRUTHS["creep"])
    found = {
        "delay.tau": {"value": 1e-4, "stderr": 1e-6, "unit": "s"},
        "creep.gain": {"value": 0.02, "stderr": 1e-3, "unit": "1/decade"},
    }
    names = set(derive_quantities(pair, found, RECORDING))
    assert names == {"delay.phase at the fastest scan", "creep.creep a decade of time"}


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.name)
def test_each_follows_from_a_free_parameter_of_its_effect(cls):
    effect = TRUTHS[cls.name]
    for derived in effect.derived(ScanRange(3.0, 40.0)):
        assert hasattr(effect, derived.parameter) and derived.name and derived.unit
