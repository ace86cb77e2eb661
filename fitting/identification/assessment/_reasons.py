"""What speaks against a fit: rank, convergence, starts that disagree, misfit, held-out data."""

import numpy as np

from fitting._units import quantity
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.data_checks.drives._drive_reading import (
    DriveNoise,
    describe_cure,
    find_reading_noise,
)
from fitting.identification.problem._problem import Problem, Solution

from ._claim import Claim
from ._convergence import gain_tolerance, remaining_step
from ._cross_validation import HeldOut, no_run_is_predicted
from ._ends import Start
from ._noise import Noise


def check_rank(undetermined: tuple[str, ...]) -> list[str]:
    if not undetermined:
        return []
    it = "it" if len(undetermined) == 1 else "one of them"
    own = any(name.startswith(("lam_", "eta_", "alpha_")) for name in undetermined)
    fewer = "Give all plays one value (`--each none`) or fewer" if own else "Use fewer"
    return [
        f"unidentifiable: these data cannot fix {', '.join(undetermined)}. {fewer} plays "
        f"(`--plays`), hold {it} (`free=` in Python), or add a scan rate, a swing or a longer one."
    ]


def check_convergence(
    problem: Problem, weight: np.ndarray, solution: Solution, rmse: float, span: float
) -> list[str]:
    exact = rmse <= THRESHOLDS.exact_fit * max(span, 1e-300)
    gain, _ = remaining_step(problem, solution, weight)
    if exact or gain <= gain_tolerance(problem, weight):
        return []
    return [
        f"not converged: one more step takes away {100 * gain:.2g} % of the cost "
        f"({solution.solver.reason or 'the solver stopped early'}). More starts or a better "
        "first model."
    ]


def check_starts(starts: list[Start]) -> list[str]:
    if len(starts) == 1:
        return ["one start only: nothing says that the end is not a local minimum."]
    if sum(start.agrees for start in starts) < 2:
        return [
            f"starts disagree: {len(starts)} starts reached {len(starts)} different ends, so the "
            "best may be a local minimum. Raise `starts`, or hold what you know."
        ]
    return []


def check_misfit(
    problem: Problem, rmse: float, span: float, noise: Noise, claim: Claim | None
) -> list[str]:
    """The residual against the response's variance, what is not noise against its curvature."""
    data = problem.data
    variance = float(np.mean([np.var(data.y[r, data.use[r]]) for r in range(data.y.shape[0])]))
    if span == 0:
        return ["no signal: the response never changes."]
    if rmse**2 > (1.0 - THRESHOLDS.explained_variance) * variance:
        return [
            f"nothing explained: the model leaves {100 * rmse**2 / variance:.0f} % of the "
            "response's variance. The response does not follow this drive: check wiring, columns "
            "and lag. Or it turns back while the drive goes on, as a butterfly loop and a folded "
            "reading do: no model of this kind describes that; record a drive that stays on one "
            "side of the turn."
        ]
    gap, curved = noise.gap(rmse), np.inf if claim is None else claim.curvature
    if gap > THRESHOLDS.poor_gap * curved and gap > THRESHOLDS.exact_fit * span:
        unit = problem.recording.response_unit
        left, bent = quantity(gap, unit), quantity(curved, unit)
        if (read := _drive_noise(problem)) is not None and read.in_response >= gap:
            made = quantity(read.in_response, unit)
            return [
                f"noisy drive: beyond noise the model leaves {left} rms, too much to straighten a "
                f"scan (the response departs from a straight line by {bent} rms). The drive as "
                f"recorded carries noise of {read.rms:.2g} {problem.recording.drive_unit} rms. The "
                f"model turns it into {made} rms of response, but the device does not follow it: "
                "it is noise of the drive's reading, which also makes parameters come out too "
                f"small. {describe_cure(read.run)}"
            ]
        return [
            f"poor fit: beyond noise the model leaves {left} rms. The response departs from a "
            f"straight line by {bent} rms, so a scan compensated with this model would still be "
            f"about {100 * gap / curved:.0f} % as nonlinear as one without. Likely causes: an "
            "effect the model lacks (`rapi diagnose` names it), a drift, a wrong lag, too few "
            "plays (`plays`) or too low an order."
        ]
    return []


def _drive_noise(problem: Problem) -> DriveNoise | None:
    """The drive's noise that the device does not follow, of the run with most of it."""
    found = find_reading_noise(problem.recording)
    return max(found, key=lambda one: one.in_response, default=None)


def check_held_out(
    held_out: list[HeldOut], span: float, noise: float, *, repeats: bool, unit: str = ""
) -> tuple[list[str], list[str]]:
    """Reasons and notes: a model has to predict what lies between runs, but not to extrapolate.

    `repeats`: whether some run holds two periods or more. `unit`: of the response; without one
    errors are plain numbers.
    """
    reasons, notes = [], []
    cure = (
        "Use fewer parameters, or model a drift (`--drift`)."
        if repeats
        else "No run repeats, so the part left out may hold drives that the rest never reached: "
        "record three periods or more. Otherwise use fewer parameters, or model a drift "
        "(`--drift`)."
    )
    for scheme in held_out:
        if not scheme.exceeds(noise, span):
            continue
        usual = scheme.usual(noise)
        fitted = "that of the fitted part"
        more = f"larger than {fitted}, which is zero"
        times = f"{scheme.rmse / usual:.1f} times {fitted}" if usual > 0 else more
        size = quantity(scheme.rmse, unit) if unit else f"{scheme.rmse:.3g}"
        text = f"{scheme.scheme}: held-out rmse {size} is {times}"
        if not scheme.determined:
            text = (
                f"{scheme.scheme}: without it the rest does not determine the model (the error "
                "there is larger than the whole span of what was left out)"
            )
        if scheme.scheme == "last third" and scheme.large:
            reasons.append(f"does not generalise: {text}. {cure}")
        elif scheme.runs and scheme.inside and scheme.large:
            reasons.append(
                f"not predicted: {text}, though its rate and swing lie among those of the other "
                "runs. Look at that run, or record more there."
            )
        elif scheme.scheme == "last third" and scheme.rmse > THRESHOLDS.extrapolation * usual:
            notes.append(
                f"{text}: the last periods are unlike those before them. `rapi check` names a "
                "period that stands out."
            )
        elif scheme.large or scheme.rmse > THRESHOLDS.extrapolation * usual:
            notes.append(
                f"{text}: the other runs alone do not tell how the device behaves there. With "
                "these runs the model is fitted there, too; beyond the recorded rates and swings "
                "do not trust it."
            )
    if no_run_is_predicted(held_out, noise, span):
        notes.append(
            "no run is predicted from the others, so the model is tested only at the rates and "
            "swings recorded. Record a run between two of them; if that is missed as well, the "
            "runs may be of different devices."
        )
    return reasons, notes
