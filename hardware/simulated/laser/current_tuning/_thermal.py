"""Heat flow from a laser's junction to its mount, as a sum of first-order lags."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class ThermalImpedance:
    r"""Temperature over dissipated power, $Z(s) = \sum_k R_k / (1 + \tau_k s)$ (Foster network).

    - `resistances_k_per_w`: $R_k$, K/W. `time_constants_s`: $\tau_k$, s; as many.

    Heat that diffuses from a thin layer into a thick body gives $Z \propto 1 / \sqrt{s}$, and a
    laser's body (active layer, chip, submount) is several such layers in a row. A few lags a decade
    or two apart follow that; A. Hangauer et al., IEEE J. Sel. Top. Quantum Electron. 17, 1584
    (2011), call it the "N time constants model" and find $1 / \sqrt{i f}$ up to some MHz on VCSELs
    from 763 to 2300 nm; H. Shalom et al., IEEE J. Quantum Electron. 34, 1816 (1998), measure
    several time constants on DFB lasers.

    Raises `ValueError` where the two differ in number or one is not positive.
    """

    resistances_k_per_w: tuple[float, ...]
    time_constants_s: tuple[float, ...]

    def __post_init__(self) -> None:
        every = (*self.resistances_k_per_w, *self.time_constants_s)
        if len(self.resistances_k_per_w) != len(self.time_constants_s) or not all(
            np.isfinite(x) and x > 0 for x in every
        ):
            raise ValueError(
                f"Thermal resistances and time constants are positive and come in pairs: {self}."
            )

    @property
    def static_k_per_w(self) -> float:
        """Resistance to heat that flows for ever, K/W."""
        return float(sum(self.resistances_k_per_w))

    def impedance(self, hz: np.ndarray) -> np.ndarray:
        """Z at frequencies, K/W, complex."""
        s = 2j * np.pi * np.asarray(hz, dtype=float)
        return sum(
            (r / (1.0 + tau * s) for r, tau in self._lags()),
            start=np.zeros(s.shape, dtype=complex),
        )

    def step(self, time: np.ndarray) -> np.ndarray:
        """Temperature at times (s) after 1 W was switched on at 0, K/W."""
        time = np.asarray(time, dtype=float)
        return sum(
            (-r * np.expm1(-np.maximum(time, 0.0) / tau) for r, tau in self._lags()),
            start=np.zeros(time.shape),
        )

    def temperature(self, watts: np.ndarray, sample_hz: float) -> np.ndarray:
        """Temperature above the mount over one period of a power that repeats for ever, K.

        The power is constant for a sampling interval, the temperature that in the interval's
        middle: exact for every lag, long or short, and without ringing at a jump.
        """
        before = np.exp(-2j * np.pi * np.fft.rfftfreq(watts.size))  # an interval earlier
        response = np.zeros(before.size, dtype=complex)
        for resistance, tau in self._lags():
            half = np.exp(-0.5 / (sample_hz * tau))  # what is left after half an interval
            end = -np.expm1(-1.0 / (sample_hz * tau)) / (1.0 - half**2 * before)
            response += resistance * (1.0 - half + half * before * end)
        return np.fft.irfft(np.fft.rfft(watts) * response, watts.size)

    def _lags(self) -> list[tuple[float, float]]:
        return list(zip(self.resistances_k_per_w, self.time_constants_s, strict=True))
