"""Branches and holds of drives: what a recording without repeats can tell of hysteresis."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Drive, Recording, Run
from rapi_jax.internal import turning_samples

from ._settling import Settling, creep_rms, fit_settling


@dataclasses.dataclass(frozen=True)
class HoldCreep:
    """How the response moves while the drive rests, from sample `first` to `last` of a run.

    `change`: in the response's unit, over the hold. `per_decade`: of the logarithm of the time
    since the hold began; `share`: of the run's span. `logarithmic`: that this law fits better than
    a straight line.
    """

    run: str
    first: int
    last: int
    seconds: float
    change: float
    per_decade: float
    share: float
    logarithmic: bool


def count_branches(drive: Drive) -> tuple[int, int]:
    """How often the drive rises and falls, by more than a tenth of its swing at a time."""
    if drive.u_pp == 0:
        return 0, 0
    least = THRESHOLDS.branch_swing
    moves = np.diff(drive.value[turning_samples(drive.value, least)])
    moves = moves[np.abs(moves) > least * drive.u_pp]
    return int((moves > 0).sum()), int((moves < 0).sum())


def single_sweep(recording: Recording) -> str | None:
    """Why these runs cannot fix a model, where nothing repeats and no branch is passed twice."""
    drives = recording.drives
    if any(drive.repeats and drive.periods for drive in drives):
        return None
    up, down = np.sum([count_branches(drive) for drive in drives], axis=0).tolist()
    if min(up, down) >= 2:
        return None
    if up == down == 0:
        return (
            "no drive: the drive never moves in any run, so that nothing shows how the response "
            "follows it. Check the generator and the column, and record three periods or more."
        )
    ways = "rises" if up else "falls"
    passed = (
        f"the drive only {ways}, so that no way back shows the hysteresis"
        if min(up, down) == 0
        else f"the drive rises {_times(up)} and falls {_times(down)}, so that no part of the loop "
        "is passed twice and nothing tests what was fitted"
    )
    return (
        f"single sweep: {passed}. A single sweep does not fix a model: record three periods or "
        "more of one drive, and give its rate (`excitation_hz`) and `waveform`."
    )


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def find_holds(drive: Drive) -> list[tuple[int, int]]:
    """First and last sample of each stretch in which the drive rests, in a run where it moves."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    limits = THRESHOLDS
    width = max(limits.hold_samples, int(limits.hold_share * drive.size))
    if drive.u_pp == 0 or drive.size <= width:
        return []
    begins = slice(width // 2, width // 2 + drive.size - width + 1)
    high = maximum_filter1d(drive.value, width)[begins]
    low = minimum_filter1d(drive.value, width)[begins]
    still = high - low <= limits.hold_swing * drive.u_pp  # in the window that begins there
    edges = np.flatnonzero(np.diff(np.r_[0, still.astype(int), 0]))
    return [(int(a), int(b) + width - 2) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def find_creep(run: Run) -> list[HoldCreep]:
    """The holds in which the response moves on, beyond its noise."""
    found = []
    for first, last in find_holds(run.drive):
        few = THRESHOLDS.hold_samples // 2
        since, y = _in_hold(run, first, last)
        if y.size < 2 * THRESHOLDS.hold_samples - few:
            continue
        change = float(y[-few:].mean() - y[:few].mean())
        slope, left, error = _line(np.log10(since), y)
        _, straight, _ = _line(since, y)
        share = abs(change) / max(run.span, 1e-300)
        if abs(slope) > THRESHOLDS.hold_sigmas * error and share > THRESHOLDS.hold_creep:
            span = float(since[-1] - since[0])
            found.append(
                HoldCreep(run.name, first, last, span, change, slope, share, left < straight)
            )
    return found


def find_settling(run: Run, hold: HoldCreep) -> Settling | None:
    """The lag or resonance that fits a hold far better than creep does; `None` where none does."""
    since, y = _in_hold(run, hold.first, hold.last)
    law = fit_settling(since, y)
    return law if law.rms < THRESHOLDS.hold_settling * creep_rms(since, y) else None


def _in_hold(
    run: Run, first: int, last: int
) -> tuple[Float[np.ndarray, " samples"], Float[np.ndarray, " samples"]]:
    """Times since a hold began (s) and valid readings; the first are the end of the motion."""
    inside = np.arange(first, last + 1)
    inside = inside[run.valid[inside]][THRESHOLDS.hold_samples // 2 :]
    since = run.drive.time[inside] - run.drive.time[first] + run.drive.step_s
    return since, run.response[inside]


def _line(
    x: Float[np.ndarray, " samples"], y: Float[np.ndarray, " samples"]
) -> tuple[float, float, float]:
    """Slope of the straight line through `y`, what it leaves (rms), one standard error of it.

    The error is that of residuals that are correlated as far as the line's own misfit is.
    """
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y) / max(float(x @ x), 1e-300)
    left = y - slope * x
    rho = float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300)
    correlated = (1.0 + max(rho, 0.0)) / max(1.0 - rho, 1e-3)
    rms = float(np.sqrt(np.mean(left**2)))
    return slope, rms, rms * float(np.sqrt(correlated / max(float(x @ x), 1e-300)))


def describe_creep(recording: Recording) -> list[str]:
    """The largest motion in a hold in a sentence, with what to do; none where there is none."""
    found = [(one, run) for run in recording.runs for one in find_creep(run)]
    if not found:
        return []
    (one, run), unit = max(found, key=lambda pair: pair[0].share), recording.response_unit
    more = f" ({len(found)} such holds)" if len(found) > 1 else ""
    moves = (
        f"while the drive rests in run {one.run!r} (samples {one.first}-{one.last}{more}) the "
        f"response moves by {one.change:+.3g} {unit} in {one.seconds:.3g} s, "
        f"{100 * one.share:.2g} % of its span, "
    )
    settling = find_settling(run, one)
    if settling is not None:
        return [
            f"settling: {moves}{settling.describe()}: a lag or a resonance of the mount, the "
            "amplifier or a servo, not creep. The operator has none: add it (`rapi diagnose`), or "
            "drive more slowly."
        ]
    law = (
        f"{one.per_decade:+.3g} {unit} a decade of time, as a piezo's creep does"
        if one.logarithmic
        else "nearer to a straight line than to a logarithm of time: creep, or a drift"
    )
    return [
        f"creep: {moves}{law}. The operator has no creep: add it (`rapi diagnose`), or record "
        "periods without holds."
    ]
