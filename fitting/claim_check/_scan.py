"""A compensated scan against its certificate: how straight it is, and how straight it should be."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.identification.assessment._claim import Claim
from fitting.identification.assessment._noise import measure_run_noise
from rapi_jax import DataError, Drive, Recording, Run, linearity
from rapi_jax.internal import Branch, takes, usable

from ._check import NEXT, Checked, ClaimCheck, without_noise
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class CertifiedDrive:
    """One period of a drive that a certificate lists.

    `nonlinearity`: rms that the model itself predicts of the scan, up and down, response unit.
    `notes`: in which ways the drive goes beyond what was identified.
    `span`: peak to peak of the scan that it was made for, response unit, where that is known.

    >>> from fitting import CertifiedDrive
    >>> from rapi_jax import triangle
    >>> (drive,) = triangle(20.0, amplitude=4.0, bias=3.0, samples=200)
    >>> CertifiedDrive(drive, nonlinearity=(2e-4, 2e-4)).drive.excitation_hz  # Hz
    20.0
    """

    drive: Drive
    nonlinearity: tuple[float, float] = (0.0, 0.0)
    notes: tuple[str, ...] = ()
    span: float | None = None


@takes(drives=[CertifiedDrive], recording=Recording, claim=Claim | None)
def check_scan(
    drives: Sequence[CertifiedDrive],
    recording: Recording,
    *,
    claim: Claim | None,
    unclaimed: str = "the model has no claim",
) -> ClaimCheck:
    """Whether scans made with certified drives are as straight as `claim` lets expect.

    Measured is the rms nonlinearity of each branch about its least-squares line in the middle 80 %
    of its time (`rapi_jax.linearity`), readings' noise included. Expected is at most the error of
    the model beyond the noise of the fit's readings, with what the model itself leaves of the scan,
    and the noise of these readings: between periods where there are several, else the larger of the
    fit's and of what changes from sample to sample.

    The span that a scan reached is given beside the one asked for, and judges nothing.
    Runs with a drive that is not on the list, or whose drive goes beyond what was identified, are
    measured and not judged; so are all without a `claim`, and `unclaimed` says why there is none.
    The claim held where each branch is within the limit for so many together. Raises `DataError`
    where no run is a scan made with one of the drives.

    >>> import numpy as np
    >>> from fitting import CertifiedDrive, Claim, check_scan
    >>> from rapi_jax import Recording, triangle
    >>> (drive,) = triangle(20.0, amplitude=4.0, bias=3.0, samples=200)
    >>> noise = np.random.default_rng(0).standard_normal(200)
    >>> scan = Recording.of([drive], [15.0 * drive.value + 0.02 * noise])  # GHz
    >>> claim = Claim(
    ...     rms=0.024, low=0.011, high=0.049, noise=0.02, curvature=3.0,
    ...     rates_hz=(10.0, 40.0), swings=(2.5, 4.5), hours=0.01,
    ... )
    >>> check_scan([CertifiedDrive(drive)], scan, claim=claim).held
    True
    """
    found = [_find_drive(run, drives) for run in recording.runs]
    if all(isinstance(one, str) for one in found):
        raise DataError(
            "no run is a scan that the certificate is of. Run "
            f"{recording.runs[0].name!r}: {found[0]}."
        )
    count = 2 * sum(not isinstance(one, str) and not one.notes for one in found)
    checked = [
        row
        for run, certified in zip(recording.runs, found, strict=True)
        if run.drive.repeats
        for row in _branches(recording, run, certified, claim, max(count, 1), unclaimed)
    ]
    advice = _advise(checked, recording.response_unit)
    return ClaimCheck(
        "straightness", recording.response_unit, recording.drive_unit, tuple(checked), advice
    )


def _branches(
    recording: Recording,
    run: Run,
    certified: CertifiedDrive | str,
    claim: Claim | None,
    count: int,
    unclaimed: str,
) -> list[Checked]:
    """A row for each branch of a run; `count` branches are judged."""
    lag = recording.response_lag_s
    index = np.flatnonzero(usable(run, lag))
    straight = linearity(run)
    noise, repeated = measure_run_noise(run, index, run.response[index])
    noise = noise if repeated or claim is None else max(noise, claim.noise)
    outside = (certified,) if isinstance(certified, str) else certified.notes
    outside += () if claim is not None or outside else (f"nothing is claimed of it: {unclaimed}",)
    asked = None if isinstance(certified, str) else certified.span
    reached = None if asked is None else _span(run, index)
    own = (0.0, 0.0) if isinstance(certified, str) else certified.nonlinearity
    rows = []
    for branch, left in zip((straight.up, straight.down), own, strict=True):
        least = most = bound = np.nan
        if claim is not None:
            least = _expected(0.0, 0.0, noise, branch, 0.025)  # its line may take all of an error
            most, bound = (
                _expected(without_noise(rms, claim.noise), left, noise, branch, tail)
                for rms, tail in (
                    (claim.high, 0.975),
                    (claim.high_of(count), 1.0 - 0.025 / count),
                )
            )
        rows.append(
            Checked(
                run.name, branch.direction, run.drive.excitation_hz, run.drive.u_pp,
                branch.rms_ghz, least, most, bound, noise, outside, reached, asked,
            )
        )  # fmt: skip
    return rows


def _span(run: Run, index: np.ndarray) -> float:
    """Peak to peak of the mean period of a scan: of noise little is left in it."""
    bins = max(4, min(THRESHOLDS.span_bins, int(0.5 / (run.drive.rate * run.drive.step_s))))
    at = np.minimum((run.drive.phase[index] * bins).astype(int), bins - 1)
    count = np.bincount(at, minlength=bins)
    total = np.bincount(at, run.response[index], minlength=bins)
    mean = total / np.maximum(count, 1)
    if not count.all():
        return float(np.ptp(mean[count > 0]))
    return _vertex(mean, int(np.argmax(mean))) - _vertex(mean, int(np.argmin(mean)))


def _vertex(mean: np.ndarray, at: int) -> float:
    """The extremum of the parabola through a turn's bin and its neighbours, a period closed."""
    before, turn, after = (float(mean[(at + i) % mean.size]) for i in (-1, 0, 1))
    bend = before - 2.0 * turn + after
    return turn - (after - before) ** 2 / (8.0 * bend) if bend else turn


