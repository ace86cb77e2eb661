"""New Focus TLB-6700 controller with a TLB-6712 head."""

import re
from typing import Annotated

import pydantic
from pydantic import Field

from hardware._driver import AbstractConnector, AbstractReadBack, Address, Backend, Table
from hardware._errors import InstrumentError
from hardware.links import _reply
from rapi_jax import LimitError

from . import _commands as commands
from ._base import AbstractLaser, AbstractLaserTable
from ._limits import LaserLimits
from ._link import AbstractLaserLink, VisaLaserLink
from ._thresholds import THRESHOLDS
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


_Finite = Annotated[float, Field(allow_inf_nan=False)]
Listed = Annotated[tuple[_Finite, _Finite], Field(strict=False)]  # a list in TOML


Token = Annotated[pydantic.SecretStr, Field(min_length=16, max_length=200, strict=False)]


class LaserRanges(Table):
    """See `LaserLimits`."""

    wavelength_nm: Listed
    piezo_percent: Listed
    current_ma: Listed
    diode_c: Listed
    cavity_c: Listed

    def of(self) -> LaserLimits:
        """As settings are checked against."""
        return LaserLimits(**self.model_dump())


class Tlb6700Table(AbstractLaserTable):
    """The TLB-6700: behind a `resource` (a bridge), or with the vendor's library by `serial`."""

    resource: Address | None = None
    serial: Address | None = None
    backend: Backend = "@py"
    token: Token | None = None  # of a bridge that asks for one; shown in no recording
    limits: LaserRanges

    @pydantic.model_validator(mode="after")
    def _one_way(self) -> "Tlb6700Table":
        if (self.resource is None) == (self.serial is None):
            raise ValueError("give either `resource` or `serial`")
        if self.serial is not None:
            commands.serial_number(self.serial)
        return self

    @property
    def resources(self) -> tuple[str, ...]:
        """Its address or serial number."""
        return (self.resource or commands.serial_number(self.serial or ""),)


