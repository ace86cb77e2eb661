"""A laser diode: current and junction temperature to power, heat and optical frequency."""

import dataclasses

import numpy as np

from ._thermal import ThermalImpedance

_EXACT_K = 1e-9  # of the temperature that the power depends on and makes


@dataclasses.dataclass(frozen=True)
class DiodeState:
    """Over one period: temperature of the junction above the mount (K), power (mW), light (GHz).

    `thermal_ghz` and `carrier_ghz` are the two parts of the optical frequency, counted from a
    junction at the mount's temperature without light.
    """

    kelvin: np.ndarray
    power_mw: np.ndarray
    thermal_ghz: np.ndarray
    carrier_ghz: np.ndarray


@dataclasses.dataclass(frozen=True)
class LaserDiode:
    r"""Single-mode laser diode above its threshold, for changes slower than its GHz resonance.

    Power $P = \eta(T) (i - i_{th}(T))$, heat $Q = V_0 i + R i^2 - P$, junction $T = Z * Q$ above
    the mount, frequency $\nu = -\sigma T + \kappa P$: heating lowers it, with the lags of $Z$;
    carriers raise it at once, with the power (adiabatic chirp; above threshold their density is
    clamped but for what gain saturation adds).

    | field | meaning | unit |
    |---|---|---|
    | `threshold_ma`, `threshold_k` | $i_{th} = i_0 e^{T / T_0}$: $i_0$, $T_0$ | mA, K |
    | `slope_mw_per_ma`, `slope_k` | $\eta = \eta_0 (1 - T / T_1)$: $\eta_0$, $T_1$ | mW/mA, K |
    | `junction_v`, `series_ohm` | $V_0$, $R$ | V, ohm |
    | `thermal` | $Z$ | K/W |
    | `red_ghz_per_k` | $\sigma$ | GHz/K |
    | `blue_ghz_per_mw` | $\kappa$ | GHz/mW |
    | `lowest_ma`, `highest_ma` | what it withstands | mA |

    After K. Petermann, Laser Diode Modulation and Noise (1988), sections 2.2, 4.4 and 5.4, and T.
    L. Koch and R. A. Linke, Appl. Phys. Lett. 48, 613 (1986), for the chirp. Left out: the
    transient chirp $\propto d \ln P / dt$, below 0.1 MHz at 10^5 /s; hops of mode and polarisation.
    """

    threshold_ma: float
    threshold_k: float
    slope_mw_per_ma: float
    slope_k: float
    junction_v: float
    series_ohm: float
    thermal: ThermalImpedance
    red_ghz_per_k: float
    blue_ghz_per_mw: float
    lowest_ma: float
    highest_ma: float

    def power_mw(self, ma: np.ndarray, kelvin: np.ndarray) -> np.ndarray:
        """Light at a current and a temperature above the mount, mW; none below threshold."""
        threshold = self.threshold_ma * np.exp(kelvin / self.threshold_k)
        slope = self.slope_mw_per_ma * np.maximum(1.0 - kelvin / self.slope_k, 0.0)
        return slope * np.maximum(ma - threshold, 0.0)

    def heat_w(self, ma: np.ndarray, power_mw: np.ndarray) -> np.ndarray:
        """Heat, W: what goes in less what comes out as light."""
        amperes = 1e-3 * ma
        return (self.junction_v + self.series_ohm * amperes) * amperes - 1e-3 * power_mw

    def play(self, ma: np.ndarray, sample_hz: float) -> DiodeState:
        """The steady state over one period of a current that repeats for ever.

        The power depends on the temperature that it helps to make: both are iterated. A warmer
        junction gives less light and so more heat, up to all of what goes in: from a cold one the
        temperature only rises and is bounded, so this ends.
        Raises `ValueError` for a current outside `lowest_ma` to `highest_ma` (damage above,
        threshold below).
        """
        if ma.min() < self.lowest_ma or ma.max() > self.highest_ma:
            raise ValueError(
                f"The current runs from {ma.min():.4g} to {ma.max():.4g} mA, but this laser "
                f"withstands {self.lowest_ma:g} to {self.highest_ma:g} mA. Drive it by less."
            )
        before, kelvin = np.full_like(ma, -np.inf), np.zeros_like(ma)
        while np.abs(kelvin - before).max() > _EXACT_K:
            heat = self.heat_w(ma, self.power_mw(ma, kelvin))
            before, kelvin = kelvin, self.thermal.temperature(heat, sample_hz)
        power = self.power_mw(ma, kelvin)
        return DiodeState(kelvin, power, -self.red_ghz_per_k * kelvin, self.blue_ghz_per_mw * power)

    def tuning_ghz_per_ma(self, ma: float, hz: np.ndarray) -> np.ndarray:
        r"""Small-signal response $d\nu / di$ about a constant current, complex, GHz/mA.

        With $P_i, P_T$ the derivatives of the power: $T' = Z (Q_i - P_T T')$, so
        $T' = Z Q_i / (1 + Z P_T)$ and $\nu' = -\sigma T' + \kappa (P_i + P_T T')$.
        """
        kelvin = float(self.play(np.full(2, ma), 1.0).kelvin[0])
        threshold = self.threshold_ma * np.exp(kelvin / self.threshold_k)
        slope = self.slope_mw_per_ma * (1.0 - kelvin / self.slope_k)
        above = ma - threshold
        by_kelvin = -self.slope_mw_per_ma / self.slope_k * above  # mW/K
        by_kelvin -= slope * threshold / self.threshold_k
        heat = 1e-3 * (self.junction_v + 2e-3 * self.series_ohm * ma - slope)  # W/mA
        z = self.thermal.impedance(hz)
        warmer = z * heat / (1.0 + 1e-3 * z * by_kelvin)  # K/mA
        return -self.red_ghz_per_k * warmer + self.blue_ghz_per_mw * (slope + by_kelvin * warmer)