def _expected(gap: float, left: float, noise: float, branch: Branch, tail: float) -> float:
    """The rms of a branch that is `gap` and `left` off its line, at a quantile of white noise."""
    from scipy.special import ndtri

    own = gap**2 + left**2
    chance = np.sqrt((2.0 * noise**4 + 4.0 * noise**2 * own) / branch.time.size)
    return float(np.sqrt(max(own + noise**2 + float(ndtri(tail)) * chance, 0.0)))


def _find_drive(run: Run, drives: Sequence[CertifiedDrive]) -> CertifiedDrive | str:
    """The certified drive that a run was made with, or why there is none."""
    drive = run.drive
    if not drive.repeats:
        return "its drive does not repeat, so it is no scan"
    near = [
        one for one in drives
        if abs(one.drive.rate - drive.rate) <= THRESHOLDS.same_rate * drive.rate
    ]  # fmt: skip
    if not near:
        rates = ", ".join(f"{one.drive.rate:g}" for one in drives)
        return f"it scans at {drive.rate:g} Hz, the certificate lists drives at {rates} Hz"
    off = [_distance(drive, one.drive) for one in near]
    least = int(np.argmin(off))
    if off[least] > THRESHOLDS.same_drive:
        return (
            f"its drive is {100 * off[least]:.2g} % of the swing (rms) off the drive of the "
            f"certificate at {drive.rate:g} Hz: another drive was played, or another gain stands "
            "between"
        )
    return near[least]


def _distance(measured: Drive, listed: Drive) -> float:
    """The rms distance of two drives of one rate, at the best shift, of the swing of `listed`."""
    at = measured.phase  # since its minimum, to half a hundredth of a period
    phase = np.arange(listed.size) / listed.size
    shifts = np.linspace(-0.01, 0.01, 81)
    values = [np.interp(at + s, phase, listed.value, period=1.0) for s in shifts]
    return min(float(np.sqrt(np.mean((v - measured.value) ** 2))) for v in values) / listed.u_pp


def _advise(checked: list[Checked], unit: str) -> tuple[str, ...]:
    """By how much the worst branch fails, and what to do."""
    failed = [one for one in checked if one.held is False]
    if not failed:
        return ()
    worst = max(failed, key=lambda one: one.rms / one.bound)
    return (
        f"run {worst.run!r}, {worst.branch}: {without_noise(worst.rms, worst.noise):.2g} {unit} "
        f"beyond noise, at most {without_noise(worst.bound, worst.noise):.2g} were to be expected.",
        NEXT["straightness"],
    )
