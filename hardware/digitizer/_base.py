"""What a digitizer is to a bench: configured, armed, and read after its trigger."""

import abc
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16
from pydantic import Field

from hardware._driver import AbstractDriver, AbstractDriverTable, Positive, Table
from rapi_jax import DataError

from ._thresholds import THRESHOLDS


@dataclass(frozen=True)
class Input:
    """One input: its `connector`, and the lowest and highest voltage to be read there, V.

    >>> from hardware import Input
    >>> Input(connector=1, low_v=-0.2, high_v=1.2).high_v
    1.2
    """

    connector: int
    low_v: float
    high_v: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low_v) and math.isfinite(self.high_v)):
            raise DataError(f"The range of an input must be finite, but is {self}.")
        if not self.low_v < self.high_v or self.connector < 0:
            raise DataError(f"`low_v` must lie below `high_v`, and inputs are counted, not {self}.")


@dataclass(frozen=True)
class Acquisition:
    """One record: what is read, from when to when about the trigger, and how fast at least.

    - `inputs`: by what they read ("measurement", "interferometer", "cavity").
    - `before_s`, `after_s`: from so long before the trigger to so long after it, s.
    - `sample_hz`: samples a second, at least. A Fabry-Perot's peak at 40 Hz lasts 1.25 us: fewer
      than 5 MS/s would miss it.

    >>> from hardware import Acquisition, Input
    >>> read = Acquisition({"interferometer": Input(1, -0.2, 1.2)}, before_s=0.001, after_s=0.1)
    >>> read.sample_hz  # at least
    5000000.0
    """

    inputs: Mapping[str, Input]
    before_s: float
    after_s: float
    sample_hz: float = 5e6

    def __post_init__(self) -> None:
        connectors = [one.connector for one in self.inputs.values()]
        if not connectors or len(set(connectors)) < len(connectors):
            raise DataError("An acquisition reads at least one input, and each of them once.")
        if not (0 <= self.before_s < math.inf and 0 < self.after_s < math.inf):
            raise DataError(f"The times of an acquisition must not be negative: {self}.")
        if not 0 < self.sample_hz < math.inf:
            raise DataError(f"`sample_hz` must be positive, but is {self.sample_hz}.")


@dataclass(frozen=True, eq=False)
class Samples:
    """A record as codes: `volts = zero_v + volts_per_code * code` for each input.

    - `sample_hz`: what it was, Hz. `start_s`: time of the first sample from the trigger, s;
      negative before it.
    - `full_scale`: the codes at which the digitizer clips, `None` where unknown.

    >>> import numpy as np
    >>> from hardware import Samples
    >>> samples = Samples(
    ...     {"interferometer": np.zeros(100, np.int16)}, {"interferometer": 1e-3},
    ...     {"interferometer": 0.0}, sample_hz=5e6, start_s=0.0,
    ... )
    >>> samples.sample_hz, samples.codes["interferometer"].size
    (5000000.0, 100)
    """

    codes: Mapping[str, Int16[np.ndarray, " time"]]
    volts_per_code: Mapping[str, float]
    zero_v: Mapping[str, float]
    sample_hz: float
    start_s: float
    full_scale: tuple[float, float] | None = None

    def volts(self, name: str) -> np.ndarray:
        """One input, V."""
        return self.zero_v[name] + self.volts_per_code[name] * self.codes[name]

    def check(self, asked: Acquisition) -> "Samples":
        """Itself, if it holds what was asked for; raises `DataError` otherwise."""
        missing = sorted(set(asked.inputs) - set(self.codes))
        if missing:
            raise DataError(f"The digitizer gave nothing for {', '.join(missing)}.")
        sizes = {codes.size for codes in self.codes.values()}
        if len(sizes) != 1 or min(sizes) < 2:
            raise DataError(
                "The digitizer must give the same number of samples for each input, two or more, "
                f"but gave {sorted(sizes)}. Record again."
            )
        step = 1 / self.sample_hz
        end_s = self.start_s + (sizes.pop() - 1) * step
        if self.start_s > -asked.before_s + step or end_s < asked.after_s - step:
            raise DataError(
                f"The record goes from {self.start_s:.6g} to {end_s:.6g} s about the trigger, but "
                f"should go from {-asked.before_s:.6g} to {asked.after_s:.6g} s: the digitizer's "
                "memory is too short for this rate and length."
            )
        if self.sample_hz < asked.sample_hz * (1 - THRESHOLDS.rate_tolerance):
            raise DataError(
                f"The record has {self.sample_hz:g} samples a second, but needs {asked.sample_hz:g}"
                ": record less at once, or with a digitizer of more memory."
            )
        return self


