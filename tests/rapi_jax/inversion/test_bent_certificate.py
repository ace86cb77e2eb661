"""The certificate where falling bounds bend, against brute force: slopes from a plain loop."""

import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import RAPI, NotInvertible, certify
from rapi_jax.operators import Fields, GeneralRAPI, Plays
from rapi_jax.operators._base import AbstractOperator

FREQ = 10.0


class Bent(AbstractOperator):
    """Any thresholds, shapes, weights and bend, counted from any origin."""

    r: object
    lam: object
    eta: object
    p: object
    bow: object
    u_0: object
    d: object
    d_0: object
    v_0: object
    count: int
    fields = Fields("d", "d_0", "v_0")

    def plays(self, u_pp, freq):
        del u_pp, freq
        return Plays(self.r, self.lam, self.eta, self.p, self.bow, self.u_0)

    def couplings(self, u_pp, freq):
        del u_pp, freq
        return {}


def bent(rng, *, weights, crossed=False, strong=0.95, plays=(1, 8)):
    """A random operator and a range on which its falling bounds rise; `weights` may be negative."""
    n = int(rng.integers(*plays))
    low = float(rng.uniform(-2.0, 2.0))
    high = low + float(rng.uniform(0.5, 5.0))
    origin = float(rng.choice([0.0, rng.uniform(-2.0, 2.0)]))
    r = rng.uniform(0.0, 0.4 * (high - low), n) - (0.02 if crossed else 0.0)
    lam = np.exp(rng.uniform(-0.7, 0.7, n if rng.random() < 0.5 else 1)) * np.ones(n)
    eta = rng.uniform(-0.5, 2.0, n)
    u_0 = float(rng.uniform(low - 1.0, high + 1.0)) - origin
    farthest = max(abs(low - origin - u_0), abs(high - origin - u_0))
    bow = float(rng.uniform(-strong, strong)) * lam.min() / (2.0 * farthest)
    p = rng.normal(*weights, n)
    d = rng.normal([3.0, 0.0, 0.0, 0.0], [2.0, 0.3, 0.1, 0.02])[: int(rng.integers(1, 5))]
    numbers = (r, lam, eta, p, bow, u_0, d, rng.normal(), origin)
    return Bent(*(jnp.asarray(x) for x in numbers), n), low, high


def smallest_slope(operator, low, high, rng, *, histories=300, turns=50):
    """The smallest slope met along random histories from Eq. 13, and where; by finite steps."""
    r, lam, eta, p, bow, u_0, d, _, origin = (
        np.asarray(getattr(operator, name))
        for name in ("r", "lam", "eta", "p", "bow", "u_0", "d", "d_0", "v_0")
    )
    powers = [*d[::-1], 0.0]

    def upper(x):
        return lam * x + eta * r + bow * (x - u_0) ** 2

    def respond(u, state):
        x = u[:, None] - origin
        new = np.maximum(x - r, np.minimum(upper(x), state))
        return new @ p + np.polyval(powers, x[:, 0]), new

    begin = low - origin
    state = np.tile(np.maximum(begin - r, upper(begin)), (histories, 1))
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
    rng = np.random.default_rng(15)
    gaps = []
    for _ in range(40):
        operator, low, high = bent(rng, weights=weights, crossed=crossed)
        certificate = certify(operator, low, high, FREQ)
        seen, _ = smallest_slope(operator, low, high, rng)
        assert np.isfinite(certificate.slope_min)
        assert seen >= certificate.slope_min - 1e-5 * (1 + abs(certificate.slope_min))
        gaps.append(seen - certificate.slope_min)
    assert np.median(gaps) < 5e-3  # and it is reached, so not merely a bound


