"""Sessions of many designs: as laboratories record them, not as a bank of one design would."""

import numpy as np
import numpy.typing as npt

from ._scan import Scan

Array = npt.NDArray[np.float64]
MOST_RUNS, MOST_RATES, MOST_PERIODS = 12, 6, 6
RATE = (0.5, 150.0)  # Hz
SAMPLES = (500, 40_000)  # of a session
OF_A_PERIOD = (60, 4000)
TABLE = 16_384  # points a period of a waveform that a generator plays: far more than are recorded


def draw_session(rng: np.random.Generator) -> tuple[Scan, ...]:
    """1 to 12 runs at 1 to 6 rates and 1 to 3 swings on one clock.

    1 to 6 periods a run; 500 to 40 000 samples in all, 60 to 4000 a period; 0.5 to 150 Hz,
    rates within a factor of 20; triangles mostly, also sines, trapezoids that hold at both ends and
    triangles with unequal ramps; beginnings at any of four phases.
    """
    count = int(rng.integers(1, MOST_RUNS + 1))
    rates = _draw_rates(rng, int(rng.integers(1, MOST_RATES + 1)))
    full = float(rng.uniform(1.5, 5.0))
    swings = [full * part for part in (1.0, 0.7, 0.45)[: int(rng.choice([1, 1, 2, 3]))]]
    bias = float(rng.uniform(2.8, 3.2))
    usual = int(rng.integers(1, MOST_PERIODS + 1))
    total = float(np.exp(rng.uniform(*np.log(SAMPLES))))
    clock, scans = float(rng.uniform(1.0, 5.0)), []
    for k in range(count):
        periods = usual if rng.random() < 0.7 else int(rng.integers(1, MOST_PERIODS + 1))
        samples = int(np.clip(total / count / periods, *OF_A_PERIOD)) // 4 * 4
        waveform, shape = _draw_waveform(rng)
        swing = swings[k // len(rates) % len(swings)]
        scan = Scan(
            rate_hz=rates[k % len(rates)],
            swing=swing,
            bias=bias,
            waveform=waveform,
            periods=periods,
            samples=samples,
            phase=float(rng.choice([0.0, 0.25, 0.5, 0.75])),
            start_s=round(clock, 3),
            table=None if shape is None else bias + swing * shape,
        )
        scans.append(scan)
        clock += scan.duration_s + float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    return tuple(scans)


def _draw_rates(rng: np.random.Generator, count: int) -> list[float]:
    """Rates in Hz, each within a factor of 4.5 of the first."""
    first = float(np.exp(rng.uniform(np.log(1.0), np.log(40.0))))
    others = first * np.exp(rng.uniform(-1.5, 1.5, size=count - 1))
    return [first, *np.clip(others, *RATE).tolist()]


def _draw_waveform(rng: np.random.Generator) -> tuple[str, Array | None]:
    """Its name, and where it is none of those that a name tells, one period from -1/2 to 1/2."""
    kind = rng.choice(["triangle", "sine", "trapezoid", "skewed"], p=[0.7, 0.14, 0.08, 0.08])
    place = np.arange(TABLE) / TABLE
    if kind == "trapezoid":
        hold = float(rng.uniform(0.1, 0.3))  # of a period, at each end
        ramp = 0.5 - hold
        knots = [0.0, hold / 2, hold / 2 + ramp, hold * 1.5 + ramp, hold * 1.5 + 2 * ramp, 1.0]
        return "other", np.interp(place, knots, [-0.5, -0.5, 0.5, 0.5, -0.5, -0.5])
    if kind == "skewed":
        rise = float(rng.uniform(0.6, 0.85))
        return "other", np.interp(place, [0.0, rise, 1.0], [-0.5, 0.5, -0.5])
    return str(kind), None
