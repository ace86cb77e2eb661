"""RA-PI and PI against an implementation of Eqs. 10 to 16 that shares nothing with ours."""

import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import ECDL, PI, RAPI, Drive, predict
from rapi_jax._waveform import multisine, sine, step_and_hold, triangle
from rapi_jax.examples import paper_device, paper_drives

# Sums of a few dozen products in another order, beside responses of up to a few hundred.
EXACT = dict(rtol=1e-12, atol=1e-11)


def eq_9(u, r, lam, eta, state):
    out = []
    for x in u:
        state = max(x - r, min(lam * x + eta * r, state))
        out.append(state)
    return np.array(out)


def summed_plays(u, r, lam, eta, p):
    """Eq. 14, from Eq. 13's start at the least drive."""
    total = np.zeros(u.size)
    for r_i, lam_i, eta_i, p_i in np.broadcast(r, lam, eta, p):
        start = max(u.min() - r_i, lam_i * u.min() + eta_i * r_i)  # Eq. (13)
        total += p_i * eq_9(u, r_i, lam_i, eta_i, start)
    return total


def polynomial(u, d, d_0):
    return d_0 + sum(c * u ** (k + 1) for k, c in enumerate(d))  # Eq. (15)


def reference(u, freq, *, alpha, zeta, lam, eta, a, b, d, d_0=0.0, plays):
    """Eqs. 10 to 16, with Eq. 11 indexed as the project reads it: `alpha (i / N1)`."""
    i = np.arange(1, plays + 1)
    r = alpha * (i / plays) * np.ptp(u) / 2 + zeta * freq  # Eq. (11)
    p = a * np.exp(-b * r)
    return summed_plays(u, r, lam, eta, p) + polynomial(u, d, d_0)  # Eq. (16)


def model(**fields):
    return ECDL(RAPI(**fields))


SHARED = dict(alpha=0.4, zeta=4e-3, lam=1.4, eta=0.8, a=0.7, b=0.3, d=(16.0, -0.8, 0.02), d_0=3.0)
CASES = {
    "shared": dict(SHARED, plays=5),
    "one play, one power": dict(SHARED, d=(15.0,), plays=1),
    "fifteen plays, five powers": dict(SHARED, d=(14.0, -0.5, 0.1, -0.02, 1e-3), plays=15),
    "crossed in places": dict(SHARED, lam=0.6, plays=5),
    "a value a play": dict(
        SHARED,
        alpha=(0.3, 0.5, 0.35, 0.6),
        lam=(0.7, 1.0, 1.5, 1.2),
        eta=(1.0, 0.2, 0.6, 1.4),
        plays=4,
    ),
    "lam a play": dict(SHARED, lam=(0.7, 1.0, 1.5), plays=3),
    "growing weights": dict(SHARED, b=-0.6, plays=3),
}


@pytest.mark.parametrize("name", CASES)
def test_a_triangle_from_its_minimum(name):
    fields = {k: np.asarray(v) if isinstance(v, tuple) else v for k, v in CASES[name].items()}
    laser = model(**CASES[name])
    for drive in triangle((10.0, 80.0), amplitude=4.0, bias=3.0, samples=300, periods=2):
        expected = reference(drive.value, drive.rate, **fields)
        np.testing.assert_allclose(predict(laser, drive), expected, **EXACT)


def random_drive(hz=None):
    rng = np.random.default_rng(5)
    value = np.cumsum(rng.normal(size=300))
    value = 4.0 * (value - value.min()) / np.ptp(value) + 1.0
    return Drive(np.arange(300) * 1e-3, value, hz, "other")


@pytest.mark.parametrize("hz", [None, 35.0])
def test_any_drive_starts_from_eq_13_at_its_minimum_wherever_that_is(hz):
    drive = random_drive(hz)
    assert np.argmin(drive.value) > 0
    fields = dict(CASES["a value a play"])
    fields = {k: np.asarray(v) if isinstance(v, tuple) else v for k, v in fields.items()}
    expected = reference(drive.value, 0.0 if hz is None else hz, **fields)
    np.testing.assert_allclose(predict(model(**CASES["a value a play"]), drive), expected, **EXACT)


