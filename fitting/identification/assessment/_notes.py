"""Notes to a verdict, which do not speak against the fit: what its data leave open, bounds."""

import operator

import equinox as eqx
import jax
import numpy as np

from fitting.identification._parameter_vector import as_device
from fitting.identification.data_checks._clock_jitter import describe_jitter
from fitting.identification.data_checks._drive_character import describe_repetition
from fitting.identification.data_checks.holds._sweeps import describe_creep
from fitting.identification.data_checks.readings._doubtful import describe_doubtful_readings
from fitting.identification.problem._problem import Problem, Solution
from rapi_jax.internal import Band

from ._inversion import describe_missing_inverse


def describe_open_points(
    problem: Problem, solution: Solution, stderr: np.ndarray, undetermined: tuple[str, ...]
) -> list[str]:
    """What the data leave open, bounds that were reached, and plays without hysteresis."""
    notes = []
    recording = problem.recording
    notes += describe_creep(recording)
    notes += describe_doubtful_readings(recording)
    errors = [
        solution.error[row, problem.data.sample[row] >= 0][: run.drive.size]
        for row, run in enumerate(recording.runs)
    ]
    notes += describe_jitter(recording, errors)
    if recording.one_rate:
        which = "one scan rate" if max(recording.rates) > 0 else "no scan rate"
        notes.append(
            f"{which}: the rate dependence{_named(problem, 'zeta', 'kappa')} rests on the "
            "shape of one loop, and a lag of the device or its reading (delay, amplifier, servo) "
            "cannot be told from hysteresis. Record a second rate before predicting at another."
        )
    if len(recording.amplitudes) == 1:
        notes.append(
            f"one swing: how thresholds grow with the swing{_named(problem, 'alpha')} is assumed, "
            "not measured. Record a second one, half as large, before compensating at another."
        )
    if not any(run.drive.periods > 1 for run in recording.runs):
        cure = describe_repetition(recording)
        notes.append(
            "nothing repeats: noise is taken as what changes from sample to sample. "
            + (cure or "Record three periods or more of one drive to measure it.")
        )
    names = problem.names
    bound = [
        n
        for n, at in zip(problem.vector.names, bounded_parameters(problem, solution), strict=True)
        if at
    ]
    if bound:
        notes.append(
            f"at a bound: {', '.join(bound)}. The data ask for less or more than is allowed."
        )
    values = solution.values
    weak = [
        names[i]
        for i in range(problem.vector.size)
        if problem.free[i]
        and names[i] not in (*undetermined, problem.constant)  # an offset has no size of its own
        and stderr[i] > abs(values[i])
        and values[i] != 0
    ]
    if weak:
        notes.append(f"standard error larger than the value: {', '.join(weak)}.")
    if recording.response_origin == "run":
        notes.append(
            f"the zero of the response is another in each run: {problem.constant} is the mean of "
            "what the runs have, and says nothing of the device."
        )
    notes += _describe_crossed_bounds(problem, solution)
    notes += describe_missing_inverse(problem, solution)
    return notes


def _named(problem: Problem, *names: str) -> str:
    found = [name for name in names if any(part.name == name for part in problem.vector.parts)]
    return f" ({found[0]})" if found else ""


def bounded_parameters(problem: Problem, solution: Solution) -> np.ndarray:
    """Which of the model's parameters ended at a bound."""
    return solution.solver.at_bound[: problem.vector.size] & problem.free & ~problem.linear


def _describe_crossed_bounds(problem: Problem, solution: Solution) -> list[str]:
    """One note on plays whose two bounds cross, with where."""
    runs = problem.recording.runs
    ends = np.array([[0.0, run.drive.value.min(), run.drive.value.max()] for run in runs])
    plays, centred = jax.tree_util.tree_map(
        np.asarray,
        _plays_of_runs(
            problem.model(solution.values).operator,
            *map(as_device, (problem.data.u_pp, problem.data.freq, ends)),
        ),
    )
    places: dict[int, tuple[float, float]] = {}
    for row in range(len(runs)):
        band = Band.of(jax.tree_util.tree_map(operator.itemgetter(row), plays))
        zero, low, high = map(float, centred[row])
        for play, begin, end in band.crossed_stretches(low, high):
            first, last = places.get(play, (np.inf, -np.inf))
            places[play] = min(first, begin - zero), max(last, end - zero)
    if not places:
        return []
    unit = problem.recording.drive_unit
    where = ", ".join(
        f"play {play} from {begin:.3g} to {end:.3g} {unit}"
        for play, (begin, end) in sorted(places.items())
    )
    return [
        f"plays without hysteresis on part of the drive's range: {where}. Their two bounds "
        "cross there. Their response stays monotone, and nothing needs to be done."
    ]


@eqx.filter_jit
def _plays_of_runs(model, u_pp, freq, drives):
    """The plays of each run, and `drives` (`runs any`) counted from the operator's origin."""
    return jax.vmap(model.plays)(u_pp, freq), model.centred(drives)
