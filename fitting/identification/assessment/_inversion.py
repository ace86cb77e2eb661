"""A note on where the fitted model has no inverse, within the drives that it was fitted to."""

from fitting.identification.problem._problem import Problem, Solution
from rapi_jax import Certificate, FixedRAPI, certify

NO_INVERSE = "no inverse"


def describe_missing_inverse(problem: Problem, solution: Solution) -> list[str]:
    """One note, on the run in which the response runs most against the drive; none where in none.

    Such a model predicts, but no drive can be computed from it there.
    """
    recording, operator = problem.recording, problem.model(solution.values).operator
    failed: list[Certificate] = []
    for run in recording.runs:
        low, high = float(run.drive.value.min()), float(run.drive.value.max())
        if low < high:
            found = certify(operator, low, high, run.drive.rate, u_pp=run.drive.u_pp)
            failed += [] if found.invertible else [found]
    if not failed:
        return []
    worst = min(failed, key=lambda found: found.slope_min)
    unit, per = recording.drive_unit, f"{recording.response_unit}/{recording.drive_unit}"
    why, cure = worst.reasons[0], "Record more rates and swings."
    if len(recording.amplitudes) > 1 and type(operator) is not FixedRAPI:
        cure = "Fit another operator (`--operator FixedRAPI`), or record more rates and swings."
    if worst.failures:
        why = f"slope down to {worst.slope_min:.4g} {per} at {worst.slope_at:.4g} {unit}"
    return [
        f"{NO_INVERSE}: by this model the response does not rise with the drive everywhere "
        f"between {worst.low:.4g} and {worst.high:.4g} {unit} at {worst.freq:g} Hz ({why}). It may "
        f"predict, but `rapi compensate` can make no drive there. {cure}"
    ]