def test_the_start_may_be_given_as_a_place_in_each_band():
    drive = random_drive()
    fields = CASES["lam a play"]
    u, lam = drive.value, np.array(fields["lam"])
    r = fields["alpha"] * np.arange(1, 4) / 3 * np.ptp(u) / 2
    p = fields["a"] * np.exp(-fields["b"] * r)
    low = u[0] - r
    high = np.maximum(low, lam * u[0] + fields["eta"] * r)
    assert (low == high).any() and (low < high).any()  # one is crossed at the first sample
    at_minimum = np.maximum(u.min() - r, lam * u.min() + fields["eta"] * r)
    for initial in ([0.0, 0.0, 0.0], [1.0, 0.5, 0.25], [np.nan, 0.5, np.nan]):
        start = low + np.array(initial) * (high - low)
        start = np.where(np.isnan(start), at_minimum, start)
        plays = zip(r, lam, start, p, strict=True)
        h = sum(p_i * eq_9(u, r_i, lam_i, fields["eta"], s) for r_i, lam_i, s, p_i in plays)
        expected = h + polynomial(u, fields["d"], fields["d_0"])
        ours = predict(model(**fields), drive, initial=initial)
        np.testing.assert_allclose(ours, expected, **EXACT)


def test_part_of_a_run_takes_the_whole_runs_range_when_told():
    fields = CASES["shared"]
    drive = triangle(20.0, amplitude=4.0, bias=3.0, samples=200)[0]
    operator = RAPI(**fields)
    first, hz = jnp.asarray(drive.value[:80]), jnp.asarray(20.0)
    u_pp, u_min = jnp.asarray(np.ptp(drive.value)), jnp.asarray(drive.value.min())
    part = operator(first, hz, u_pp=u_pp, u_min=u_min)
    whole = reference(drive.value, 20.0, **fields)
    np.testing.assert_allclose(part, whole[:80], **EXACT)
    alone = operator(first, hz)
    np.testing.assert_allclose(alone, reference(drive.value[:80], 20.0, **fields), **EXACT)
    assert np.abs(alone - part).max() > 0.1


# --- PI


def test_pi_is_eq_8_and_14():
    r, p, d = np.array([0.2, 0.7, 1.1]), np.array([0.5, -0.2, 0.9]), (12.0, -0.3)
    laser = ECDL(PI(r=r, p=p, d=d, d_0=-2.0))
    for drive in (random_drive(), *triangle(25.0, amplitude=3.0, bias=2.0, samples=240)):
        u = drive.value
        h = summed_plays(u, r, np.ones(3), np.ones(3), p)
        np.testing.assert_allclose(predict(laser, drive), h + polynomial(u, d, -2.0), **EXACT)


def test_a_symmetric_rate_independent_rapi_is_a_pi():
    drive = sine(60.0, amplitude=4.0, bias=3.0, samples=240)[0]
    plain = dict(SHARED, lam=1.0, eta=1.0, b=0.0, zeta=0.0)
    r = 0.4 * np.arange(1, 7) / 6 * np.ptp(drive.value) / 2
    classical = PI(r=r, p=np.full(6, 0.7), d=SHARED["d"], d_0=SHARED["d_0"])
    one = predict(model(**plain, plays=6), drive)
    np.testing.assert_allclose(one, predict(ECDL(classical), drive), **EXACT)
    # and any of the four makes it another operator
    for field, value in (("lam", 1.1), ("eta", 0.8), ("b", 0.3), ("zeta", 1e-3)):
        other = predict(model(**{**plain, field: value}, plays=6), drive)
        assert np.ptp(other - one) > 1e-3, field


# --- what cannot be told apart, and what must be the same


