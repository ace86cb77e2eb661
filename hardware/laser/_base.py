"""What a laser driver is to a bench: checked before each run, and described in the recording."""

import abc

from hardware._driver import AbstractDriver, AbstractDriverTable


class AbstractLaserTable(AbstractDriverTable):
    """The table of a laser; what it may be set to is its driver's."""


class AbstractLaser(AbstractDriver):
    """A laser with its controller; `Table` derives from `AbstractLaserTable`."""

    @abc.abstractmethod
    def check(self) -> None:
        """Raise `InstrumentError` for a fault, an open interlock or a temperature out of limits."""

    @abc.abstractmethod
    def check_emission(self) -> None:
        """Raise `InstrumentError` where the laser is off: there would be no fringes."""

    @abc.abstractmethod
    def snapshot(self) -> dict[str, str]:
        """Every setting and sensed value, as the controller reports it."""
