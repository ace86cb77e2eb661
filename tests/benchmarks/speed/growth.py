"""Time and memory against samples, plays, runs and recordings, each size in a fresh process."""

import dataclasses
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

DECADES = 2.0  # over which growth is judged, at the upper end
HEAD = ("growth of", "with", "sizes", "time", "exponent", "times linear", "memory", "exponent ")


@dataclasses.dataclass(frozen=True)
class Series:
    """One work at several sizes; the other numbers are fixed. `full`: sizes with `--full` alone."""

    kind: str
    grows: str  # which of the numbers
    sizes: tuple[int, ...]
    samples: int = 1000
    plays: int = 10
    runs: int = 4
    recordings: int = 1
    full: tuple[int, ...] = ()

    def numbers(self, size: int) -> tuple[int, ...]:
        """The arguments of the process at this size."""
        fields = dataclasses.replace(self, **{self.grows: size})
        return fields.samples, fields.plays, fields.runs, fields.recordings

    @property
    def fixed(self) -> str:
        """What does not grow, in words."""
        names = ["samples", "plays"] + ["runs", "recordings"] * (self.kind == "fit")
        return ", ".join(f"{getattr(self, n)} {n}" for n in names if n != self.grows)


WHAT = {
    "forward": "`predict`, 10 periods",
    "free": "`predict`, never repeats",
    "fit": "one solver step",
    "recordings": "solver, all recordings",
}
WIDE = (1, 3, 10, 30, 100, 300)
ALL = (
    Series("forward", "samples", (10**3, 10**4, 10**5, 10**6, 10**7)),
    Series("forward", "plays", WIDE, samples=100_000),
    Series("free", "samples", (10**3, 10**4, 10**5, 10**6, 10**7)),
    Series("free", "plays", WIDE, samples=100_000),
    Series("fit", "samples", (250, 2500, 25_000, 250_000)),
    Series("fit", "plays", WIDE),
    Series("fit", "runs", WIDE),
    Series("fit", "recordings", (1, 10, 100, 1000), samples=250, full=(10_000,)),
)


def measured(series: Series, full: bool, limit: float) -> dict[str, Any]:
    """Figures of each size; from the first that takes longer than `limit` (s) on, there are none.

    `time` is that of one solver step, since the number of steps is not growth; of recordings, that
    of all.
    """
    points = []
    for size in series.sizes + (series.full if full else ()):
        numbers = [str(number) for number in series.numbers(size)]
        command = [sys.executable, "-m", f"{__package__}._growth_process", series.kind, *numbers]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, check=True, timeout=limit
            )
        except subprocess.TimeoutExpired:
            break
        except subprocess.CalledProcessError as error:
            if error.returncode < 0:  # ended by the system, as where memory is short
                break
            raise RuntimeError(f"{' '.join(command)}: {error.stderr}") from error
        point = {"size": size, **json.loads(done.stdout.splitlines()[-1])}
        each = 1 if series.grows == "recordings" else point["steps"]
        points.append(point | {"time": point["seconds"] / max(each, 1)})
    return dataclasses.asdict(series) | {"fixed": series.fixed, "points": points} | slopes(points)


def slopes(points: Sequence[dict[str, float]]) -> dict[str, float | None]:
    """Exponents over the last two decades, and time over what linear growth from there gives."""
    if len(points) < 2:
        return {"time_exponent": None, "times_linear": None, "memory_exponent": None}
    size = np.array([point["size"] for point in points], dtype=float)
    late = size >= size[-1] / 10**DECADES * (1 - 1e-9)
    size = size[late]
    seconds = np.array([point["time"] for point in points])[late]
    memory = np.maximum(np.array([point["bytes"] for point in points])[late], 1.0)
    return {
        "time_exponent": float(np.polyfit(np.log(size), np.log(seconds), 1)[0]),
        "times_linear": float(seconds[-1] / seconds[0] / (size[-1] / size[0])),
        "memory_exponent": float(np.polyfit(np.log(size), np.log(memory), 1)[0]),
    }


def series(full: bool, limit: float) -> Iterator[dict[str, Any]]:
    """All series, each as soon as it is known."""
    for one in ALL:
        yield measured(one, full, limit)


def markdown(found: Sequence[dict[str, Any]]) -> str:
    """One line a series, the smallest and the largest size of each."""
    lines = [HEAD, ("---",) * len(HEAD)]
    for one in found:
        points = one["points"]
        if not points:
            continue
        first, last = points[0], points[-1]
        what = WHAT.get(one["grows"], WHAT[one["kind"]])
        lines.append(
            (
                f"{what}: {one['grows']}",
                one["fixed"],
                f"{first['size']} to {last['size']}",
                f"{first['time']:.2g} to {last['time']:.2g} s",
                *(_number(one[key]) for key in ("time_exponent", "times_linear")),
                f"{first['bytes'] / 1e6:.3g} to {last['bytes'] / 1e6:.3g} MB",
                _number(one["memory_exponent"]),
            )
        )
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