def test_only_r_times_one_plus_eta_and_b_times_r_are_seen():
    """Thresholds `s` times as wide, with `eta` and `b` to match, shift the response and no more."""
    s, plays = 1.3, 6
    wide = dict(
        SHARED,
        alpha=s * SHARED["alpha"],
        zeta=s * SHARED["zeta"],
        eta=(1.0 + SHARED["eta"]) / s - 1.0,
        b=SHARED["b"] / s,
    )
    for drive in triangle((10.0, 50.0), amplitude=4.0, bias=3.0, samples=240):
        r = SHARED["alpha"] * np.arange(1, plays + 1) / plays * np.ptp(drive.value) / 2
        r = r + SHARED["zeta"] * drive.rate
        offset = -(s - 1.0) * np.sum(SHARED["a"] * np.exp(-SHARED["b"] * r) * r)
        moved = predict(model(**wide, plays=plays), drive)
        expected = np.asarray(predict(model(**SHARED, plays=plays), drive)) + offset
        np.testing.assert_allclose(moved, expected, **EXACT)
        assert abs(offset) > 0.1


WAVEFORMS = {
    "triangle": triangle,
    "sine": sine,
    "multisine": multisine,
}


@pytest.mark.parametrize("periods", [1, 3])
@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_a_record_that_starts_anywhere_in_its_period_gives_the_steady_state(waveform, periods):
    samples = 480  # so many that a smooth turn between two is not drawn
    drive = WAVEFORMS[waveform](
        40.0, amplitude=4.0, bias=3.0, samples=samples * periods, periods=periods
    )[0]
    # Exactly periodic, so that rolled records hold the same numbers.
    one = drive.value[:samples]
    settled = reference(np.tile(one, 3), 40.0, **SHARED, plays=5)[-samples:]
    laser = model(**SHARED, plays=5)
    for k in (0, 1, 17, 240, 241, 479):
        value = np.roll(np.tile(one, periods), k)
        rolled = Drive(drive.time, value, 40.0, waveform)
        expected = np.roll(np.tile(settled, periods), k)
        np.testing.assert_allclose(predict(laser, rolled), expected, **EXACT)


def test_a_record_that_begins_on_a_falling_branch_is_wrong_without_its_lead_in():
    """The check above could not fail if the start made no difference."""
    value = np.roll(triangle(40.0, amplitude=4.0, bias=3.0, samples=120)[0].value, 40)
    time = np.arange(120) / 4800.0
    steady, naive = (
        predict(model(**SHARED, plays=5), Drive(time, value, 40.0, w))
        for w in ("triangle", "other")
    )
    assert np.abs(steady - naive)[:10].max() > 0.1


def test_rate_enters_through_the_thresholds_alone():
    slow, fast = triangle((10.0, 100.0), amplitude=4.0, bias=3.0, samples=240)
    still = model(**dict(SHARED, zeta=0.0), plays=5)
    assert np.array_equal(predict(still, slow), predict(still, fast))
    moving = model(**SHARED, plays=5)
    assert np.abs(predict(moving, slow) - predict(moving, fast)).max() > 0.1


# --- Table 1

UP = (0.435, 0.400, 0.391, 0.400)  # rms nonlinearity, GHz, uncompensated, at 10, 20, 30, 40 Hz
DOWN = (3.28, 3.24, 3.12, 3.03)


def rms_about_a_line(t, y):
    return np.std(y - np.polyval(np.polyfit(t, y, 1), t))


@pytest.mark.parametrize("run", range(4), ids=["10 Hz", "20 Hz", "30 Hz", "40 Hz"])
def test_the_papers_device_has_the_nonlinearity_of_table_1(run):
    """ROI: 10 to 90 % of the time between the response's turning points."""
    drive = paper_drives(samples=4000, periods=2)[run]
    t, y = drive.time, np.asarray(predict(paper_device(), drive))
    one = 2000
    bottom = np.argmin(y[:one])
    top = bottom + np.argmax(y[bottom : bottom + one])
    end = top + np.argmin(y[top : min(top + one, y.size)])
    for first, last, paper in ((bottom, top, UP[run]), (top, end, DOWN[run])):
        length = last - first
        roi = slice(first + round(0.1 * length), first + round(0.9 * length) + 1)
        assert length > 900
        assert rms_about_a_line(t[roi], y[roi]) == pytest.approx(paper, rel=0.015)