class InputTable(Table):
    """One input of the digitizer."""

    connector: int = Field(ge=0, le=64)
    low_v: float = Field(allow_inf_nan=False)
    high_v: float = Field(allow_inf_nan=False)

    def of(self) -> Input:
        """As an acquisition takes it."""
        return Input(**self.model_dump())


class AbstractDigitizerTable(AbstractDriverTable):
    """What every digitizer reads.

    `measurement`: the measurement arm, for ranging. `margin_s`: recorded on either side of the
    drive; `latency_s`: from the trigger until the drive's first sample is at the piezo.

    >>> from hardware import AbstractDigitizerTable
    >>> class OwnTable(AbstractDigitizerTable):
    ...     address: str
    ...
    ...     @property
    ...     def resources(self):
    ...         return (self.address,)
    >>> arm = {"connector": 1, "low_v": -0.2, "high_v": 1.2}
    >>> table = OwnTable(kind="own", address="USB0", interferometer=arm)
    >>> table.inputs()["interferometer"].high_v, table.sample_hz
    (1.2, 5000000.0)
    """

    interferometer: InputTable
    cavity: InputTable | None = None
    measurement: InputTable | None = None
    sample_hz: Positive = 5e6
    margin_s: float = Field(default=9e-3, ge=0, allow_inf_nan=False)
    latency_s: float = Field(default=0.0, ge=0, allow_inf_nan=False)

    def inputs(self) -> dict[str, Input]:
        """By what they read; without the measurement arm, which shows nothing of the laser."""
        inputs = {"interferometer": self.interferometer.of()}
        return inputs if self.cavity is None else inputs | {"cavity": self.cavity.of()}

    def range_inputs(self) -> dict[str, Input]:
        """With the measurement arm. Raises `DataError` where the file names none."""
        if self.measurement is None:
            raise DataError(
                "`digitizer.measurement` is missing: name the input of the measurement arm, such "
                "as measurement = { connector = 3, low_v = -0.2, high_v = 1.2 }."
            )
        return {"measurement": self.measurement.of()} | self.inputs()


class AbstractDigitizer(AbstractDriver):
    """A digitizer with an external trigger; `Table` derives from `AbstractDigitizerTable`.

    `configure` once, then `arm` and `fetch` for each record. Raises `InstrumentError`.

    >>> import numpy as np
    >>> from hardware import AbstractDigitizer, Acquisition, Input, ReplayDigitizer, Samples
    >>> from hardware import write_samples
    >>> codes = {"interferometer": np.zeros(100, np.int16)}
    >>> scale, zero = {"interferometer": 1e-3}, {"interferometer": 0.5}
    >>> _ = write_samples(Samples(codes, scale, zero, sample_hz=5e6, start_s=0.0), ".", "record00")
    >>> digitizer: AbstractDigitizer = ReplayDigitizer(".")
    >>> asked = Acquisition({"interferometer": Input(1, -0.2, 1.2)}, before_s=0.0, after_s=1e-5)
    >>> digitizer.configure(asked)
    >>> digitizer.arm()
    >>> float(digitizer.fetch(timeout_s=1.0).check(asked).volts("interferometer")[0])  # V
    0.5
    """

    @abc.abstractmethod
    def configure(self, asked: Acquisition) -> None:
        """Set up for records like this."""

    @abc.abstractmethod
    def arm(self) -> None:
        """Wait for the next trigger; returns as soon as it does."""

    @abc.abstractmethod
    def fetch(self, timeout_s: float) -> Samples:
        """The record of the trigger since `arm`; an error where none came in time.

        The bench checks that it holds what was asked for (`Samples.check`).
        """

    @abc.abstractmethod
    def snapshot(self) -> dict[str, str]:
        """Every setting that a record depends on, as the digitizer tells it."""
