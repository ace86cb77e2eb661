"""What a laboratory needs of a laser with what drives it."""

import abc

from rapi_jax import AfgWaveform

from ._drift import State
from ._dynamics import Amplifier
from ._scan import Scan


class AbstractDevice(abc.ABC):
    """Volts of a generator to optical frequency, in the steady state of a drive that repeats.

    `amplifier`: between the generator and the input for which a bench's limits hold.
    """

    amplifier: Amplifier

    @property
    @abc.abstractmethod
    def repeats(self) -> bool:
        """Whether one period of its frequency is as the next, so that `scan` gives one."""

    @abc.abstractmethod
    def scan(self, waveform: AfgWaveform, *, periods: int, start_s: float, state: State) -> Scan:
        """The frequency while `waveform` plays, `periods` of it from session time `start_s` on.

        `state`: where the device has drifted.
        """

    @abc.abstractmethod
    def provenance(self) -> dict[str, str]:
        """What it is, for a recording's notes: `device` and its parts."""
