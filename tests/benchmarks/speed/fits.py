"""One fit: ten parameters, and nineteen with a `lam` for each play."""

from collections.abc import Callable, Iterator

from ._cases import Case, case, peer_values, recorded
from ._ours import bare, fitted, start_cost
from ._paired import Row, check_equal, compared, take_turns
from ._peer_fit import cost_at, peer_fit

START_AGREES = 1e-10  # relative; rounding
END_AGREES = 1e-6  # relative; both stop at 1e-8 of their own kind
BARE, WHOLE = "solver alone", "`fit`: errors, verdict"
CLOSED, DIFFERENCES = "SciPy + Numba, closed Jacobian", "SciPy + Numba, finite differences"


def checked_start(given: Case) -> float:
    """The cost of the start, equal on both sides."""
    ours, peer = start_cost(given), cost_at(given.values, given.shape, given.runs)
    check_equal("cost at the start", ours, peer, START_AGREES)
    return ours


def ends(given: Case) -> dict[str, float]:
    """The final cost of each way, ours checked by the peer's model. Compiles all of them."""
    found = peer_values(fitted(given).ecdl.operator)
    return {
        BARE: bare(given).cost,
        WHOLE: cost_at(found, given.shape, given.runs),
        CLOSED: peer_fit(given.values, given.shape, given.runs, analytic=True).cost,
        DIFFERENCES: peer_fit(given.values, given.shape, given.runs, analytic=False).cost,
    }


def ways(given: Case) -> dict[str, Callable[[], object]]:
    """What is timed."""
    data = given.values, given.shape, given.runs
    return {
        BARE: lambda: bare(given),
        CLOSED: lambda: peer_fit(*data, analytic=True),
        WHOLE: lambda: fitted(given),
        DIFFERENCES: lambda: peer_fit(*data, analytic=False),
    }


def rows(rounds: int, samples: int = 4000) -> Iterator[Row]:
    """Both levels of ours against both Jacobians of the peer."""
    recording = recorded(samples=samples)
    for each in (False, True):
        given = case(recording, each=each)
        begin, end = checked_start(given), ends(given)
        seconds = take_turns(ways(given), rounds)
        work = f"fit, 4 x {samples}, {given.size} parameters"
        for ours in (BARE, WHOLE):
            for peer in (CLOSED, DIFFERENCES):
                yield _row(work, ours, peer, seconds, begin, end)


def _row(work, ours, peer, seconds, begin, end) -> Row:
    """The row, without ratios where ours ended higher than the peer."""
    costs = dict(start_cost=begin, ours_cost=end[ours], peer_cost=end[peer])
    row = compared(work, ours, peer, seconds, **costs)
    if end[ours] <= end[peer] * (1.0 + END_AGREES):
        return row
    return Row(work, ours, peer, None, None, note="ours ended higher: not compared", **costs)
