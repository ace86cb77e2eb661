"""New Focus TLB-6700 controller with a TLB-6712 head."""

from hardware._driver import AbstractConnector, AbstractReadBack
from rapi_jax import LimitError

from . import _commands as commands
from ._base import AbstractLaser
from ._limits import LaserLimits
from ._link import AbstractLaserLink, VisaLaserLink
from ._port import LaserPort
from ._thresholds import THRESHOLDS
from ._tlb6700_table import Tlb6700Table
from ._vendor_dll import VendorDllLink

_SETTINGS = {
    "head": commands.MODEL, "remote": commands.CONTROL, "emits": commands.OUTPUT,
    "tracking": commands.TRACK, "wavelength_input": commands.WAVELENGTH_INPUT,
    "constant_power": commands.CONSTANT_POWER, "wavelength_set_nm": commands.WAVELENGTH,
    "piezo_set_percent": commands.PIEZO, "current_set_ma": commands.CURRENT,
    "scan_option": commands.SCAN_OPTION, "scans": commands.SCANS,
}  # fmt: skip
_SENSED = {
    "wavelength_nm": commands.SENSED_WAVELENGTH, "piezo_percent": commands.SENSED_PIEZO,
    "current_ma": commands.SENSED_CURRENT, "diode_c": commands.DIODE_TEMPERATURE,
    "cavity_c": commands.CAVITY_TEMPERATURE,
}  # fmt: skip
_SOMEBODY = "See who else operates the controller; open the bench again, which puts it in order."


