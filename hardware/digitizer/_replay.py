"""Raw records of earlier measurements in place of a digitizer."""

from pathlib import Path

from hardware._driver import AbstractConnector, Address
from rapi_jax import DataError
from rapi_jax.internal import StrPath
from rapi_jax.io import printable

from ._base import AbstractDigitizer, AbstractDigitizerTable, Acquisition, Samples
from ._raw import read_samples


class ReplayTable(AbstractDigitizerTable):
    """Raw records of an earlier measurement."""

    folder: Address

    @property
    def resources(self) -> tuple[str, ...]:
        """None: files are read by as many programs as want to."""
        return ()


class ReplayDigitizer(AbstractDigitizer):
    """Returns the raw records of a folder in the order of their names, one for each trigger.

    A record that does not hold what is asked for is refused, and so is one more than there are.

    >>> import numpy as np
    >>> from hardware import ReplayDigitizer, Samples, write_samples
    >>> samples = Samples(
    ...     {"interferometer": np.zeros(100, np.int16)}, {"interferometer": 1e-3},
    ...     {"interferometer": 0.0}, sample_hz=5e6, start_s=0.0,
    ... )
    >>> _ = write_samples(samples, ".", "record00")
    >>> isinstance(ReplayDigitizer("."), ReplayDigitizer)
    True
    """

    kind = "replay"
    Table = ReplayTable
    supports_dry_run = True

    @classmethod
    def open(cls, table: ReplayTable, connector: AbstractConnector) -> "ReplayDigitizer":
        """The records of the folder; nothing is connected."""
        del connector
        return cls(table.folder)

    def __init__(self, folder: StrPath) -> None:
        """Raises `DataError` for a folder without records."""
        self._folder = Path(folder)
        self._left = sorted(self._folder.glob("*.json"))
        if not self._left:
            raise DataError(
                f"{printable(folder)}: there is no raw record (`*.json`). They are written by "
                "`rapi measure --raw`."
            )
        self._asked: Acquisition | None = None
        self._next: Path | None = None

    @property
    def identity(self) -> str:
        """Where the records come from."""
        return f"replay of {printable(self._folder)}"

    def configure(self, asked: Acquisition) -> None:
        """What the next record must hold."""
        self._asked = asked

    def arm(self) -> None:
        """The next record. Raises `DataError` where there is none."""
        if not self._left:
            raise DataError(f"{printable(self._folder)}: there is no further raw record.")
        self._next = self._left.pop(0)

    def fetch(self, timeout_s: float) -> Samples:
        """The record; what else it holds is left out."""
        del timeout_s
        if self._asked is None or self._next is None:
            raise ValueError("The digitizer is not set up: call `configure` and `arm` first.")
        samples, _ = read_samples(self._next)
        return samples

    def snapshot(self) -> dict[str, str]:
        """The record that was given last."""
        return {"identity": self.identity, "record": "" if self._next is None else self._next.name}

    def close(self) -> None:
        """Nothing is held."""
