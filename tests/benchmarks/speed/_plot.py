"""The growth of time and memory as a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .growth import WHAT


def plot(path: Path, found: Sequence[dict[str, Any]]) -> None:
    """Time above, memory below, one column for each number that grows; axes logarithmic."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    columns = list(dict.fromkeys(one["grows"] for one in found))
    figure, axes = plt.subplots(
        2, len(columns), figsize=(3.4 * len(columns), 6), squeeze=False, sharex="col"
    )
    for one in found:
        column = columns.index(one["grows"])
        sizes = [point["size"] for point in one["points"]]
        label = WHAT.get(one["grows"], WHAT[one["kind"]])
        for row, key, scale in ((0, "time", 1.0), (1, "bytes", 1e-6)):
            values = [max(point[key] * scale, 1e-6) for point in one["points"]]
            axes[row, column].loglog(sizes, values, "o-", label=label)
    for column, name in enumerate(columns):
        axes[1, column].set_xlabel(name)
        axes[0, column].legend(fontsize="small", loc="lower right")
    axes[0, 0].set_ylabel("time (s)")
    axes[1, 0].set_ylabel("peak memory above the start (MB)")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