class TLB6700(AbstractLaser, AbstractReadBack):
    """The controller, identified: remote, at rest, tracking off, without faults, not too warm.

    Every setting is answered, read back, and followed by a look at the fault queue. Raises
    `InstrumentError` for another controller or head, `LimitError` for a value beyond `limits`,
    and without `limits`. A context manager: at its end scan and tracking are stopped and the front
    panel works again. Emission is left as it is: switching ages the diode and lets it drift.

    >>> from hardware import TLB6700, LaserLimits, VisaLaserLink
    >>> from hardware.simulated import SimulatedLink, SimulatedTLB6700
    >>> limits = LaserLimits(
    ...     (765.0, 781.0), (0.0, 100.0), (30.0, 140.0), diode_c=(15.0, 30.0), cavity_c=(20.0, 40.0)
    ... )
    >>> with TLB6700(VisaLaserLink(SimulatedLink(SimulatedTLB6700())), limits=limits) as laser:
    ...     laser.set_piezo(40.0)
    ...     laser.head, laser.piezo()
    ('TLB-6712', 40.0)
    """

    kind = "tlb6700"
    Table = Tlb6700Table
    supports_dry_run = True

    @classmethod
    def open(cls, table: Tlb6700Table, connector: AbstractConnector) -> "TLB6700":
        """Connect and identify it."""
        limits = table.limits.of()
        if table.resource is None and not connector.dry_run:
            return cls(VendorDllLink(table.serial or ""), limits=limits)
        link = connector.connect(table.resource or "", backend=table.backend)
        token = "" if table.token is None else table.token.get_secret_value()
        return cls(VisaLaserLink(link, token=token), limits=limits)

    def __init__(self, link: AbstractLaserLink, *, limits: LaserLimits | None) -> None:
        """`limits`: from the head's data sheet."""
        if limits is None:
            raise LimitError(
                "The laser has no limits, so it is not touched. Give `limits`: wavelength, piezo, "
                "current and temperatures that its head withstands."
            )
        self.limits = limits
        self.resource = link.resource
        self._port = LaserPort(link)
        self._identity = self._port.identify()
        self.head = self._port.text(
            f"{commands.MODEL}?",
            commands.HEAD,
            "The laser head is another one than the limits are for.",
        )
        self._port.faults()  # of the past; what still holds is reported anew by `check`
        self._port.set(commands.CONTROL, "REM")
        self.stop_scan()
        self.track(False)
        if self._port.number(f"{commands.WAVELENGTH_INPUT}?") != 0:
            self._port.set(commands.WAVELENGTH_INPUT, "0", 0.0)
        self.check()

    @property
    def identity(self) -> str:
        """Its `*IDN?`."""
        return self._identity

    def check(self) -> None:
        """Refuse a fault (an open interlock, overheating) and temperatures out of limits."""
        self._port.check_status(commands.STATUS)
        for template, name in (
            (commands.DIODE_TEMPERATURE, "diode_c"),
            (commands.CAVITY_TEMPERATURE, "cavity_c"),
        ):
            value = self._port.number(template)
            low, high = getattr(self.limits, name)
            if not low <= value <= high:
                raise self._port.error(
                    template,
                    f"{value:g}",
                    f"The laser is at {value:g} C, and its limit `{name}` is {low:g} to {high:g}.",
                    "Wait until it has settled.",
                )

    def wavelength(self) -> float:
        """As sensed, nm."""
        return self._port.number(commands.SENSED_WAVELENGTH)

    def set_wavelength(self, nm: float, *, timeout_s: float = 60.0) -> float:
        """Move there with tracking on, wait until it is there, and switch tracking off.

        Gives the sensed wavelength, nm.
        """
        self.limits.check("wavelength_nm", nm)
        self._port.set(commands.WAVELENGTH, f"{nm:.2f}", nm, THRESHOLDS.wavelength_tolerance_nm)
        self.track(True)
        try:
            self._port.wait_until_done(timeout_s)
            there = self.wavelength()
        finally:
            self.track(False)
        if not abs(there - nm) <= THRESHOLDS.wavelength_error_nm:
            raise self._port.error(
                commands.SENSED_WAVELENGTH,
                f"{there:g}",
                f"The laser should be at {nm:g} nm.",
                "Let it settle and set it again; it may need calibration.",
            )
        return there

    def track(self, on: bool) -> None:
        """Follow the set wavelength by the motor; off while the piezo is driven."""
        self._port.set(commands.TRACK, str(int(on)), float(on), 0.0)

    def piezo(self) -> float:
        """As set, percent of the range."""
        return self._port.number(f"{commands.PIEZO}?")

    def set_piezo(self, percent: float) -> None:
        """Go there from where it is, a percent at a time: a piezo that jumps creeps."""
        self.limits.check("piezo_percent", percent)
        now, step = self.piezo(), THRESHOLDS.piezo_step_percent
        while abs(percent - now) > THRESHOLDS.piezo_rounding_percent:
            now += min(max(percent - now, -step), step)
            self._port.set(commands.PIEZO, f"{now:.2f}", now, THRESHOLDS.piezo_tolerance_percent)

    def current(self) -> float:
        """Of the diode as sensed, mA."""
        return self._port.number(commands.SENSED_CURRENT)

    def set_current(self, ma: float) -> None:
        """Of the diode, mA."""
        self.limits.check("current_ma", ma)
        self._port.set(commands.CURRENT, f"{ma:.1f}", ma, THRESHOLDS.current_tolerance_ma)

    def emits(self) -> bool:
        """Whether the diode is on."""
        return self._port.number(f"{commands.OUTPUT}?") == 1.0

    def check_emission(self) -> None:
        """Refuse a laser that is off: there would be no fringes."""
        if not self.emits():
            raise self._port.error(
                f"{commands.OUTPUT}?", "0", "The laser is off.", "Switch it on and let it settle."
            )

    def switch(self, on: bool) -> None:
        """Emission on or off; on only where `check` finds nothing. Waits until it has happened.

        The controller may be set to switch on up to 60 s late (`ONDELAY`).
        """
        if on:
            self.check()
        self._port.set(commands.OUTPUT, str(int(on)))
        seconds = THRESHOLDS.switch_s + on * THRESHOLDS.on_delay_s
        until = self._port.link.now() + seconds
        self._port.wait_until_done(seconds)
        while not (there := self.emits() == on) and self._port.link.now() < until:
            self._port.check_status(f"{commands.OUTPUT}?")
            self._port.link.sleep(THRESHOLDS.poll_s)
        if not there:
            raise self._port.error(
                f"{commands.OUTPUT}?",
                str(int(not on)),
                f"Emission was switched {'on' if on else 'off'}, but is still "
                f"{'off' if on else 'on'} after {seconds:g} s.",
                "Check the key switch and the interlock of the controller.",
            )

    def scan_wavelength(
        self, begin_nm: float, end_nm: float, *, nm_per_s: float, scans: int = 1
    ) -> None:
        """Start slow scans by the motor, back and forth at that speed; `stop_scan` ends them.

        `scans`: how many, 1 to 9999. Raises `InstrumentError` too where another scan is on, or a
        voltage at the rear sets the wavelength. Whether the laser is off while a scan returns is
        left as it is set (`SCANCFG`; `scan_option` in `snapshot`).
        """
        for nm in (begin_nm, end_nm):
            self.limits.check("wavelength_nm", nm)
        if not nm_per_s > 0:
            raise ValueError(f"Argument `nm_per_s` must be positive, but is {nm_per_s}.")
        if not 1 <= scans <= 9999:
            raise ValueError(f"Argument `scans` must be 1 to 9999, but is {scans}.")
        self.settings()
        near = THRESHOLDS.wavelength_tolerance_nm
        self._port.set(commands.SCAN_FROM, f"{begin_nm:.2f}", begin_nm, near)
        self._port.set(commands.SCAN_TO, f"{end_nm:.2f}", end_nm, near)
        self._port.set(commands.SPEED_UP, f"{nm_per_s:.2f}", nm_per_s, near)
        self._port.set(commands.SPEED_BACK, f"{nm_per_s:.2f}", nm_per_s, near)
        self._port.set(commands.SCANS, str(scans), float(scans), 0.0)
        self._port.set(commands.SCAN_RESET)
        self._port.set(commands.SCAN_BEGIN)

    def stop_scan(self) -> None:
        """End a scan where it is."""
        self._port.set(commands.SCAN_END)

    def snapshot(self) -> dict[str, str]:
        """Every setting and sensed value, as the controller reports it."""
        settings = {name: f"{query}?" for name, query in _SETTINGS.items()}
        return {"identity": self.identity} | self._port.texts(settings | _SENSED)

    def settings(self) -> dict[str, str]:
        """The settings among them.

        Raises `InstrumentError` where the motor moves, or something else than the drive sets the
        wavelength.
        """
        settings = self._port.texts({name: f"{query}?" for name, query in _SETTINGS.items()})
        for name, what in (
            ("tracking", "The motor follows the set wavelength, and would answer the piezo."),
            ("wavelength_input", "A voltage at the rear sets the wavelength."),
        ):
            if settings[name] not in ("0", "OFF"):
                raise self._port.error(f"{_SETTINGS[name]}?", settings[name], what, _SOMEBODY)
        if self._port.text(commands.DONE, r"[01]", "The answer must be 0 or 1.") != "1":
            raise self._port.error(commands.DONE, "0", "The motor moves: a scan is on.", _SOMEBODY)
        return settings

    def close(self) -> None:
        """Stop scan and tracking, return control to the front panel, and disconnect."""
        try:
            self.stop_scan()
            self.track(False)
            self._port.set(commands.CONTROL, "LOC")
        finally:
            self._port.link.close()
