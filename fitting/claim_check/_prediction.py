"""New runs against a fit's claim: how far a model that is left as it is misses them."""

from typing import Any

import numpy as np

from fitting.identification._thresholds import THRESHOLDS as FITTING
from fitting.identification.assessment._claim import Claim
from fitting.identification.assessment._noise import measure_run_noise
from rapi_jax import ECDL, DataError, Drive, Identified, Recording, Run, predict
from rapi_jax.internal import float64, takes, usable

from ._check import NEXT, Checked, ClaimCheck
from ._thresholds import THRESHOLDS


@takes(ecdl=ECDL, recording=Recording, claim=Claim, identified=Identified | None)
@float64
def check_claim(
    ecdl: ECDL, recording: Recording, *, claim: Claim, identified: Identified | None = None
) -> ClaimCheck:
    """Whether `ecdl` predicts the runs of a new recording as well as `claim` says.

    Nothing of the model is fitted. Only what belongs to a recording is taken from it: the zero of
    its response (of each run, where runs have their own) and, of six periods or more, its creep.

    **Arguments:**

    - `claim`: as `FitResult.claim`, in the response's unit.
    - `identified`: the range of drives that the model has seen; without it only rates and swings
      are looked at.

    Runs beyond the claim's rates, swings, hours or range are listed and not judged. The claim held
    where the rms error of each run judged is within the 95 % interval for so many runs together; a
    smaller error than claimed is no failure. Raises `DataError` where no run can be judged.

    >>> from fitting import Claim, check_claim
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> claim = Claim(
    ...     rms=0.024, low=0.011, high=0.049, noise=0.022, curvature=3.0,
    ...     rates_hz=(10.0, 40.0), swings=(4.4, 4.6), hours=1.0,
    ... )
    >>> checked = check_claim(paper_device(), recording, claim=claim)
    >>> checked.kind, len(checked.checked)
    ('prediction', 4)
    """
    use = [_samples(run, recording.response_lag_s) for run in recording.runs]
    begin = min(drive.start_s for drive in recording.drives)
    outside = [_outside(run.drive, begin, claim, identified) for run in recording.runs]
    judged = [row for row, why in enumerate(outside) if not why]
    if not judged:
        raise DataError(
            f"no run is one that the claim is of. Run {recording.runs[0].name!r}: "
            f"{'; '.join(outside[0])}. Record runs between those of the fit, or fit again with "
            "runs like these."
        )
    error = [
        np.asarray(predict(ecdl, run.drive.delayed(recording.response_lag_s))) - run.response
        for run in recording.runs
    ]
    means = [float(np.mean(error[row][use[row]])) for row in judged]
    offset = None if recording.response_origin == "run" else float(np.mean(means))
    left = _without_origin(recording, error, use, judged)
    bound = claim.high_of(len(judged))
    checked = []
    for row, run in enumerate(recording.runs):
        exact = FITTING.exact_fit * float(np.ptp(run.response[use[row]]))
        noise, _ = measure_run_noise(run, np.flatnonzero(use[row]), left[row])
        rms = float(np.sqrt(np.mean(left[row] ** 2)))
        checked.append(
            Checked(
                run.name, "", run.drive.excitation_hz, run.drive.u_pp,
                rms, claim.low, max(claim.high, exact), max(bound, exact), noise, outside[row],
            )
        )  # fmt: skip
    advice = []
    for row, one in enumerate(checked):
        if one.held is False:
            response = recording.runs[row].response[use[row]]
            advice += _explain(one, left[row], response, claim, recording.response_unit)
    if any(one.held is False for one in checked):
        advice.append(NEXT["prediction"])
    return ClaimCheck(
        "prediction", recording.response_unit, recording.drive_unit, tuple(checked),
        tuple(advice), offset,
    )  # fmt: skip


def _samples(run: Run, lag_s: float) -> np.ndarray:
    """The samples of a run that count; raises `DataError` where there are none."""
    use = usable(run, lag_s)
    use = use if use.any() else run.valid
    if not use.any():
        raise DataError(f"run {run.name!r} has no reading that is a number. Leave it out.")
    return use


