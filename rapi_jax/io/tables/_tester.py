"""What a ferroelectric tester states above each of its tables: when it was taken, and its rate.

As in public files of aixACCT's analysers: `Timestamp: 08/23/2019 14:17:12` (month first, without
an offset from UTC), `Hysteresis Frequency [Hz]: 0.1`.
"""

import datetime
import re
from collections.abc import Sequence

_STAMP = re.compile(r"timestamp:\s*(\d\d)/(\d\d)/(\d{4})\s+(\d\d):(\d\d)(?::(\d\d))?\s*", re.I)
_RATE = re.compile(r"hysteresis frequency \[hz\]:\s*([-+.0-9e]+)\s*", re.I)


def stated_above(lines: Sequence[str]) -> tuple[datetime.datetime | None, float | None]:
    """When a table was taken, by the clock of the tester, and its scan rate, Hz; `None` each where
    the lines above it do not say.
    """
    began, rate = None, None
    for line in lines:
        if found := _STAMP.fullmatch(line):
            month, day, year, hour, minute, second = (int(p or 0) for p in found.groups())
            try:
                began = datetime.datetime(year, month, day, hour, minute, second)
            except ValueError:  # day first, or no date
                began = None
        if found := _RATE.fullmatch(line):
            try:
                rate = float(found[1])
            except ValueError:
                rate = None
    return began, rate if rate is not None and 0.0 < rate < float("inf") else None
