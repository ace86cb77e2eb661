"""Numbers that bound what is read over a connection, and how long."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class LinkThresholds:
    """Numbers that bound what is read over a connection, and how long."""

    line_bytes: int = threshold(1024, unit="bytes", origin="longest answer in text; set by trial")
    most_errors: int = threshold(
        100,
        unit="entries",
        origin="a longer error queue is taken for one without end; set by trial",
    )
    message_bytes: int = threshold(
        1 << 16, unit="bytes", origin="of a message asked for at once; set by trial"
    )
    reconnect_s: float = threshold(
        0.1,
        unit="s",
        origin="least time to connect again, even where the deadline is nearer; set by trial",
    )
    infinity_tolerance: float = threshold(1e-9, unit="of 9.9E37", origin="rounding of floats")


THRESHOLDS = LinkThresholds()
