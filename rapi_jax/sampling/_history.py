"""What precedes each run of a session: a lead-in of one period, and the gap after the last run."""

from typing import NamedTuple

from jaxtyping import Array, Float, Int


class History(NamedTuple):
    """What the runs of a session know of what came before them; one row per run.

    - `period_s`: s, of the one period of lead-in with which the row begins; 0 where it has none.
    - `lead`: number of samples of that lead-in.
    - `gap_s`: from the end of the run before to the start of this one, s; infinite where there is
      none, or where the two have no common clock.
    """

    period_s: Float[Array, " runs"]
    lead: Int[Array, " runs"]
    gap_s: Float[Array, " runs"]