def _outside(
    drive: Drive, begin: float, claim: Claim, identified: Identified | None
) -> tuple[str, ...]:
    """Why `drive`, of a session that began at `begin` (s), is not one that the claim is of."""
    found = []

    def compare(what: str, value: float, ends: tuple[float, float], slack: float, unit: str):
        if not ends[0] * (1.0 - slack) <= value <= ends[1] * (1.0 + slack):
            found.append(
                f"{what} {value:.4g} {unit}, but the claim is for {ends[0]:.4g} to {ends[1]:.4g}"
            )

    compare("a rate of", drive.rate, claim.rates_hz, THRESHOLDS.rate_slack, "Hz")
    compare("a swing of", drive.u_pp, claim.swings, THRESHOLDS.swing_slack, "peak to peak")
    if identified is not None and not identified.swings_joined and identified.amplitudes:
        slack = THRESHOLDS.swing_slack
        if not any(abs(drive.u_pp - seen) <= slack * seen for seen in identified.amplitudes):
            seen = " and ".join(f"{swing:.4g}" for swing in identified.amplitudes)
            found.append(
                f"a swing of {drive.u_pp:.4g} peak to peak, but the claim is for {seen} alone: in "
                "the recording one swing did not predict the other"
            )
    hours = (drive.start_s + float(drive.time[-1]) - begin) / 3600.0
    longest = max(THRESHOLDS.session_growth * claim.hours, THRESHOLDS.session_least)
    if hours > longest:
        found.append(f"{hours:.2g} h into its session, but the claim is for {claim.hours:.2g} h")
    if identified is not None:
        limits = identified.limits()
        low, high = float(drive.value.min()), float(drive.value.max())
        if low < limits.low_v or high > limits.high_v:
            found.append(
                f"a drive from {low:.4g} to {high:.4g}, but the fit saw {identified.drive_min:.4g} "
                f"to {identified.drive_max:.4g}"
            )
    return tuple(found)


def _without_origin(
    recording: Recording, error: list[np.ndarray], use: list[np.ndarray], judged: list[int]
) -> list[np.ndarray]:
    """The errors at the samples that count, less zero and creep of the recording, for each run."""
    drives, own = recording.drives, recording.response_origin == "run"
    rows = range(len(drives))
    columns: list[list[Any]] = [[] for _ in rows]
    for row in rows:
        shape = int(use[row].sum())
        number = row if own else 0
        one_hot = np.zeros((shape, len(drives) if own else 1))
        one_hot[:, number] = 1.0
        columns[row] = [one_hot]
    if max(drive.periods for drive in drives) >= FITTING.drift_periods:
        first = min(drive.start_s for drive in drives)
        unit = max(1.0 / drive.rate for drive in drives if drive.rate > 0)
        for row, drive in enumerate(drives):
            since = (drive.session_time[use[row]] - first) / unit
            columns[row].append(np.log10(1.0 + since)[:, None])
    design = [np.hstack(parts) for parts in columns]
    values = [one[chosen] for one, chosen in zip(error, use, strict=True)]
    rows_seen = rows if own else judged
    solution = np.linalg.lstsq(
        np.vstack([design[row] for row in rows_seen]),
        np.concatenate([values[row] for row in rows_seen]),
        rcond=None,
    )[0]
    return [value - part @ solution for value, part in zip(values, design, strict=True)]


def _explain(
    one: Checked, error: np.ndarray, response: np.ndarray, claim: Claim, unit: str
) -> list[str]:
    """What may be behind a run that the claim does not hold for, where one number explains it."""
    head = f"run {one.run!r}:"
    chance = 2.0 * np.sqrt(2.0 / error.size) * one.noise**2
    if one.rms**2 - one.noise**2 + claim.noise**2 <= one.bound**2 + chance:
        return [
            f"{head} the readings are noisier, {one.noise:.2g} {unit} against {claim.noise:.2g}; "
            "without that the claim holds. Look at the sensor, not at the model."
        ]
    centred = response - response.mean()
    gain = float((centred + error) @ centred) / float(centred @ centred)
    left = float(np.std(error - (gain - 1.0) * centred))
    if gain > 0 and left <= one.bound:
        return [
            f"{head} the response is {1.0 / gain:.4g} times what was predicted; with that factor "
            "the claim holds. Another device, another scale of the reading, or a gain that changed?"
        ]
    return []
