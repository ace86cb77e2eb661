"""Whether the last row of a text table breaks off: a file cut short within a number still reads."""

from collections.abc import Sequence

import numpy as np

from rapi_jax._errors import DataError

ROWS = 1000  # compared with the last one; a format shows in far fewer
_JUMP = 2.0  # times the largest step between neighbours; halved, a glitch at the end is refused


def check_last_row(cells: Sequence[Sequence[str]], columns: Sequence[np.ndarray]) -> None:
    """Raise `DataError` where the last row, which no line end follows, was likely cut.

    `cells`: the text of at most `ROWS` rows, the last one included; `columns`: all values, each
    `" rows"`. Cut is a last number with fewer characters than any above it, and one that jumps by
    more than twice the largest step in its column. A cut that does neither changes no more than
    the readings themselves do from one row to the next.
    """
    last, above = cells[-1], cells[:-1]
    if len(above) < 2:
        return
    place = len(last) - 1
    shortest = min(len(row[place].strip()) for row in above if len(row) > place)
    values = columns[place][np.isfinite(columns[place])] if place < len(columns) else np.empty(0)
    steps = np.abs(np.diff(values))
    jumps = steps.size > 1 and steps[-1] > _JUMP * steps[:-1].max()
    if len(last[place].strip()) < shortest or jumps:
        raise DataError(
            f"the last line breaks off at '{last[place].strip()[:40]}', and no line end follows: "
            "the file was likely cut short. Export it again, or remove that line; if it is whole, "
            "end it with a line end."
        )