def test_thresholds_are_positive_and_grow_with_rate():
    operator = paper_device().operator
    thresholds = [operator.thresholds(jnp.asarray(4.5), jnp.asarray(f)) for f in (0.0, 10.0, 40.0)]
    expected = 0.28110 * np.arange(1, 11) / 10 * 2.25
    np.testing.assert_allclose(thresholds[0], expected, rtol=1e-14)
    for f, r in zip((0.0, 10.0, 40.0), thresholds, strict=True):
        np.testing.assert_allclose(r, expected + 6.7126e-3 * f, rtol=1e-14)
        assert (np.asarray(r) > 0).all()


# --- couplings: where `zeta` may go so that no threshold of any run is negative


def test_the_coupling_is_the_edge_of_positive_thresholds():
    u_pp, freq = [4.0, 1.0, 3.0, 2.0], [10.0, 30.0, 40.0, 0.0]
    operator = model(**SHARED, plays=5).operator
    couplings = operator.couplings(u_pp, freq)
    assert set(couplings) == {("zeta", "alpha")}
    edge = couplings["zeta", "alpha"] * SHARED["alpha"]
    assert edge == pytest.approx(-SHARED["alpha"] * min(4 / 100, 1 / 300, 3 / 400))
    for factor, positive in ((0.999, True), (1.001, False)):
        moved = RAPI(**dict(SHARED, zeta=factor * edge), plays=5)
        runs = zip(u_pp, freq, strict=True)
        r = [moved.thresholds(jnp.asarray(pp), jnp.asarray(f)) for pp, f in runs]
        assert (np.min(r) > 0) == positive


def test_there_is_no_coupling_without_a_rate_or_with_an_alpha_a_play():
    assert model(**SHARED, plays=5).operator.couplings([4.0], [0.0]) == {}
    assert model(**CASES["a value a play"]).operator.couplings([4.0], [10.0]) == {}
    assert PI(r=[0.1], p=[1.0], d=[1.0]).couplings([4.0], [10.0]) == {}


# --- refusals

GOOD_RAPI = dict(SHARED, plays=3)
GOOD_PI = dict(r=(0.1, 0.2), p=(1.0, 1.0), d=(1.0,))
WRONG = [
    (RAPI, dict(plays=0), "`plays`"),
    (RAPI, dict(plays=-2), "`plays`"),
    (RAPI, dict(alpha=(0.1, 0.2)), "`alpha`.*3 of them"),
    (RAPI, dict(lam=(1.0, 1.0, 1.0, 1.0)), "`lam`.*3 of them"),
    (RAPI, dict(eta=np.ones((3, 1))), "`eta`.*3 of them"),
    (RAPI, dict(zeta=(0.0,)), "`zeta` must be a number"),
    (RAPI, dict(a=(1.0, 1.0)), "`a`.*3 of them"),  # a weight a play is allowed, two are not
    (RAPI, dict(b=(0.0, 0.0)), "`b` must be a number"),
    (RAPI, dict(d_0=(0.0,)), "`d_0` must be a number"),
    (RAPI, dict(d=1.0), "`d` must list"),
    (RAPI, dict(d=()), "`d` must list"),
    (RAPI, dict(d=((1.0, 2.0),)), "`d` must list"),
    (PI, dict(r=(0.1,)), "`r` and `p`"),
    (PI, dict(r=0.1, p=1.0), "`r` and `p`"),
    (PI, dict(d=1.0), "`d` must list"),
    (PI, dict(d=()), "`d` must list"),
]


@pytest.mark.parametrize("kind, change, message", WRONG)
def test_wrong_arguments_are_named(kind, change, message):
    good = GOOD_RAPI if kind is RAPI else GOOD_PI
    kind(**good)
    with pytest.raises(ValueError, match=message):
        kind(**{**good, **change})


def test_a_step_and_hold_has_a_steady_response_while_it_rests():
    drive = step_and_hold((1.0, 4.0, 2.0), hold_s=0.05, rise_s=0.02, step_s=1e-3)[0]
    y = np.asarray(predict(model(**SHARED, plays=5), drive))
    np.testing.assert_allclose(y, reference(drive.value, 0.0, **SHARED, plays=5), **EXACT)
    rest = np.diff(drive.value) == 0
    assert rest.sum() > 100 and (np.diff(y)[rest] == 0).all()