def grid_slopes(operator, low, high, size=400):
    """The slope at each of many drives after each of many last turns, from the definition alone."""
    r, lam, eta, p, bow, u_0, d = (
        np.asarray(getattr(operator, n)) for n in ("r", "lam", "eta", "p", "bow", "u_0", "d")
    )
    at, turn = (np.linspace(low, high, n) - float(operator.v_0) for n in (size, size + 1))
    gain = np.polynomial.Polynomial([0.0, *d]).deriv()(at)

    def upper(x):
        return lam * x[:, None] + eta * r + bow * (x[:, None] - u_0) ** 2

    lower = at[:, None] - r
    crossed = lower > upper(at)
    falls = np.where(crossed, p, p * (lam + 2 * bow * (at[:, None] - u_0)))
    up = (lower[:, None] >= upper(turn)[None]) | crossed[:, None]
    down = ((turn[:, None] - r)[None] >= upper(at)[:, None]) | crossed[:, None]
    rising = np.where(up, p, 0.0).sum(axis=2) + gain[:, None]
    falling = np.where(down, falls[:, None], 0.0).sum(axis=2) + gain[:, None]
    before = turn[None] <= at[:, None]
    return np.concatenate([rising[before], falling[~before]])


@pytest.mark.parametrize("count", [60, pytest.param(200, marks=pytest.mark.slow)])
def test_no_turn_and_place_of_a_grid_has_a_smaller_slope(count):
    """Strong bends and many plays, whose contacts change order close to where they should."""
    rng = np.random.default_rng(20)
    gaps = []
    for _ in range(count):
        operator, low, high = bent(rng, weights=(0.0, 1.0), plays=(12, 13), strong=0.99)
        least = certify(operator, low, high, FREQ).slope_min
        seen = grid_slopes(operator, low, high).min()
        assert seen >= least - 1e-9 * (1 + abs(least))
        gaps.append(seen - least)
    assert np.median(gaps) < 5e-2


@pytest.mark.parametrize("count", [60, pytest.param(300, marks=pytest.mark.slow)])
def test_models_that_cannot_be_inverted_are_all_refused_with_the_place(count):
    """Those on which a history was seen to fall; and the place holds one."""
    rng = np.random.default_rng(16)
    found, inverted = 0, 0
    while found < count:
        operator, low, high = bent(rng, weights=(0.2, 1.0), crossed=bool(found % 2))
        least, where = smallest_slope(operator, low, high, rng, histories=60, turns=25)
        certificate = certify(operator, low, high, FREQ)
        if least > -1e-3:
            inverted += certificate.invertible
            continue
        found += 1
        assert not certificate.invertible
        room = 1e-6 * (high - low)
        assert any(f.low - room <= where <= f.high + room for f in certificate.failures)
        with pytest.raises(NotInvertible, match="does not rise"):
            certificate.require()
    assert inverted > count / 5  # so not everything is refused


def test_what_is_refused_has_a_history_that_falls():
    """The one that the certificate tells of: down from the highest drive, or up from the lowest."""
    rng = np.random.default_rng(17)
    refused = 0
    while refused < 60:
        operator, low, high = bent(rng, weights=(0.2, 1.0))
        certificate = certify(operator, low, high, FREQ)
        if certificate.invertible or certificate.slope_min > -0.2:
            continue
        refused += 1
        seen, _ = smallest_slope(operator, low, high, rng, turns=200)
        assert seen < 0.0


def test_a_stretch_ends_where_the_slope_is_zero():
    """One play of no threshold; falling, its bound is u + 0.2 (u - 1)^2, its weight -3, G' = 5."""
    operator = GeneralRAPI(
        alpha=0.0, zeta=(0.0, 0.0), lam=1.0, eta=0.0, a=-3.0, b=(0.0, 0.0), d=(5.0,),
        bow=0.2, u_0=1.0, plays=1,
    )  # fmt: skip
    got = certify(operator, 1.0, 4.0, FREQ)
    flat = 1.0 + (2.0 / 3.0) / 0.4  # 5 - 3 (1 + 0.4 (u - 1)) = 0
    touch = 1.0 + (np.sqrt(3.4) - 1.0) / 0.4  # u + 0.2 (u - 1)^2 = 4: in contact, fallen from 4
    assert [f.direction for f in got.failures] == ["down"]
    assert got.failures[0].low == pytest.approx(flat, abs=1e-6)
    assert got.failures[0].high == pytest.approx(touch, abs=1e-12)
    assert got.slope_at == pytest.approx(touch, abs=1e-12)
    assert got.slope_min == pytest.approx(2.0 - 1.2 * (touch - 1.0), abs=1e-12)
    narrow = flat + 0.2 * (flat - 1.0) ** 2  # from here the contact comes only at `flat`
    assert certify(operator, 1.0, narrow - 1e-3, FREQ).invertible
    assert not certify(operator, 1.0, narrow + 1e-3, FREQ).invertible


