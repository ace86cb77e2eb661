"""Numbers that bound what a server waits for and moves at once."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class ServerThresholds:
    """Numbers that bound what a server waits for and moves at once."""

    tick_s: float = threshold(
        0.02,
        unit="s",
        origin="how often a waiting server looks whether it shall stop; set by trial",
    )
    first_message_s: float = threshold(
        5.0, unit="s", origin="longest wait for the first message of a connection; set by trial"
    )
    most_clients: int = threshold(
        64,
        unit="connections",
        origin="far more than a laboratory has; each may hold some answers of 32 MiB; set by trial",
    )
    handover_s: float = threshold(
        1.0,
        unit="s",
        origin="longest wait for a client that is going, where one is served alone; set by trial",
    )
    receive_bytes: int = threshold(
        1 << 16, unit="bytes", origin="taken from a connection at once; set by trial"
    )
    send_bytes: int = threshold(
        1 << 14, unit="bytes", origin="given to a connection at once; set by trial"
    )


THRESHOLDS = ServerThresholds()
