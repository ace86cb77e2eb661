"""When a recording was made and how warm its device was, from the text that says so."""

import math
from datetime import UTC, datetime

from rapi_jax._errors import DataError

ABSOLUTE_ZERO_C = -273.15


def parse_recorded_at(text: str | None) -> datetime | None:
    """`recorded_at` in UTC. Raises `DataError` unless it is a date and time that names its offset.

    Without an offset from UTC it would be another instant in another laboratory, and twice the same
    in the night when clocks are set back.
    """
    if text is None:
        return None
    try:
        time = datetime.fromisoformat(str(text).strip())
        if time.tzinfo is not None:
            return time.astimezone(UTC)
    except (ValueError, OverflowError):
        pass
    raise DataError(
        "`recorded_at` must be a date and time with its offset from UTC, such as "
        f"2026-11-24T10:00:00Z or 2026-11-24T11:00:00+01:00, but is {ascii(text)[:60]}."
    )


def parse_temperature(text: str | float | None) -> float | None:
    """`temperature_c` as a number. Raises `DataError` unless it is one above absolute zero."""
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isfinite(value) and value > ABSOLUTE_ZERO_C:
        return value
    raise DataError(
        "`temperature_c` must be a number of degrees Celsius, such as 21.3, but is "
        f"{ascii(text)[:60]}."
    )
