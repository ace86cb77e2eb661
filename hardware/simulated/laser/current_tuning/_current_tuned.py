"""A laser diode behind its current driver, as a device of the simulated laboratory."""

import dataclasses

import numpy as np

from rapi_jax import AfgWaveform
from rapi_jax.internal import POINTS

from .._abstract_device import AbstractDevice
from .._drift import State
from .._dynamics import Amplifier
from .._scan import Scan
from ._diode import LaserDiode


@dataclasses.dataclass(frozen=True)
class CurrentDriver:
    """Volts at the modulation input to current: `offset_ma + ma_per_v u`, behind a low-pass.

    - `bandwidth_hz`: -3 dB, Hz.
    """

    offset_ma: float
    ma_per_v: float
    bandwidth_hz: float

    def __call__(self, volts: np.ndarray, sample_hz: float) -> np.ndarray:
        """The current over one period, mA."""
        low_pass = Amplifier(self.ma_per_v, self.offset_ma, self.bandwidth_hz)
        return low_pass(volts, sample_hz)


@dataclasses.dataclass(frozen=True, eq=False)
class CurrentTunedLaser(AbstractDevice):
    """Volts of a generator to optical frequency and power of a laser diode, in the steady state.

    The optical frequency falls as the current rises. Its origin is that at the middle of the
    period's currents, held constant. Drift moves the origin, the gain, and (as `memory`) the
    thermal part alone. `wavelength_m`: in vacuum, at currents near the middle.
    """

    diode: LaserDiode
    driver: CurrentDriver
    wavelength_m: float
    amplifier: Amplifier = Amplifier()

    @property
    def repeats(self) -> bool:
        """It does: all of its lags are in their periodic state."""
        return True

    def scan(self, waveform: AfgWaveform, *, periods: int, start_s: float, state: State) -> Scan:
        """One period of frequency and power; see `AbstractDevice.scan`."""
        del periods, start_s
        rate = waveform.frequency_hz
        finer = max(1, -(-POINTS // waveform.codes.size))
        sample_hz = rate * waveform.codes.size * finer
        ma = self.driver(self.amplifier(np.repeat(waveform.volts, finer), sample_hz), sample_hz)
        light = self.diode.play(ma, sample_hz)
        middle = np.full(2, (ma.min() + ma.max()) / 2.0)
        rest = self.diode.play(middle, sample_hz)
        nu = state.response(
            light.thermal_ghz - rest.thermal_ghz[0], light.carrier_ghz - rest.carrier_ghz[0]
        )
        return Scan(nu, rate, 1, False, power=light.power_mw / rest.power_mw[0])

    def provenance(self) -> dict[str, str]:
        """Diode, driver, amplifier."""
        return {
            "device": type(self).__name__,
            "diode": repr(self.diode),
            "driver": repr(self.driver),
            "amplifier": repr(self.amplifier),
        }
