"""Settings of all instruments about a record: read before and after it, and compared."""

import json
from collections.abc import Mapping
from typing import Any

from hardware._driver import AbstractReadBack
from hardware._errors import InstrumentError


class RecordSettings:
    """What the instruments of one run are set to; `begin` it, then `check` about every record.

    Instruments that cannot be read back (`AbstractReadBack`) are left out.
    """

    def __init__(self, instruments: Mapping[str, Any]) -> None:
        """`instruments`: by family."""
        self._instruments = {
            family: one for family, one in instruments.items() if isinstance(one, AbstractReadBack)
        }
        self._first: dict[str, dict[str, str]] = {}

    def begin(self) -> None:
        """Read them all. Raises `InstrumentError`."""
        self._first = {family: one.settings() for family, one in self._instruments.items()}

    def check(self) -> None:
        """Read them again. Raises `InstrumentError` where one differs from what `begin` read."""
        for family, one in self._instruments.items():
            first, now = self._first[family], one.settings()
            changed = [name for name in first if now.get(name) != first[name]]
            if changed:
                listed = ", ".join(f"{name} {first[name]}" for name in changed)
                raise InstrumentError(
                    one.resource,
                    f"{changed[0]}?",
                    now.get(changed[0], ""),
                    why=f"Settings of the {family} changed while the scan was played; before, they "
                    f"were: {listed}.",
                    cure="The output is parked and off, and this scan is not kept. See who "
                    "else operates the instrument, at its front panel or over the network, and "
                    "measure again.",
                )

    def text(self) -> str:
        """What `begin` read, as JSON: by family, then by setting."""
        return json.dumps(self._first)
