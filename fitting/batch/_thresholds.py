"""Numbers that decide in a batch, each with its unit and origin."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class BatchThresholds:
    """See each field; they change when something happens, never a result."""

    tries: int = 3
    """Times a job is begun before it is given up, where its process ends each time. Promised. With
    one, a worker that the system ended for another's memory costs a result; with more, a job that
    always ends its worker costs a restart (5 s) each."""

    backlog: int = 2
    """Jobs handed to a scheduler for each of its threads. One is computed while the next waits, so
    that no thread waits for this process (10 ms); with one they do, with more a worker that is
    added later finds less to do."""

    table_s: float = 5.0
    """s between two writings of the results table, at least: what a person waits for without
    noticing."""

    table_share: float = 0.02
    """Largest share of the time that the table may take; the longer a writing took, the later
    the next one comes."""

    settle_s: float = 2.0
    """s for which no file of an arriving recording may have changed. A copy over a network stalls
    for less than that; halved, more half-copied recordings are read (and refused, and read again
    once they are whole), doubled, each waits 2 s longer."""

    poll_s: float = 0.5
    """s between two looks at a watched folder, or at whether a scheduler still answers."""

    connect_s: float = 15.0
    """s to wait for a scheduler to answer, and then for a first worker."""

    start_s: float = 300.0
    """s without a worker after which a cluster of ours counts as lost. A worker starts in 5 s, and
    in 30 s on a computer with eight times as much to do as it has processors."""

    lock_s: float = 3600.0
    """s to wait for a job that a worker of an interrupted batch still computes; the longest single
    diagnosis measured took 253 s."""


THRESHOLDS = BatchThresholds()
