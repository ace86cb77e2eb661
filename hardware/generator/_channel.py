"""One output of the generator: within limits while it is on, parked and off at the end."""

import math
from collections.abc import Collection, Mapping

import numpy as np

from hardware._driver import AbstractReadBack
from hardware._errors import InstrumentError
from hardware.bench._exits import register_exit_action, unregister_exit_action
from rapi_jax import AfgWaveform, Drive, DriveLimits, LimitError
from rapi_jax.internal import FULL, POINTS, codes_of, period_volts

from . import _commands as commands
from ._base import AbstractOutput, AbstractWatchdog
from ._burst import Burst, checked_cycles
from ._check import check_codes, check_period
from ._levels import Levels, enclosing_levels, park_levels, settable_limits
from ._port import AfgPort
from ._ramp import move_clamp, ramp, ramp_to_park
from ._restore import leave_sequence_mode, require_states
from ._settings import (
    check_numbers,
    check_states,
    due_levels,
    due_limits,
    due_states,
    due_waveform,
    read_settings,
)
from ._states import BURST, CONTINUOUS, COUPLINGS, State


class AfgChannel(AbstractOutput, AbstractReadBack, AbstractWatchdog):
    """One output: `load` a period while it is off, `start` it, and it is parked and off at the end.

    - `limits`: as given, narrowed to what the instrument can set. Every check is against these.
    - `on`: whether the output may be on. `loaded`: what will be played, `None` at first.
    - `undone`: settings that another user had left, and that were brought into order.
    - `found_on`: what an output that was found on played, before it was parked; else empty.

    >>> from hardware import AFG31000, DriveLimits, Scpi
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> from rapi_jax import triangle
    >>> limits = DriveLimits(0.0, 7.5, slew_v_per_s=2000.0, step_v=0.1, max_frequency_hz=100.0)
    >>> (drive,) = triangle([20.0], amplitude=4.5, bias=3.0)
    >>> with AFG31000(Scpi(SimulatedLink(SimulatedAFG31052()))) as generator:
    ...     output = generator.channel(1, limits=limits, park_v=1.0)
    ...     wave = output.load_drive(drive, points=4096)
    ...     same = bool((output.read_back() == wave.codes).all())
    >>> same, output.on
    (True, False)
    """

    most_cycles = commands.MOST_CYCLES

    def __init__(
        self,
        port: AfgPort,
        limits: DriveLimits | None,
        load_ohm: float,
        park_v: float,
        trigger: Collection[State] = (),
    ) -> None:
        """`trigger`: states of the instrument as a whole; compared from `start` on."""
        if limits is None:
            raise LimitError(
                f"Channel {port.n} has no limits, so its output stays off. Give `limits`: lowest "
                "and highest voltage, slew, step and rate that the device behind it withstands."
            )
        if not load_ohm > 0 or not math.isfinite(park_v):
            raise ValueError("`load_ohm` must be positive, and `park_v` a number of volts.")
        self.limits = settable_limits(limits, commands.LARGEST_V * commands.load_ratio(load_ohm))
        self.load_ohm = load_ohm
        self.on = False
        self.loaded: AfgWaveform | None = None
        self.undone: tuple[str, ...] = ()
        self.found_on = ""
        self.resource = port.scpi.resource
        self._port = port
        self._trigger = trigger
        self._burst: Burst | None = None
        self._park = park_levels(park_v, self.limits)

    def prepare(self) -> None:
        """Off, continuous, load, clamp: each verified. An output that was left on is parked first.

        Channels are decoupled before anything is moved: the other one is somebody else's. Raises
        `InstrumentError` where sequence mode plays on the other channel.
        """
        port = self._port
        self.undone = leave_sequence_mode(port) + require_states(port, COUPLINGS)
        self.on = port.output()
        if self.on:
            levels, hertz = port.levels(), port.frequency()
            self.found_on = f"{levels.low_v:g} to {levels.high_v:g} V at {hertz:g} Hz"
        self.off()
        port.switch(False)
        self.undone += require_states(port, CONTINUOUS)
        port.set_load(self.load_ohm)
        move_clamp(port, self.limits, self._park)

    def set_watchdog(self, cycles: int | None) -> None:
        """Play so many periods after `start`, then rest; `None`: play on. Load a drive after it."""
        if self.on:
            raise ValueError(f"The output of channel {self._port.n} is on: call `off` first.")
        checked = checked_cycles(cycles)
        self._burst = None if checked is None else Burst(self._port, checked)
        self.loaded = None

    def playing_s(self) -> float:
        """How much longer the drive certainly plays, s; infinite without a watchdog."""
        if self._burst is None:
            return math.inf
        return self._burst.playing_s(self._loaded().frequency_hz)

    def load_drive(self, drive: Drive, *, points: int = POINTS) -> AfgWaveform:
        """One period of `drive`, resampled to `points`; see `load`."""
        self.limits.check(drive)
        return self.load(period_volts(drive, points), drive.rate)

    def load(self, volts: np.ndarray, frequency_hz: float) -> AfgWaveform:
        """Upload one period, 2 to 131072 values (V) held for equal times; the output is off.

        Gives what will be played: codes computed from the levels that the instrument reports.
        Raises `LimitError` or `DataError`, with nothing sent, where a value, slope, step or the
        step that closes the period is out of limits.
        """
        return self._load(check_period(volts, frequency_hz, self.limits), frequency_hz)

    def load_waveform(self, wave: AfgWaveform) -> AfgWaveform:
        """Upload a waveform that is in codes already, from a file; see `load`.

        Its codes stand for a drive within half a code of each, and that drive must keep `limits`.
        """
        return self._load(check_codes(wave, self.limits), wave.frequency_hz)

    def _load(self, volts: np.ndarray, frequency_hz: float) -> AfgWaveform:
        if self.on:
            raise ValueError(f"The output of channel {self._port.n} is on: call `off` first.")
        port, self.loaded = self._port, None
        trigger = () if self._burst else self._trigger
        self.undone += require_states(port, (*COUPLINGS, *CONTINUOUS, *trigger))
        port.set_frequency(frequency_hz)
        wanted = enclosing_levels(float(volts.min()), float(volts.max()), self.limits)
        levels = port.set_levels(port.levels(), wanted)
        half = levels.pp / FULL / 2
        if volts.min() < levels.low_v - half or volts.max() > levels.high_v + half:
            raise InstrumentError(
                port.scpi.resource,
                f"levels {wanted.low_v:g} V to {wanted.high_v:g} V",
                f"{levels.low_v:g} V to {levels.high_v:g} V",
                why="The instrument rounds its levels inward, so the drive does not fit between.",
                cure="Scan a little less. The output was not switched on.",
            )
        wave = AfgWaveform(
            codes_of(volts, levels.low_v, levels.high_v), levels.low_v, levels.high_v, frequency_hz
        )
        port.upload(wave.codes)
        port.select()
        port.set_levels(levels, self._park)
        self.loaded = wave
        return wave

    def read_back(self) -> np.ndarray:
        """The codes in the instrument's memory, as many as were loaded."""
        return self._port.read_back(self._loaded().codes.size)

    def start(self) -> None:
        """Check every setting again, switch on at park, ramp the levels out, and check once more.

        Raises `InstrumentError`, with the output off, where any is not as it was set.
        """
        wave, port = self._loaded(), self._port
        if self.on:
            raise ValueError(f"The output of channel {port.n} is on already.")
        port.check_load(self.load_ohm)
        port.check_clamp(self.limits.low_v, self.limits.high_v)
        port.set_levels(port.levels(), self._park)
        if self._burst is not None:
            self._burst.arm()
        self._check(self._read(), self._park)
        self.on = True  # from here on it may be, whatever comes back
        register_exit_action(self.off)
        try:
            port.switch(True)
            ramp(port, Levels(wave.low_v, wave.high_v), self.limits)
            self.settings()
            if self._burst is not None:
                self._burst.fire()
        except BaseException:
            self.off()
            raise

    def settings(self) -> dict[str, str]:
        """Every setting that the output depends on, by its header, as the instrument tells it.

        Raises `InstrumentError` where one is not as it was set; the caller switches off.
        """
        settings = self._read()
        if self.on:
            wave = self._loaded()
            self._check(settings, Levels(wave.low_v, wave.high_v))
        return settings

    def align(self) -> None:
        """Start the periods of both channels together."""
        self._port.align()

    def off(self) -> None:
        """Ramp to park, then off, queried back. Nothing is sent where the output is off.

        Where the ramp fails or is interrupted, the output is switched off at once; where channels
        were coupled meanwhile, it is tried once more without. Raises
        `InstrumentError` that says so where the output may still be on.
        """
        if not self.on:
            return
        port = self._port
        try:
            port.scpi.resynchronise()
            try:
                if port.output():
                    ramp_to_park(port, self._park, self.limits)
            finally:
                port.switch(False)
                self.on = False
                unregister_exit_action(self.off)
        except InstrumentError as error:
            if not self.on:  # only the ramp failed
                raise
            raise InstrumentError(
                error.resource,
                error.command,
                error.reply,
                why=f"THE OUTPUT OF CHANNEL {port.n} MAY STILL BE ON: the instrument could not be "
                "told to switch it off.",
                cure="Switch it off at the instrument now.",
            ) from error

    def _read(self) -> dict[str, str]:
        if self._burst is None:
            return read_settings(self._port)
        numbers = (due.header for due in self._burst.due())
        return read_settings(self._port, (*(state.header for state in BURST), *numbers))

    def _check(self, settings: Mapping[str, str], levels: Levels) -> None:
        """Refuse settings of an output that plays, or is about to, other than they were set."""
        wave, limits = self._loaded(), self.limits
        due = due_limits(limits.low_v, limits.high_v, self.load_ohm)  # a load changes all levels
        due += due_waveform(wave.frequency_hz, wave.codes.size) + due_levels(levels)
        burst, trigger = (), tuple(self._trigger)
        if self._burst is not None:  # its trigger comes from here, not from the internal clock
            burst, due = self._burst.states, (*due, *self._burst.due())
            trigger = tuple(one for one in trigger if one.header != commands.TRIGGER_SOURCE)
        check_states(self._port, settings, (*due_states(self._port, self.on, burst), *trigger))
        check_numbers(self._port, settings, due)

    def _loaded(self) -> AfgWaveform:
        if self.loaded is None:
            raise ValueError(f"Channel {self._port.n} has no waveform: call `load` first.")
        return self.loaded
