"""A first period in which the device was not yet where its drive brings it back to."""

import numpy as np

from fitting._units import quantity
from rapi_jax import Run
from rapi_jax.internal import white_noise_rms

from ._fault import Fault
from ._thresholds import THRESHOLDS
from .drives._drive_reading import quieter_response
from .readings._levels import find_resolution


def check_start(run: Run, unit: str = "") -> Fault | None:
    """A first period that begins elsewhere than where it ends, of a drive with that period.

    `unit`: of the response, in which the difference is told.
    """
    miss = first_period_miss(run)
    if miss == 0.0:
        return None
    mend = ", or cut the first one off (`rapi import --skip-periods 1`)."
    if run.drive.periods < 2:
        mend = ". Or the reading drifts, which one period cannot tell."
    text = (
        f"run {run.name!r}: the response ends its first period {quantity(abs(miss), unit).strip()} "
        f"({100 * abs(miss) / run.span:.2g} % of its span) from where it began: the device came "
        "from rest or another drive, and the model takes each period for the settled one. Let the "
        f"drive run for two periods before recording{mend}"
    )
    last = int(np.flatnonzero(run.drive.period == 0)[-1])
    return Fault("unsettled start", run.name, text, ((0, last),))


def first_period_miss(run: Run) -> float:
    """How far the response ends its first whole period from where it began it, signed.

    0 where that is within noise or the steps of a digitiser, small beside the span, or not clearly
    more than in later periods, as with a drift; 0, too, where the drive itself does not close, and
    of a single period that lacks readings. Where single readings do not tell, the means of the
    first few of each period are compared: noise of drive and response is smaller in these.
    """
    drive, limits = run.drive, THRESHOLDS
    if not drive.repeats or not drive.periods or not run.span > 0:
        return 0.0
    samples = 1.0 / (drive.rate * drive.step_s)
    if samples < limits.period_samples:
        return 0.0
    if drive.periods < 2 and not run.valid.all():  # slow noise alone may part two readings
        return 0.0
    miss = _miss(run, samples, 1)
    few = int(limits.first_period_mean * samples)
    return miss if miss or few < 2 else _miss(run, samples, few)


def _miss(run: Run, samples: float, width: int) -> float:
    """The miss of the mean of `width` readings from each period's begin on; 0 where it is none.

    `samples`: in a period.
    """
    drive, limits = run.drive, THRESHOLDS
    begin = int(np.flatnonzero(drive.period == 0)[0])
    places = begin + samples * np.arange(drive.periods + 1)
    # The next period may begin a step after the last sample.
    places = places[places + width - 1 <= drive.size + 1e-6]
    if places.size < (2 if width == 1 else 3):  # means are judged beside those of later periods
        return 0.0
    at, read = np.arange(drive.size), np.flatnonzero(run.valid)
    known = quieter_response(run)[read]
    window = places[:, None] + np.arange(width)
    response = np.interp(window, read, known).mean(axis=1)
    missing = np.abs(read[:, None] - places[None, :2]).min(axis=0).max()
    value = np.interp(window, at, drive.value).mean(axis=1)
    noise = white_noise_rms(known) / np.sqrt(width)
    misses = np.diff(response)
    # What the drive's own difference moves, at twice the usual slope.
    moved = 2.0 * abs(float(value[1] - value[0])) / max(drive.u_pp, 1e-300) * run.span
    # And what a triangle's response does over readings that are missing there.
    moved += 4.0 * float(missing) / samples * run.span if missing >= 1.0 else 0.0
    later = float(np.abs(misses[1:]).max(initial=0.0))
    least = max(
        limits.first_period_miss * run.span,
        limits.first_period_noise * noise,
        limits.first_period_steps * find_resolution(run.response[read]),
        limits.first_period_later * later,
    )
    miss = float(misses[0])
    return miss if abs(miss) - moved > least else 0.0
