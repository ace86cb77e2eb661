"""NI digitizers (PXIe-5105 and its kin) through the package `niscope` and the vendor's runtime.

Only on computers where NI-SCOPE's runtime is installed; commands after its reference.
"""

import math
from typing import Any

import numpy as np
from pydantic import Field

from hardware._driver import AbstractConnector, AbstractReadBack, Address
from hardware._errors import InstrumentError
from hardware.links._scpi import Scpi
from rapi_jax.io import printable

from ._base import AbstractDigitizer, AbstractDigitizerTable, Acquisition, Samples
from ._infiniivision import InfiniiVision
from ._thresholds import THRESHOLDS

TRIGGER = "VAL_PFI_1"
_CURE = (
    "Install NI-SCOPE's runtime and `rapi-jax[lab]`, check the device's name in NI MAX, and that "
    "no other program holds it."
)
_ASK_LESS = "Ask for ranges, a rate and a trigger that the device has."
_NO_TRIGGER = (
    "Connect the generator's trigger output to the trigger input, and see that the generator plays."
)


class NiScopeTable(AbstractDigitizerTable):
    """An NI digitizer; see `NiScope`."""

    resource: Address
    trigger: Address = TRIGGER
    level_v: float | None = Field(default=None, allow_inf_nan=False)

    @property
    def resources(self) -> tuple[str, ...]:
        """Its name."""
        return (self.resource,)


class NiScope(AbstractDigitizer, AbstractReadBack):
    """One NI digitizer, by its name in NI MAX such as `PXI1Slot2`; a context manager.

    `trigger`: where the generator's trigger output is connected, by NI's name. `level_v`: of an
    analogue trigger; `None` for a digital one, such as a PFI line.

    >>> from hardware import NiScope
    >>> arm = {"connector": 0, "low_v": -0.2, "high_v": 1.2}
    >>> table = NiScope.Table(kind="niscope", resource="PXI1Slot2", interferometer=arm)
    >>> table.trigger, table.resources  # `NiScope.open(table, ...)` needs NI's runtime
    ('VAL_PFI_1', ('PXI1Slot2',))
    """

    kind = "niscope"
    Table = NiScopeTable
    supports_dry_run = True

    @classmethod
    def open(cls, table: NiScopeTable, connector: AbstractConnector) -> AbstractDigitizer:
        """Open it; in a dry run the simulated oscilloscope in its place."""
        if connector.dry_run:
            return InfiniiVision(Scpi(connector.connect(table.resource)))
        return cls(table.resource, trigger=table.trigger, level_v=table.level_v)

    def __init__(
        self, resource: str, *, trigger: str = TRIGGER, level_v: float | None = None
    ) -> None:
        """Raises `InstrumentError` where the runtime or the device is missing."""
        self.resource = resource
        self._resource, self._trigger, self._level_v = resource, trigger, level_v
        try:
            import niscope
        except ImportError as error:
            raise self._error("import niscope", error) from error
        self._ni = niscope
        self._session: Any = None
        self._session = self._call("Session", niscope.Session, resource)
        self._identity = ",".join(
            str(self._call(name, getattr, self._session, name))
            for name in ("instrument_manufacturer", "instrument_model", "serial_number")
        )
        self._asked: Acquisition | None = None

    @property
    def identity(self) -> str:
        """Manufacturer, model and serial number."""
        return printable(self._identity)

    def configure(self, asked: Acquisition) -> None:
        """Inputs, time base and trigger."""
        ni, session = self._ni, self._session
        self._call("abort", session.abort)
        for one in asked.inputs.values():
            channel = session.channels[str(one.connector)]
            self._call(
                "configure_vertical",
                channel.configure_vertical,
                range=one.high_v - one.low_v,
                coupling=ni.VerticalCoupling.DC,
                offset=(one.high_v + one.low_v) / 2,
            )
        before = 100.0 * asked.before_s * THRESHOLDS.before_reserve  # percent of what is recorded
        span = asked.before_s + asked.after_s
        count = math.ceil(span * asked.sample_hz * THRESHOLDS.span_reserve) + 2
        self._call(
            "configure_horizontal_timing",
            session.configure_horizontal_timing,
            min_sample_rate=asked.sample_hz,
            min_num_pts=count,
            ref_position=before / (span * THRESHOLDS.span_reserve),
            num_records=1,
            enforce_realtime=True,
        )
        if self._level_v is None:
            self._call(
                "configure_trigger_digital",
                session.configure_trigger_digital,
                self._trigger,
                slope=ni.TriggerSlope.POSITIVE,
            )
        else:
            self._call(
                "configure_trigger_edge",
                session.configure_trigger_edge,
                self._trigger,
                self._level_v,
                ni.TriggerCoupling.DC,
                slope=ni.TriggerSlope.POSITIVE,
            )
        self._call("commit", session.commit)
        self._asked = asked

    def arm(self) -> None:
        """One record, at the next trigger."""
        self._configured()
        self._call("abort", self._session.abort)
        self._call("initiate", self._session.initiate)

    def fetch(self, timeout_s: float) -> Samples:
        """The record, when it has come."""
        asked = self._configured()
        count = int(self._call("horz_record_length", getattr, self._session, "horz_record_length"))
        codes, scale, zero, ends = {}, {}, {}, []
        for name, one in asked.inputs.items():
            column = np.zeros(count, dtype=np.int16)
            channel = self._session.channels[str(one.connector)]
            (about,) = self._call("fetch_into", channel.fetch_into, column, timeout=timeout_s)
            codes[name], scale[name], zero[name] = column, float(about.gain), float(about.offset)
            ends.append((float(about.relative_initial_x), float(about.x_increment)))
        start_s, step_s = ends[0]
        if not (step_s > 0 and all(np.isfinite([*scale.values(), *zero.values(), start_s]))):
            raise InstrumentError(
                self._resource,
                "fetch_into",
                str(ends[0]),
                why="The record's description has no step in time, or values that are not finite.",
                cure="Arm it again.",
            )
        return Samples(codes, scale, zero, 1 / step_s, start_s)

    def snapshot(self) -> dict[str, str]:
        """Rate, length, trigger, and each input."""
        settings = {"identity": self.identity, "trigger_source": self._trigger}
        for name in ("horz_sample_rate", "horz_record_length"):
            settings[name] = str(self._call(name, getattr, self._session, name))
        for one in self._configured().inputs.values():
            channel = self._session.channels[str(one.connector)]
            for name in ("vertical_range", "vertical_offset"):
                settings[f"{one.connector}_{name}"] = str(self._call(name, getattr, channel, name))
        return settings

    def settings(self) -> dict[str, str]:
        """As `snapshot`."""
        return self.snapshot()

    def close(self) -> None:
        """Stop waiting, and release the device."""
        if self._session is not None:
            session, self._session = self._session, None
            try:
                session.abort()
            finally:
                session.close()

    def _call(self, name: str, call: Any, *arguments: Any, **named: Any) -> Any:
        """The result of a vendor's call; its own errors become an `InstrumentError`."""
        try:
            return call(*arguments, **named)
        except self._ni.Error as error:
            raise self._error(name, error) from error

    def _error(self, name: str, error: Exception) -> InstrumentError:
        why = f"NI-SCOPE says: {printable(error, 160)}."
        cure = _NO_TRIGGER if name == "fetch_into" else _CURE
        cure = _ASK_LESS if name.startswith(("configure", "commit")) else cure
        return InstrumentError(self._resource, name, "", why=why, cure=cure)

    def _configured(self) -> Acquisition:
        if self._asked is None:
            raise ValueError("The digitizer is not set up: call `configure` first.")
        return self._asked
