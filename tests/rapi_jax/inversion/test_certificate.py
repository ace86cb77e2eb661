"""The certificate against brute force: the slope along random histories, from a plain loop."""

import json

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import RAPI, NotInvertible, certify, exact_inverse
from rapi_jax.examples import paper_device
from rapi_jax.operators import Fields, Plays
from rapi_jax.operators._base import AbstractOperator

FREQ = 10.0
MANY = [100, pytest.param(1000, marks=pytest.mark.calibration)]


class Loose(AbstractOperator):
    """Any thresholds, shapes and weights: wider than what the paper's operators can be."""

    r: object
    lam: object
    eta: object
    p: object
    d: object
    d_0: object
    count: int
    fields = Fields("d", "d_0")

    def plays(self, u_pp, freq):
        del u_pp, freq
        return Plays(self.r, self.lam, self.eta, self.p)

    def couplings(self, u_pp, freq):
        del u_pp, freq
        return {}


def loose(rng, *, weights, crossed):
    """A random operator and a range of drive; `weights`: mean and spread of `p`."""
    n = int(rng.integers(1, 8))
    low = float(rng.uniform(-2.0, 2.0))
    high = low + float(rng.uniform(0.5, 5.0))
    r = rng.uniform(0.0, 0.4 * (high - low), n) - (0.02 if crossed else 0.0)
    spread = rng.uniform(-0.7, 0.7, n if rng.random() < 0.5 else 1)
    lam = np.exp(spread) * np.ones(n)
    eta = rng.uniform(-0.5, 2.0, n)
    p = rng.normal(*weights, n)
    d = rng.normal([3.0, 0.0, 0.0], [2.0, 0.3, 0.1])
    arrays = (jnp.asarray(x) for x in (r, lam, eta, p, d))
    return Loose(*arrays, jnp.asarray(float(rng.normal())), n), low, high


def smallest_slope(operator, low, high, rng, *, histories=300, turns=50):
    """The smallest slope met along random histories from Eq. 13, and where; by finite steps."""
    r, lam, eta, p = (np.asarray(x) for x in (operator.r, operator.lam, operator.eta, operator.p))
    powers = [*np.asarray(operator.d)[::-1], 0.0]

    def respond(u, state):
        u = u[:, None]
        new = np.maximum(u - r, np.minimum(lam * u + eta * r, state))
        return new @ p + np.polyval(powers, u[:, 0]), new

    state = np.tile(np.maximum(low - r, lam * low + eta * r), (histories, 1))
    u = np.full(histories, low)
    least, where, step = np.inf, low, 1e-7 * (high - low)
    for _ in range(turns):
        new = rng.uniform(low, high, histories)
        chance = rng.random(histories)
        new = np.where(chance < 0.1, low, np.where(chance > 0.9, high, new))
        state = respond(new, state)[1]
        for sign in (1.0, -1.0):  # going on, and turning round
            near = np.clip(new + sign * np.sign(new - u) * step, low, high)
            moved = near != new
            rise = (respond(near, state)[0] - respond(new, state)[0])[moved]
            slopes = rise / (near - new)[moved]
            if slopes.size and slopes.min() < least:
                least = float(slopes.min())
                where = float(new[moved][slopes.argmin()])
        u = new
    return least, where


@pytest.mark.parametrize("crossed", [False, True])
@pytest.mark.parametrize("weights", [(1.0, 1.0), (0.5, 0.1), (-0.3, 0.3)])
def test_no_history_is_steeper_down_than_the_certificate_says(weights, crossed):
    rng = np.random.default_rng(5)
    gaps = []
    for _ in range(60):
        operator, low, high = loose(rng, weights=weights, crossed=crossed)
        certificate = certify(operator, low, high, FREQ)
        seen, _ = smallest_slope(operator, low, high, rng)
        assert seen >= certificate.slope_min - 1e-5 * (1 + abs(certificate.slope_min))
        gaps.append(seen - certificate.slope_min)
    assert np.median(gaps) < 1e-3  # and it is reached, so not merely a bound


@pytest.mark.parametrize("count", MANY)
def test_models_that_cannot_be_inverted_are_all_refused_with_the_place(count):
    """Those on which a history was seen to fall; and the place holds one."""
    rng = np.random.default_rng(6)
    found = 0
    while found < count:
        operator, low, high = loose(rng, weights=(0.2, 1.0), crossed=bool(found % 2))
        least, where = smallest_slope(operator, low, high, rng, histories=60, turns=25)
        if least > -1e-3:
            continue
        found += 1
        certificate = certify(operator, low, high, FREQ)
        assert not certificate.invertible
        room = 1e-6 * (high - low)
        assert any(f.low - room <= where <= f.high + room for f in certificate.failures)
        with pytest.raises(NotInvertible, match="does not rise"):
            certificate.require()


