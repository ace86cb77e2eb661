"""What a laser driver is to a bench: checked before each run, and described in the recording."""

import abc

from hardware._driver import AbstractDriver, AbstractDriverTable


class AbstractLaserTable(AbstractDriverTable):
    """The table of a laser; what it may be set to is its driver's.

    >>> from hardware import AbstractLaserTable
    >>> class OwnTable(AbstractLaserTable):
    ...     current_ma: float
    ...
    ...     @property
    ...     def resources(self):
    ...         return ()
    >>> OwnTable(kind="by-hand", current_ma=80.0).current_ma
    80.0
    """


class AbstractLaser(AbstractDriver):
    """A laser with its controller; `Table` derives from `AbstractLaserTable`.

    >>> from hardware import TLB6700, AbstractLaser, LaserLimits, VisaLaserLink
    >>> from hardware.simulated import SimulatedLink, SimulatedTLB6700
    >>> limits = LaserLimits(
    ...     (765.0, 781.0), (0.0, 100.0), (30.0, 140.0), diode_c=(15.0, 30.0), cavity_c=(20.0, 40.0)
    ... )
    >>> link = VisaLaserLink(SimulatedLink(SimulatedTLB6700(emits=True)))
    >>> laser: AbstractLaser = TLB6700(link, limits=limits)
    >>> laser.check()
    >>> laser.check_emission()
    >>> laser.close()
    """

    @abc.abstractmethod
    def check(self) -> None:
        """Raise `InstrumentError` for a fault, an open interlock or a temperature out of limits."""

    @abc.abstractmethod
    def check_emission(self) -> None:
        """Raise `InstrumentError` where the laser is off: there would be no fringes."""

    @abc.abstractmethod
    def snapshot(self) -> dict[str, str]:
        """Every setting and sensed value, as the controller reports it."""
