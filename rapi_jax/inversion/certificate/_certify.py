"""Where an operator is monotone in the drive, exactly: the condition under which it inverts."""

import numpy as np

from rapi_jax._arguments import takes
from rapi_jax._precision import as_float64, float64
from rapi_jax.inversion._thresholds import THRESHOLDS
from rapi_jax.operators import AbstractOperator
from rapi_jax.plays._contact_intervals import Band, Pieces

from ._certificate import Certificate
from ._failures import Failure, join_failures
from ._slopes import smallest_slopes


@takes(operator=AbstractOperator)
@float64
def certify(
    operator: AbstractOperator, low: float, high: float, freq: float, *, u_pp: float | None = None
) -> Certificate:
    """Prove or refuse that `operator` inverts for every drive within `low` and `high`.

    `freq` is the scan rate, Hz; `u_pp` the peak-to-peak drive in Eq. 11, by default the whole
    range.

    >>> from rapi_jax import certify
    >>> from rapi_jax.examples import paper_device
    >>> certify(paper_device().operator, 0.75, 5.25, 10.0).invertible
    True
    >>> certify(paper_device().operator, 0.0, 40.0, 10.0).invertible  # the cubic turns over
    False
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"`low` must lie below `high`, both finite, but they are {low}, {high}.")
    u_pp = float(high - low) if u_pp is None else float(u_pp)
    plays = operator.plays(as_float64(u_pp), as_float64(freq))
    band = Band.of(plays)
    gain = np.polynomial.Polynomial([0.0, *np.asarray(operator.coefficients, float)]).deriv()
    origin = -float(operator.centred(as_float64(0.0)))
    low, high = float(low) - origin, float(high) - origin  # as plays and polynomial see it
    reasons = _broken(band, gain.coef, low, high, origin)
    failures: tuple[Failure, ...] = ()
    least = (-np.inf, low, "up")
    if not reasons:
        pieces = Pieces.of(band, low, high)
        slopes = [smallest_slopes(pieces, gain, direction) for direction in ("up", "down")]
        least = min(found.best for found in slopes)
        scale = abs(float(gain.integ()(high) - gain.integ()(low))) / (high - low)
        scale += np.abs(band.p).sum()
        failures = tuple(join_failures(slopes, THRESHOLDS.least_slope * scale, origin))
        reasons = [
            f"on a drive going {f.direction} the response does not rise with it from {f.low:.6g} "
            f"to {f.high:.6g} (slope down to {f.slope:.4g}, with "
            f"{_listed(f.plays) if f.plays else 'no play'} in contact)"
            for f in failures
        ]
    return Certificate(
        invertible=not reasons,
        low=low + origin,
        high=high + origin,
        u_pp=u_pp,
        freq=float(freq),
        slope_min=float(least[0]),
        slope_at=float(least[1]) + origin,
        slope_direction=least[2],
        failures=failures,
        crossed=tuple((i, a + origin, b + origin) for i, a, b in band.crossed_stretches(low, high)),
        negative=tuple(int(i) + 1 for i in np.flatnonzero(band.r < 0)),
        reasons=tuple(reasons),
    )


def _broken(
    band: Band, coefficients: np.ndarray, low: float, high: float, origin: float
) -> list[str]:
    numbers = (band.r, band.lam, band.eta, band.p, band.bow, band.u_0, coefficients)
    if not all(np.isfinite(x).all() for x in numbers):
        return ["a parameter is not a number"]
    ends = np.stack([band.slope(low), band.slope(high)])
    flat = np.flatnonzero((ends <= 0).any(axis=0) & (band.p != 0))
    if not flat.size:
        return []
    where = ", ".join(str(i + 1) for i in flat[:5])
    if band.bow == 0.0:
        return [f"`lam` is not positive in play {where}: its falling bound does not fall"]
    i = int(flat[0])
    turns = band.u_0 - band.lam[i] / (2.0 * band.bow) + origin
    return [
        f"`lam + 2 bow (u - u_0)` is not positive all over the range in play {where}: its falling "
        f"bound turns over at {turns:.6g}"
    ]


def _listed(plays: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, plays[:5])) + (", ..." if len(plays) > 5 else "")
    return f"play{'s' if len(plays) > 1 else ''} {shown}"