def monotone(rng):
    """A random model that is monotone by the plain condition: p >= 0, lam > 0, G' > 0."""
    plays = int(rng.choice([2, 10]))  # few, since each number is compiled for
    low = float(rng.uniform(-1.0, 2.0))
    high = low + float(rng.uniform(0.5, 6.0))
    each = rng.random() < 0.5
    scale = float(np.exp(rng.uniform(-2.0, 3.0)))
    roots = low - rng.uniform(0.05, 3.0), high + rng.uniform(0.05, 3.0)
    slope = -np.polynomial.Polynomial.fromroots(roots)  # positive between its roots
    slope = slope * (scale / np.abs(slope(np.linspace(low, high, 50))).max())
    operator = RAPI(
        alpha=float(np.exp(rng.uniform(-4.0, 0.0))),
        zeta=float(rng.uniform(0.0, 0.02)),
        lam=np.exp(rng.uniform(-0.7, 0.9, plays))
        if each
        else float(np.exp(rng.uniform(-0.7, 0.9))),
        eta=float(rng.uniform(-0.5, 3.0)),
        a=scale * float(rng.uniform(0.0, 1.0)),
        b=float(rng.uniform(-0.5, 1.0)),
        d=slope.integ().coef[1:],
        d_0=float(rng.normal()),
        plays=plays,
    )
    return operator, low, high


@pytest.mark.parametrize("count", MANY)
def test_random_monotone_models_are_certified_and_inverted(count):
    """At most one in a hundred refused; target -> drive -> response to 1e-9 of the span."""
    rng = np.random.default_rng(8)
    respond = eqx.filter_jit(lambda operator, u, freq: operator(u, freq))
    time = np.arange(96) / 96
    refused, worst, same = 0, 0.0, 0
    for _ in range(count):
        operator, low, high = monotone(rng)
        freq = float(rng.uniform(1.0, 60.0))
        refused += not certify(operator, low, high, freq).invertible
        wiggle = rng.normal(size=2) * 0.3
        u = -np.cos(2 * np.pi * time) + wiggle @ np.sin(2 * np.pi * np.outer([2, 5], time))
        u = low + (high - low) * (u - u.min()) / np.ptp(u)
        u = jnp.asarray(np.roll(u, -int(u.argmin())))
        y = respond(operator, u, jnp.asarray(freq))
        back = exact_inverse(operator, y, freq, within=(low - 0.04, high + 0.04))
        again = respond(operator, back, jnp.asarray(freq))
        worst = max(worst, float(jnp.abs(again - y).max() / jnp.ptp(y)))
        same += float(jnp.abs(back - u).max()) < 1e-7 * (high - low)
    assert refused <= count / 100
    assert worst < 1e-9
    assert (
        same >= 0.99 * count
    )  # thresholds wider than the scan can leave two drives with one response


def test_the_paper_device_is_certified():
    got = certify(paper_device().operator, 0.75, 5.25, 40.0)
    assert got.invertible and got.slope_min == pytest.approx(8.2, abs=0.1)  # G' > 8.2
    assert got.crossed == () and got.negative == ()
    assert got.slope_at == pytest.approx(5.25)


def test_a_crossed_band_and_a_negative_threshold_are_reported_and_not_refused():
    operator = RAPI(alpha=0.2, zeta=-0.02, lam=0.7, eta=1.0, a=1.0, b=0.0, d=(5.0,), plays=4)
    got = certify(operator, 0.0, 4.0, 30.0)
    assert got.invertible
    assert got.negative and got.crossed
    for play, begin, end in got.crossed:
        r = float(operator.thresholds(jnp.asarray(4.0), jnp.asarray(30.0))[play - 1])
        assert begin == pytest.approx(max(2.0 * r / 0.3, 0.0)) and end == 4.0


@pytest.mark.parametrize("field", ["alpha", "lam", "d"])
def test_a_parameter_that_is_not_a_number_is_refused(field):
    values = {"alpha": 0.2, "zeta": 0.0, "lam": 1.2, "eta": 1.0, "a": 1.0, "b": 0.0, "d": (5.0,)}
    values[field] = (np.nan,) if field == "d" else np.nan
    got = certify(RAPI(**values, plays=3), 0.0, 1.0, 10.0)
    assert not got.invertible and "not a number" in got.reasons[0]


def test_a_falling_bound_that_does_not_fall_is_refused():
    operator = RAPI(alpha=0.2, zeta=0.0, lam=-0.5, eta=1.0, a=1.0, b=0.0, d=(5.0,), plays=3)
    assert "`lam` is not positive" in certify(operator, 0.0, 1.0, 10.0).reasons[0]


def test_certificate_holds_plain_numbers():
    got = certify(paper_device().operator, 0.5, 12.5, 40.0)
    assert not got.invertible  # the cubic turns over at 10.1 V
    gain = np.polynomial.Polynomial([18.787, -2 * 1.0789, 3 * 0.010040])
    assert [f.high for f in got.failures] == [12.5, 12.5]
    assert got.failures[0].low == pytest.approx(gain.roots().min())
    text = json.dumps(got.to_dict(), allow_nan=False)
    assert json.loads(text)["failures"][0]["direction"] == "up"


def test_a_slope_of_zero_at_one_place_has_no_inverse():
    """The response u^3 rises everywhere, but no drive follows a scan through its middle."""
    values = {"alpha": 0.1, "zeta": 0.0, "lam": 1.0, "eta": 0.0, "a": 1e-300, "b": 0.1}
    got = certify(RAPI(**values, d=(0.0, 0.0, 1.0), plays=3), -1.0, 1.0, 10.0)
    assert not got.invertible and got.slope_min == 0.0
    with pytest.raises(NotInvertible, match="cannot be inverted between -1 and 1 at 10 Hz"):
        got.require()
    assert [f.direction for f in got.failures] == ["up", "down"]
    assert all(-1e-4 < f.low < 0.0 < f.high < 1e-4 for f in got.failures)
    assert certify(RAPI(**values, d=(1e-6, 0.0, 1.0), plays=3), -1.0, 1.0, 10.0).invertible
