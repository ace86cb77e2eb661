"""Two lasers with numbers of the size that is published for their kind."""

from ._current_tuned import CurrentDriver, CurrentTunedLaser
from ._diode import LaserDiode
from ._thermal import ThermalImpedance


def dfb() -> CurrentTunedLaser:
    """An InGaAsP DFB laser at 1550 nm in a butterfly package, 50 to 150 mA from 0 to 5 V.

    -0.1 nm/K (12.5 GHz/K), 50 K/W, so about -0.9 GHz/mA at rest, half of that at some kHz, as a
    single-section DFB has it; +0.15 GHz/mA of prompt blue shift is left above 10 MHz, where the
    sign of the tuning has changed (S. Kobayashi et al., IEEE J. Quantum Electron. 18, 582 (1982);
    P. Correc et al., ibid. 30, 2485 (1994)). Time constants of active layer, chip, solder and
    submount: 0.5 us, 15 us, 250 us and 4 ms; J. Nordin and K. Hyyppa, Opt. Eng. 44 (2005), take
    such a network for the ramps of an FMCW range finder.
    """
    return CurrentTunedLaser(
        LaserDiode(
            threshold_ma=12.0,
            threshold_k=60.0,
            slope_mw_per_ma=0.25,
            slope_k=250.0,
            junction_v=0.9,
            series_ohm=5.0,
            thermal=ThermalImpedance((12.0, 15.0, 14.0, 9.0), (5e-7, 1.5e-5, 2.5e-4, 4e-3)),
            red_ghz_per_k=12.5,
            blue_ghz_per_mw=0.6,
            lowest_ma=20.0,
            highest_ma=180.0,
        ),
        CurrentDriver(offset_ma=50.0, ma_per_v=20.0, bandwidth_hz=1e6),
        wavelength_m=1550e-9,
    )


def vcsel() -> CurrentTunedLaser:
    """An oxide-confined GaAs VCSEL at 850 nm, 1.5 to 4.5 mA from 0 to 5 V.

    0.06 nm/K (25 GHz/K) and 4 K/mW for an aperture of some 4 um, so -190 GHz/mA at 2 mA and
    -260 at 4: what heats it is mostly its own resistance, and its power rolls over. Tuning falls
    from some 10 kHz on and has lost half at 200 kHz, which the time constants 0.2, 2 and 25 us
    make of the 1 / sqrt(i f) of diffusing heat; the interplay of chip and submount adds a little at
    10 to 100 Hz (3 ms); carriers tune by +2 GHz/mA (A. Hangauer et al., IEEE J. Sel. Top. Quantum
    Electron. 17, 1584 (2011), on VCSELs from 763 to 2300 nm).
    """
    return CurrentTunedLaser(
        LaserDiode(
            threshold_ma=0.5,
            threshold_k=120.0,
            slope_mw_per_ma=0.45,
            slope_k=160.0,
            junction_v=1.6,
            series_ohm=180.0,
            thermal=ThermalImpedance((1200.0, 1520.0, 960.0, 320.0), (2e-7, 2e-6, 2.5e-5, 3e-3)),
            red_ghz_per_k=25.0,
            blue_ghz_per_mw=5.0,
            lowest_ma=0.8,
            highest_ma=5.5,
        ),
        CurrentDriver(offset_ma=1.5, ma_per_v=0.6, bandwidth_hz=1e6),
        wavelength_m=850e-9,
    )
