"""Numbers of a page: digits, units, percent, standard errors."""

import math

import hypothesis
import hypothesis.strategies as st
import pytest
from parsed_page import spaced

from fitting.report.diagnosis._numbers import (
    Scale,
    format_number,
    format_percent,
    format_with_error,
)
from fitting.report.diagnosis._which import describe_parameters
from fitting.report.fit._table import round_with_error


@hypothesis.given(st.floats(allow_nan=False, allow_infinity=False), st.integers(1, 6))
def test_number_reads_back_to_its_digits(value, digits):
    text = format_number(value, digits).replace("\N{MINUS SIGN}", "-")
    small = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    mantissa, _, exponent = text.partition("×10")
    # As text: the largest numbers overflow when their rounded mantissa is scaled.
    read = float(f"{mantissa}e{exponent.translate(small)}") if exponent else float(mantissa)
    assert "e" not in text
    assert read == float(f"{value:.{digits - 1}e}") or math.isinf(read)


@hypothesis.given(st.floats(0.0, 1.0))
def test_percent_claims_no_certainty(p):
    text = format_percent(p)
    assert not text.startswith("100")
    assert text != "0\N{NO-BREAK SPACE}%" or p == 0.0
    if text[0].isdigit():
        assert float(text.split("\N{NO-BREAK SPACE}")[0]) == pytest.approx(100 * p, abs=0.5001)


@pytest.mark.parametrize(
    ("unit", "size", "shown", "text"),
    [
        ("GHz", 0.0247, "MHz", "24.7 MHz"),
        ("GHz", 3.2, "GHz", "3.20 GHz"),
        ("MHz", 0.5, "kHz", "500 kHz"),
        ("um", 0.0031, "nm", "3.10 nm"),
        ("um", 12.0, "μm", "12.0 μm"),
        ("fringe", 0.02, "fringe", "0.0200 fringe"),
        ("GHz", 0.0, "GHz", "0 GHz"),
    ],
)
def test_unit_of_the_page(unit, size, shown, text):
    scale = Scale.of(unit, [None, size, math.nan])
    assert scale.unit == shown
    assert spaced(scale(size)) == text


def test_parameters_that_are_not_determined_are_named_together():
    """Without the effect's name, where there is one effect."""
    creep = {
        "creep.gain": {"value": 0.0142, "stderr": 0.0016, "unit": "1/decade"},
        "creep.lead_s": {"value": 3.0, "stderr": None, "unit": "s"},
        "creep.rest": {"value": 0.0, "stderr": None, "unit": "1"},
    }
    scale = Scale.of("GHz", [1.0])
    (gain, left) = describe_parameters(creep, scale)
    assert gain[0] == "gain" and gain[1].startswith("0.0142")
    assert left == ("not determined", "lead, rest")
    both = creep | {"etalon.spacing": {"value": 9.0, "stderr": 0.01, "unit": "GHz"}}
    names = [name for name, _ in describe_parameters(both, scale)]
    assert names == ["creep gain", "etalon spacing", "not determined"]


def test_fields_of_effects_are_words():
    found = {
        "pickup.hertz": {"value": 150.0, "stderr": 0.01, "unit": "Hz"},
        "pickup.third_sine": {"value": 0.1, "stderr": 0.01, "unit": "1"},
    }
    scale = Scale.of("GHz", [1.0])
    names = [name for name, _ in describe_parameters(found, scale)]
    assert names == ["frequency", "third harmonic (sine)"]
    both = found | {"mode_hop.settle_s": {"value": 1e-3, "stderr": 1e-4, "unit": "s"}}
    names = [name for name, _ in describe_parameters(both, scale)]
    assert names[0] == "pickup frequency" and names[2] == "mode hop settle"


def test_error_sets_the_digits():
    assert spaced(format_with_error(0.02104, 0.00061, "1/decade")) == "0.02104 ± 0.00061 1/decade"
    assert format_with_error(-3.14, None, "GHz") == "not determined"
    assert spaced(format_with_error(2.0, 0.0, "1")) == "2.000"
    assert spaced(format_with_error(1.04e-4, 3e-6, "s")) == "104.0 ± 3.0 μs"
    assert spaced(format_with_error(-2.5e7, 4e5, "Hz")) == "\N{MINUS SIGN}25.00 ± 0.40 MHz"
    assert spaced(format_with_error(0.0, 2.0, "um")) == "0.0 ± 2.0 μm"
    assert spaced(format_with_error(29_700.0, 3_300.0, "MHz")) == "29.7 ± 3.3 GHz"
    assert spaced(format_with_error(2.5e-9, 1e-10, "s")) == "2.50 ± 0.10 ns"
    # Of a value far below its error no digit is known.
    assert spaced(format_with_error(18.0, 98_000.0, "1")) == "0 ± 98000"
    assert round_with_error(1.4, 1.2e5) == ("0", "120000")
    assert round_with_error(2.2e-4, 5.4e-4) == ("0.00022", "0.00054")


@pytest.mark.parametrize(
    ("unit", "value", "stderr", "shown"),
    [
        ("s", 1.54e-5, 1.0e-7, "15.40 ± 0.10 μs"),
        ("Hz", 10_780.0, 800.0, "10.78 ± 0.80 kHz"),
        ("GHz", 0.0427, 0.0011, "42.7 ± 1.1 MHz"),
        ("1", 0.39, 0.067, "0.390 ± 0.067"),
    ],
)
def test_a_parameter_and_its_error_are_shown_in_one_unit(unit, value, stderr, shown):
    """An error is often so much smaller that by itself it would be in another: 0.1 us is 100 ns."""
    found = {"effect.size": {"value": value, "stderr": stderr, "unit": unit}}
    ((_, text),) = describe_parameters(found, Scale.of("GHz", [0.05]))
    assert spaced(text) == shown