class TLB6700(AbstractLaser, AbstractReadBack):
    """The controller, identified: remote, at rest, tracking off, without faults, not too warm.

    Every setting is answered, read back, and followed by a look at the fault queue. Raises
    `InstrumentError` for another controller or head, `LimitError` for a value beyond `limits`;
    none given is refused. A context manager: at its end scan and tracking are stopped and the front
    panel works again. Emission is left as it is: switching ages the diode and lets it drift.
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
                "current and temperatures that its head stands."
            )
        self.limits = limits
        self.resource = link.resource
        self._link = link
        self._identity = self._identify()
        self.head = self._query_text(
            f"{commands.MODEL}?",
            commands.HEAD,
            "The laser head is another one than the limits are for.",
        )
        self._faults()  # of the past; what still holds is reported anew by `check`
        self._set(commands.CONTROL, "REM")
        self.stop_scan()
        self.track(False)
        if self._query_number(f"{commands.WAVELENGTH_INPUT}?") != 0:
            self._set(commands.WAVELENGTH_INPUT, "0", 0.0)
        self.check()

    @property
    def identity(self) -> str:
        """Its `*IDN?`."""
        return self._identity

    def check(self) -> None:
        """Refuse a fault (an open interlock, overheating) and temperatures out of limits."""
        self._check_status(commands.STATUS)
        for template, name in (
            (commands.DIODE_TEMPERATURE, "diode_c"),
            (commands.CAVITY_TEMPERATURE, "cavity_c"),
        ):
            value = self._query_number(template)
            low, high = getattr(self.limits, name)
            if not low <= value <= high:
                raise self._error(
                    template,
                    f"{value:g}",
                    f"The laser is at {value:g} C, and its limit `{name}` is {low:g} to {high:g}.",
                    "Wait until it has settled.",
                )

    def wavelength(self) -> float:
        """As sensed, nm."""
        return self._query_number(commands.SENSED_WAVELENGTH)

    def set_wavelength(self, nm: float, *, timeout_s: float = 60.0) -> float:
        """Move there with tracking on, wait until it is there, and switch tracking off.

        Gives the sensed wavelength, nm.
        """
        self.limits.check("wavelength_nm", nm)
        self._set(commands.WAVELENGTH, f"{nm:.2f}", nm, THRESHOLDS.wavelength_tolerance_nm)
        self.track(True)
        try:
            self._wait_until_done(timeout_s)
            there = self.wavelength()
        finally:
            self.track(False)
        if not abs(there - nm) <= THRESHOLDS.wavelength_error_nm:
            raise self._error(
                commands.SENSED_WAVELENGTH,
                f"{there:g}",
                f"The laser should be at {nm:g} nm.",
                "Let it settle and set it again; it may need calibration.",
            )
        return there

    def track(self, on: bool) -> None:
        """Follow the set wavelength by the motor; off while the piezo is driven."""
        self._set(commands.TRACK, str(int(on)), float(on), 0.0)

    def piezo(self) -> float:
        """As set, percent of the range."""
        return self._query_number(f"{commands.PIEZO}?")

    def set_piezo(self, percent: float) -> None:
        """Go there from where it is, a percent at a time: a piezo that jumps creeps."""
        self.limits.check("piezo_percent", percent)
        now, step = self.piezo(), THRESHOLDS.piezo_step_percent
        while abs(percent - now) > THRESHOLDS.piezo_rounding_percent:
            now += min(max(percent - now, -step), step)
            self._set(commands.PIEZO, f"{now:.2f}", now, THRESHOLDS.piezo_tolerance_percent)

    def current(self) -> float:
        """Of the diode as sensed, mA."""
        return self._query_number(commands.SENSED_CURRENT)

    def set_current(self, ma: float) -> None:
        """Of the diode, mA."""
        self.limits.check("current_ma", ma)
        self._set(commands.CURRENT, f"{ma:.1f}", ma, THRESHOLDS.current_tolerance_ma)

    def emits(self) -> bool:
        """Whether the diode is on."""
        return self._query_number(f"{commands.OUTPUT}?") == 1.0

    def check_emission(self) -> None:
        """Refuse a laser that is off: there would be no fringes."""
        if not self.emits():
            raise self._error(
                f"{commands.OUTPUT}?", "0", "The laser is off.", "Switch it on and let it settle."
            )

    def switch(self, on: bool) -> None:
        """Emission on or off; on only where `check` finds nothing. Waits until it has happened.

        The controller may be set to switch on up to 60 s late (`ONDELAY`).
        """
        if on:
            self.check()
        self._set(commands.OUTPUT, str(int(on)))
        seconds = THRESHOLDS.switch_s + on * THRESHOLDS.on_delay_s
        until = self._link.now() + seconds
        self._wait_until_done(seconds)
        while not (there := self.emits() == on) and self._link.now() < until:
            self._check_status(f"{commands.OUTPUT}?")
            self._link.sleep(THRESHOLDS.poll_s)
        if not there:
            raise self._error(
                f"{commands.OUTPUT}?",
                str(int(not on)),
                "It was told otherwise.",
                "Look at its key.",
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
        self._set(commands.SCAN_FROM, f"{begin_nm:.2f}", begin_nm, near)
        self._set(commands.SCAN_TO, f"{end_nm:.2f}", end_nm, near)
        self._set(commands.SPEED_UP, f"{nm_per_s:.2f}", nm_per_s, near)
        self._set(commands.SPEED_BACK, f"{nm_per_s:.2f}", nm_per_s, near)
        self._set(commands.SCANS, str(scans), float(scans), 0.0)
        self._set(commands.SCAN_RESET)
        self._set(commands.SCAN_BEGIN)

    def stop_scan(self) -> None:
        """End a scan where it is."""
        self._set(commands.SCAN_END)

    def snapshot(self) -> dict[str, str]:
        """Every setting and sensed value, as the controller reports it."""
        settings = {name: f"{query}?" for name, query in _SETTINGS.items()}
        return {"identity": self.identity} | self._texts(settings | _SENSED)

    def settings(self) -> dict[str, str]:
        """The settings among them.

        Raises `InstrumentError` where the motor moves, or something else than the drive sets the
        wavelength.
        """
        settings = self._texts({name: f"{query}?" for name, query in _SETTINGS.items()})
        for name, what in (
            ("tracking", "The motor follows the set wavelength, and would answer the piezo."),
            ("wavelength_input", "A voltage at the rear sets the wavelength."),
        ):
            if settings[name] not in ("0", "OFF"):
                raise self._error(f"{_SETTINGS[name]}?", settings[name], what, _SOMEBODY)
        if self._query_text(commands.DONE, r"[01]", "This is no answer to it.") != "1":
            raise self._error(commands.DONE, "0", "The motor moves: a scan is on.", _SOMEBODY)
        return settings

    def close(self) -> None:
        """Stop scan and tracking, return control to the front panel, and disconnect."""
        try:
            self.stop_scan()
            self.track(False)
            self._set(commands.CONTROL, "LOC")
        finally:
            self._link.close()

    def _set(
        self,
        template: str,
        value: str = "",
        expected: float | None = None,
        tolerance: float = 0.0,
    ) -> None:
        """Send, see `OK` and no fault, and read back where a number is `expected`."""
        command = f"{template} {value}".rstrip()
        reply = self._link.query(command)
        if reply != "OK":
            faults = self._faults()
            raise self._error(
                command, "; ".join([reply, *map(_format_fault, faults)]), *_remedy(faults)
            )
        self._check_status(command)
        if expected is not None:
            read = self._query_number(f"{template}?")
            if not abs(read - expected) <= tolerance:
                raise self._error(
                    command,
                    f"{read:g}",
                    "The controller has another setting than the one it was given.",
                    "See whether someone else operates it.",
                )

    def _check_status(self, command: str) -> None:
        """Raise where a fault waits."""
        status = self._query_text(commands.STATUS, r"\+?\d{1,3}", "This is no status.")
        if int(status):
            faults = self._faults()
            listed = "; ".join(map(_format_fault, faults)) or f"{commands.STATUS} {status}"
            raise self._error(command, listed, *_remedy(faults))

    def _faults(self) -> list[tuple[int, str]]:
        found = []
        for _ in range(THRESHOLDS.most_faults):
            line = self._link.query(commands.ERROR)
            try:
                entry = commands.fault(line)
            except ValueError as error:
                raise self._error(
                    commands.ERROR, line, f"The answer cannot be used: {error}.", "Look at it."
                ) from None
            if entry[0] == 0:
                return found
            found.append(entry)
        raise self._error(
            commands.ERROR, "", "The fault queue does not end.", "Restart the controller."
        )

    def _wait_until_done(self, seconds: float) -> None:
        until = self._link.now() + seconds
        while self._query_text(commands.DONE, r"[01]", "This is no answer to it.") != "1":
            self._check_status(commands.DONE)
            if self._link.now() >= until:
                raise self._error(
                    commands.DONE, "0", f"It is still moving after {seconds:g} s.", "Wait longer."
                )
            self._link.sleep(THRESHOLDS.poll_s)
        self._check_status(commands.DONE)

    def _identify(self) -> str:
        """The identity; asked for again where a part of one comes."""
        for _ in range(THRESHOLDS.identity_tries - 1):
            line = self._link.query("*IDN?").strip()
            if re.fullmatch(commands.IDENTITY, line, re.IGNORECASE):
                return line
            if not commands.is_stray(line):
                break
        return self._query_text("*IDN?", commands.IDENTITY, "This is another instrument.")

    def _query_number(self, query: str) -> float:
        line = self._link.query(query)
        try:
            return _reply.number(line.strip())
        except ValueError as error:
            raise self._error(
                query, line, f"The answer cannot be used: {error}.", "Ask again."
            ) from None

    def _texts(self, queries: dict[str, str]) -> dict[str, str]:
        return {name: self._query_text(query, r".+", "") for name, query in queries.items()}

    def _query_text(self, query: str, pattern: str, why: str) -> str:
        line = self._link.query(query).strip()
        if not re.fullmatch(pattern, line, re.IGNORECASE):
            raise self._error(query, line, why, "Check the address and the head. Nothing was set.")
        return line

    def _error(self, command: str, reply: str, why: str, cure: str) -> InstrumentError:
        return InstrumentError(self.resource, command, reply, why=why, cure=cure)


def _format_fault(fault: tuple[int, str]) -> str:
    return f'{fault[0]},"{fault[1]}"'


def _remedy(faults: list[tuple[int, str]]) -> tuple[str, str]:
    cures = [commands.CURES[code] for code, _ in faults if code in commands.CURES]
    return (
        "The controller refuses the command, or reports a fault.",
        " ".join(cures) or "Check the value against the head's range.",
    )
