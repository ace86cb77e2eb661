"""How units and numbers in a text are set: what changes, and what must stay as it is."""

import pytest

from rapi_jax.display._typeset import typeset, unit_text


@pytest.mark.parametrize(
    ("plain", "wanted"),
    [
        ("rmse 3.2 um rms", "rmse 3.2_μm rms"),
        ("rmse (um)", "rmse (μm)"),
        ("slope down to -0.03525 um/V at 4.5 V", "slope down to −0.03525_μm/V at 4.5_V"),
        ("1.85e-06 um s/V", "1.85×10⁻⁶_μm s/V"),
        ("-0.109 um/V^2", "−0.109_μm/V²"),
        ("play 1 from -1.32e+03 V", "play 1 from −1320_V"),
        ("5e-10 um/√Hz", "5×10⁻¹⁰_μm/√Hz"),
        ("1.424167e+05 V", "142416.7_V"),
        ("4.8 % of its span", "4.8_% of its span"),
        ("at 10 Hz, 625 kHz and 20 us.", "at 10_Hz, 625_kHz and 20_μs."),
        ("2.5e-3", "0.0025"),
        ("from -1.32e+03 to -2.37e-07 V", "from −1320 to 0_V"),
        ("from 1e-3 to 1e+05 Hz", "from 0.001 to 100000_Hz"),
    ],
)
def test_what_is_set(plain, wanted):
    assert typeset(plain).replace("\N{NO-BREAK SPACE}", "_") == wanted
    assert typeset(typeset(plain)) == typeset(plain)


@pytest.mark.parametrize(
    "text",
    [
        "2026-11-24T10:00:00Z",
        "rapi-jax 0.3.1, numpy 2.1.0",
        "rec-0003, run-10",
        "3e5f7a1e-4b2d",
        "let us say so",
        "9 runs, 3 hours, 10 misfits",
        "SHA-256",
        "rapi.fit/1",
        "data/um/run.csv",
    ],
)
def test_what_stays(text):
    assert typeset(text) == text


def test_a_unit_by_itself():
    assert unit_text("um s/V") == "μm s/V" and unit_text("1/us") == "1/μs"
    assert [unit_text(unit) for unit in ("urad", "GHz", "1", "unit")] == [
        "μrad",
        "GHz",
        "1",
        "unit",
    ]