def test_a_bow_of_zero_changes_no_bit():
    fields = dict(alpha=0.4, lam=(0.9, 1.3, 0.8), eta=0.8, d=(9.0, -2.0, 0.3), d_0=3.0, plays=3)
    straight = RAPI(**fields, zeta=4e-3, a=-0.7, b=0.3)
    bowed = GeneralRAPI(**fields, zeta=(4e-3, 0.0), a=-0.7, b=(0.3, 0.0), bow=0.0, u_0=2.0)
    for low, high in ((0.0, 4.0), (1.0, 3.0), (-2.0, 5.0)):
        assert certify(straight, low, high, FREQ) == certify(bowed, low, high, FREQ)


def test_a_slight_bow_changes_little():
    """Through another branch of the formulas, the straight case is the limit."""
    rng = np.random.default_rng(18)
    for _ in range(50):
        operator, low, high = bent(rng, weights=(0.5, 0.5), strong=1e-9)
        slight = certify(operator, low, high, FREQ)
        straight = Bent(
            *(getattr(operator, n) for n in ("r", "lam", "eta", "p")), jnp.zeros(()),
            *(getattr(operator, n) for n in ("u_0", "d", "d_0", "v_0", "count")),
        )  # fmt: skip
        exact = certify(straight, low, high, FREQ)
        assert slight.slope_min == pytest.approx(exact.slope_min, abs=1e-6)


@pytest.mark.parametrize("bow, ends", [(0.2, 0.5), (-0.2, 5.5)])
def test_a_falling_bound_that_turns_over_in_the_range_is_refused(bow, ends):
    operator = GeneralRAPI(
        alpha=0.2, zeta=(0.0, 0.0), lam=1.0, eta=1.0, a=1.0, b=(0.0, 0.0), d=(5.0,),
        bow=bow, u_0=3.0, plays=2,
    )  # fmt: skip
    got = certify(operator, 0.0, 6.0, FREQ)
    assert not got.invertible and got.failures == ()
    assert f"play 1, 2: its falling bound turns over at {ends:g}" in got.reasons[0]
    inner = (0.6, 5.0) if bow > 0 else (1.0, 5.4)
    assert certify(operator, *inner, FREQ).invertible


def test_a_bow_that_is_not_a_number_is_refused():
    for name in ("bow", "u_0"):
        bend = {"bow": 0.01, "u_0": 1.0} | {name: np.nan}
        operator = GeneralRAPI(
            alpha=0.2, zeta=(0.0, 0.0), lam=1.0, eta=1.0, a=1.0, b=(0.0, 0.0), d=(5.0,),
            plays=2, **bend,
        )  # fmt: skip
        got = certify(operator, 0.0, 1.0, FREQ)
        assert not got.invertible and "not a number" in got.reasons[0]


def test_crossed_stretches_are_those_of_a_fine_grid():
    rng = np.random.default_rng(19)
    kinds = set()
    for _ in range(300):
        operator, low, high = bent(rng, weights=(1.0, 0.0), crossed=True)
        certificate = certify(operator, low, high, FREQ)
        u = np.linspace(low, high, 2001)
        x = u[:, None] - np.asarray(operator.v_0)
        r, lam, eta = (np.asarray(getattr(operator, n)) for n in ("r", "lam", "eta"))
        bend = float(operator.bow) * (x - float(operator.u_0)) ** 2
        crossed = x - r > lam * x + eta * r + bend
        said = np.zeros_like(crossed)
        for play, begin, end in certificate.crossed:
            said[:, play - 1] |= (u >= begin) & (u <= end)
        assert (said != crossed).sum() <= 4 * len(certificate.crossed)
        kinds |= {(c[0], c[-1], int(np.abs(np.diff(c)).sum())) for c in crossed.T.astype(int)}
    # in all of the range, none, at either end, and at both or neither
    assert {(1, 1, 0), (0, 0, 0), (0, 1, 1), (1, 0, 1)} <= kinds
    assert {(1, 1, 2), (0, 0, 2)} & kinds
