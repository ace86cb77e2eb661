"""Effects on the drive, on the laws, and the delay, against closed forms and plain loops."""

import dataclasses
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from examples_drive import EXAMPLES
from hypothesis import given, settings
from hypothesis import strategies as st

from rapi_jax import ECDL, RAPI, DataError, Drive, NotInvertible, predict, triangle
from rapi_jax._parameter import parameter
from rapi_jax.effects import (
    AbstractOpticalEffect,
    AmplifierLowpass,
    AmplitudeLaw,
    Delay,
    Quantisation,
    RateLaw,
    ResidualSummary,
    Saturation,
    SlewLimit,
)
from rapi_jax.effects.base._law import Law
from rapi_jax.examples import paper_device
from rapi_jax.io._model_file import read_model, write_model

# A device that passes its drive on: one play of a weight below rounding.
PLAIN = RAPI(alpha=0.1, zeta=1e-3, lam=1.0, eta=1.0, a=1e-30, b=0.0, d=(1.0,), plays=1)
RATE, SWING, BIAS = 40.0, 3.0, 3.0
SLOPE, HALF = 2 * SWING * RATE, 0.5 / RATE


def off_the_samples(samples=1001, periods=2, phase=0.3217):
    """A triangle whose corners, both, lie between samples."""
    cycles = np.arange(samples * periods) / samples + phase / samples
    value = BIAS + SWING / 2 * (1 - 2 * np.abs(1 - 2 * np.mod(cycles, 1.0)))
    step = 1.0 / (RATE * samples)
    return Drive(np.arange(value.size) * step, value, RATE, "triangle"), cycles / RATE


def through(effect, drive):
    return np.asarray(predict(ECDL(PLAIN, (effect,)), drive))


@pytest.mark.parametrize("tau", [1e-6, 1.1e-4, 2e-3])
def test_a_lag_of_a_triangle_in_closed_form(tau):
    """After a turn: `S (t - tau) + C exp(-t / tau)` with the sign of the branch, for ever."""
    drive, since = off_the_samples()
    late = np.mod(since, HALF)
    sign = np.where(np.mod(since, 2 * HALF) < HALF, 1.0, -1.0)
    kept = 2 * SLOPE * tau / (1 + np.exp(-HALF / tau))
    branch = -SWING / 2 + SLOPE * (late - tau) + kept * np.exp(-late / tau)
    np.testing.assert_allclose(
        through(AmplifierLowpass(tau=tau), drive), BIAS + sign * branch, atol=1e-11
    )


@pytest.mark.parametrize("tau", [1e-6, 1.3e-4, 0.011])
def test_a_delayed_triangle_is_the_triangle_of_earlier(tau):
    drive, since = off_the_samples()
    wave = np.abs(1 - 2 * np.mod((since - tau) * RATE, 1.0))
    expected = BIAS + SWING / 2 * (1 - 2 * wave)
    np.testing.assert_allclose(through(Delay(tau=tau), drive), expected, atol=1e-10)


def test_delay_and_lag_agree_on_branches_and_differ_after_a_turn():
    """A delay keeps on for `tau`, by `S tau` too far; a lag is there above by `S tau (1 - 1/e)`."""
    drive, since = off_the_samples(8191)
    tau = 1e-4
    late = np.mod(since, HALF)
    delay, lag = (through(e(tau=tau), drive) for e in (Delay, AmplifierLowpass))
    straight = late > 30 * tau
    np.testing.assert_allclose(delay[straight], lag[straight], atol=1e-9)
    up = np.mod(since, 2 * HALF) < HALF
    begin = up & (late < tau)
    expected = SLOPE * ((late - tau) + 2 * tau * np.exp(-late / tau) - np.abs(late - tau))
    np.testing.assert_allclose((lag - delay)[begin], expected[begin], atol=1e-9)
    assert np.ptp(expected[begin]) > 0.5 * SLOPE * tau


def test_before_the_first_sample_a_delay_gives_the_first_value():
    t, x = jnp.array([0.0, 1.0, 2.5, 3.0, 3.0]), jnp.array([5.0, 6.0, 9.0, 8.0, 8.0])
    found = Delay(tau=0.02)(t * 0.01, x)
    np.testing.assert_allclose(found, [5.0, 5.0, 5.5, 6.0, 6.0])


def slewed_by_loop(t, u, limit, parts=2000):
    """Small steps, each of which follows as far as it may."""
    value, out = u[0], [u[0]]
    for i in range(1, t.size):
        step = (t[i] - t[i - 1]) / parts
        for k in range(1, parts + 1):
            aim = u[i - 1] + (u[i] - u[i - 1]) * k / parts
            value += min(max(aim - value, -limit * step), limit * step)
        out.append(value)
    return np.array(out)


@pytest.mark.parametrize("seed", range(3))
def test_a_slew_limit_on_an_uneven_clock_against_small_steps(seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.2, 1.0, 40))
    u = np.cumsum(rng.normal(0, 1, 40))
    found = SlewLimit(limit=1.1)(jnp.asarray(t), jnp.asarray(u))
    expected = slewed_by_loop(t, u, 1.1)
    np.testing.assert_allclose(found, expected, atol=3 * 1.1 / 2000)
    assert np.abs(np.asarray(found) - u).max() > 0.5


@pytest.mark.parametrize("share", [0.97, 0.6, 0.2])
def test_a_triangle_that_is_too_steep_comes_out_as_a_smaller_one(share):
    """Steady for ever: slope `L` both ways, swing `L T / 2`, turning where it meets the drive."""
    drive, since = off_the_samples()
    swing = share * SWING
    # At a turn: SWING/2 - S d = swing/2, `d` after the drive's own.
    behind = (SWING - swing) / (2 * SLOPE)
    expected = BIAS + swing / 2 * (1 - 2 * np.abs(1 - 2 * np.mod((since - behind) * RATE, 1.0)))
    found = through(SlewLimit(limit=share * SLOPE), drive)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_slew_limit_leaves_slower_runs_alone():
    drive, _ = off_the_samples()
    np.testing.assert_allclose(through(SlewLimit(limit=1.001 * SLOPE), drive), drive.value)


def test_saturation_and_quantisation_sample_by_sample():
    drive, _ = off_the_samples()
    found = through(Saturation(low=1.7, high=4.2), drive)
    np.testing.assert_allclose(found, np.clip(drive.value, 1.7, 4.2), atol=1e-12)
    found = through(Quantisation(step=0.25, origin=1.6), drive)
    steps = (found - 1.6) / 0.25
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert np.abs(found - drive.value).max() <= 0.125 + 1e-12


@pytest.mark.parametrize("rate", [10.0, 25.0, 40.0])
def test_a_rate_law_is_another_zeta_at_each_rate(rate):
    (drive,) = triangle(rate, amplitude=3.0, bias=3.0)
    op = paper_device().operator
    other = eqx.tree_at(lambda o: o.zeta, op, op.zeta * (rate / 10.0) ** 0.7)
    found = predict(ECDL(op, (RateLaw(exponent=1.7),)), drive)
    np.testing.assert_allclose(found, predict(ECDL(other), drive), rtol=1e-12)


def test_an_amplitude_law_is_another_alpha_and_gain_in_each_run():
    (drive,) = triangle(20.0, amplitude=3.6, bias=2.8)
    op = eqx.tree_at(lambda o: o.d_0, paper_device().operator, jnp.asarray(7.0))
    other = eqx.tree_at(lambda o: o.alpha, op, op.alpha * (3.6 / 3.0) ** 0.3)
    law = AmplitudeLaw(threshold=0.3, gain=0.05, tilt=0.02, reference=3.0, centre=3.0)
    expected = 7.0 + (1 + 0.05 * 0.2 - 0.02 * 0.2) * (np.asarray(predict(ECDL(other), drive)) - 7.0)
    np.testing.assert_allclose(predict(ECDL(op, (law,)), drive), expected, rtol=1e-12)
    about = AmplitudeLaw(threshold=0.3, gain=0.05, tilt=0.02, pivot=45.0, reference=3.0, centre=3.0)
    pivot = 7.0 + 45.0
    expected = pivot + (1 + 0.05 * 0.2 - 0.02 * 0.2) * (
        np.asarray(predict(ECDL(other), drive)) - pivot
    )
    np.testing.assert_allclose(predict(ECDL(op, (about,)), drive), expected, rtol=1e-12)


@pytest.mark.parametrize("diff", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize("law", [RateLaw(), RateLaw(exponent=0.3), AmplitudeLaw()])
def test_laws_at_rest_have_finite_gradients(diff, law):
    """Rate 0 and a constant drive."""
    still = Law.of(jnp.zeros(()), jnp.zeros(()))
    value = law(still, jnp.asarray(3.0))
    assert float(value.freq) == 0.0 and float(value.u_pp) == 0.0 and float(value.gain) == 1.0
    for leaf in jax.tree.leaves(diff(lambda law: law(still, jnp.asarray(3.0)))(law)):
        assert np.isfinite(leaf).all()


@pytest.mark.parametrize("cls", [type(e) for e in EXAMPLES.values()], ids=list(EXAMPLES))
def test_the_defaults_do_nothing_and_have_finite_gradients(cls):
    drive, _ = off_the_samples()
    base = ECDL(paper_device().operator)
    with_it = ECDL(base.operator, (cls(),))
    # With an effect the plays may be summed another way, so equal to rounding: 10 plays, 3 powers.
    expected = predict(base, drive)
    rounding = 16 * np.finfo(float).eps * np.abs(expected).max()
    np.testing.assert_allclose(predict(with_it, drive), expected, rtol=0, atol=rounding)
    t, u = jnp.asarray(drive.time[:50]), jnp.asarray(drive.value[:50])
    if cls in (RateLaw, AmplitudeLaw):
        return  # see `test_laws_at_rest_have_finite_gradients`
    for diff in (jax.jacfwd, jax.jacrev):
        for leaf in jax.tree.leaves(diff(lambda e: e(t, u))(cls())):
            assert np.isfinite(leaf).all()


@pytest.mark.parametrize(
    ("effect", "field", "step"),
    [
        (AmplifierLowpass(tau=1.1e-4), "tau", 1e-8),
        (Delay(tau=1.3e-4), "tau", 1e-9),
        (Saturation(low=1.71, high=4.23), "low", 1e-7),
        (Saturation(low=1.71, high=4.23), "high", 1e-7),
        (SlewLimit(limit=150.0), "limit", 1e-5),
        (RateLaw(exponent=1.6), "exponent", 1e-6),
        (EXAMPLES["amplitude_law"], "threshold", 1e-6),
        (EXAMPLES["amplitude_law"], "gain", 1e-6),
        (EXAMPLES["amplitude_law"], "tilt", 1e-6),
    ],
)
def test_gradients_against_central_differences(effect, field, step):
    """On rows as a fit sees them; laws through the device, the others by themselves."""
    from rapi_jax._ecdl import compiled_respond
    from rapi_jax.sampling._batch import batch, on_device
    from rapi_jax.sampling._sampling_grid import row_of

    lawful = isinstance(effect, RateLaw | AmplitudeLaw)
    operator = paper_device().operator if lawful else PLAIN
    drive = off_the_samples()[0]
    drives = on_device(batch([drive], [row_of(drive, 0.0, lead=True)]))

    def answer(value):
        changed = eqx.tree_at(lambda e: getattr(e, field), effect, value)
        return compiled_respond(ECDL(operator, (changed,)), drives, None)[0]

    at = getattr(effect, field)
    found = np.asarray(jax.jacfwd(answer)(at))
    expected = np.asarray((answer(at + step) - answer(at - step)) / (2 * step))
    scale = np.abs(found).max()
    assert scale > 0
    off = np.abs(found - expected) > 1e-4 * scale
    # A sample at which a branch ends within the step has two derivatives.
    assert off.mean() < 0.005


def evidence(**changes):
    (drive,) = triangle(20.0, amplitude=3.0, bias=3.0, samples=400)
    zero = np.zeros(400)
    fields = {
        "time": drive.time, "drive": drive.value, "response": 20.0 * drive.value,
        "residual": 0.1 * np.sin(np.arange(400.0)), "run": zero.astype(int), "rates": (20.0,),
        "u_pp": (3.0,), "step_s": drive.step_s, "noise": 0.02, "span": 60.0, **changes,
    }  # fmt: skip
    return ResidualSummary(**fields)


ODD = {
    "one run": {},
    "no rate": {"rates": (0.0,)},
    "constant": {"drive": np.full(400, 3.0), "response": np.full(400, 9.0), "u_pp": (0.0,)},
    "no noise": {"noise": 0.0, "residual": np.zeros(400)},
    "two runs": {"run": np.repeat([0, 1], 200), "rates": (10.0, 40.0), "u_pp": (3.0, 2.0)},
    "slow": {"rates": (1e-3,)},
}


def test_a_limit_that_only_the_steepest_part_of_a_sine_meets_is_tried():
    (drive,) = triangle(20.0, amplitude=3.0, bias=3.0, samples=400)
    for name, value in (
        ("sine", 3.0 + 1.5 * np.sin(2 * np.pi * 20.0 * drive.time)), ("triangle", drive.value),
    ):  # fmt: skip
        slopes = np.abs(np.diff(value) / np.diff(drive.time))
        found = [float(e.limit) for e in SlewLimit.initial_guesses(evidence(drive=value))]
        assert any(0.95 < limit / slopes.max() < 0.99 for limit in found), name
        assert len(found) == (6 if name == "sine" else 4)
        assert min(found) < 0.7 * slopes.max()


@pytest.mark.parametrize("case", list(ODD))
@pytest.mark.parametrize("cls", [type(e) for e in EXAMPLES.values()], ids=list(EXAMPLES))
def test_trials_are_few_and_within_bounds_whatever_the_evidence(cls, case):
    from rapi_jax._parameter import follow, parameters

    for effect in cls.initial_guesses(evidence(**ODD[case])):
        moved = False
        for p in parameters(effect):
            value, default = (np.asarray(follow(e, p.path)) for e in (effect, cls()))
            inside = p.bounds[0] < value < p.bounds[1]  # or left out, as the knee of a sharp corner
            assert np.isfinite(value).all() and (inside or value == default), p.name
            moved |= not p.held and value != default
        assert moved
    assert len(cls.initial_guesses(evidence(**ODD[case]))) <= 9


def test_trials_leave_out_what_one_run_cannot_show():
    assert (
        RateLaw.initial_guesses(evidence()) == [] and AmplitudeLaw.initial_guesses(evidence()) == []
    )
    two = evidence(**ODD["two runs"])
    assert len(RateLaw.initial_guesses(two)) == 5
    shown = AmplitudeLaw.initial_guesses(two)
    assert any(float(e.threshold) for e in shown) and any(float(e.gain) for e in shown)


def test_a_pivot_is_searched_where_the_response_reaches_from_zero_drive():
    """Beyond, a gain about it would only move each run as a whole."""
    two = evidence(**ODD["two runs"])
    low, high = AmplitudeLaw.search_ranges(two)["pivot"]
    reach = two.span * max(float(np.abs(two.drive).max() / np.ptp(two.drive)), 1.0)
    assert low < -reach and reach < high < 3.0 * reach
    offset = dataclasses.replace(two, drive=two.drive + 50.0)
    assert AmplitudeLaw.search_ranges(offset)["pivot"][1] > 5.0 * high
    assert RateLaw.search_ranges(two) == {}


def test_what_cannot_be_undone_says_why():
    t = jnp.arange(100.0) * 1e-3
    u = 3.0 + jnp.sin(2 * jnp.pi * jnp.arange(100.0) / 100.0)
    with pytest.raises(NotInvertible, match=r"slew_limit passes at most 50 V/s.*62\.\d+ V/s"):
        SlewLimit(limit=50.0).inverse(t, u)
    np.testing.assert_array_equal(SlewLimit(limit=70.0).inverse(t, u), u)
    with pytest.raises(NotInvertible, match=r"saturation passes 2.5 to 5 V.*needs 2 to 4 V"):
        Saturation(low=2.5, high=5.0).inverse(t, u)
    np.testing.assert_array_equal(Saturation(low=1.0, high=5.0).inverse(t, u), u)


class Mine(AbstractOpticalEffect):
    """An effect of a user's own."""

    name: ClassVar = "mine"
    size: jax.Array = parameter(unit="{x}", default=0.0)

    @classmethod
    def initial_guesses(cls, evidence):
        return []

    def __call__(self, t, nu):
        return nu + self.size * t


class Loose(Mine):
    """One with a field that no file would hold."""

    kind: str = eqx.field(static=True, default="a")


@pytest.mark.parametrize("name", list(EXAMPLES))
def test_a_model_file_holds_every_effect(tmp_path, name):
    for effect in (EXAMPLES[name], type(EXAMPLES[name])()):
        model = ECDL(paper_device().operator, (effect,))
        write_model(tmp_path / "m.rapi", model)
        assert eqx.tree_equal(read_model(tmp_path / "m.rapi")[0], model)


def test_a_model_file_holds_an_effect_of_ones_own(tmp_path):
    model = ECDL(paper_device().operator, (Mine(size=2.0), Saturation(high=4.0)))
    write_model(tmp_path / "m.rapi", model)
    with pytest.raises(DataError, match=r"Mine is not one of this package.*effects=\(Mine,\)"):
        read_model(tmp_path / "m.rapi")
    assert eqx.tree_equal(read_model(tmp_path / "m.rapi", effects=(Mine,))[0], model)
    with pytest.raises(ValueError, match="Loose cannot be made again from its parameters"):
        write_model(tmp_path / "n.rapi", ECDL(paper_device().operator, (Loose(kind="b"),)))
    assert not (tmp_path / "n.rapi").exists()


@given(st.integers(0, 10**6), st.floats(0.01, 2.0), st.floats(-1.0, 1.0))
@settings(max_examples=50)
def test_a_staircase_between_samples_keeps_its_mean_and_goes_one_way(seed, step, origin):
    """Against the mean of rounded values on a fine grid of each step."""
    rng = np.random.default_rng(seed)
    t, u = np.cumsum(rng.uniform(0.5, 1.5, 12)), rng.normal(size=12)
    rounded = Quantisation.at(step=step, origin=origin)
    value, bend_s, bend = map(np.asarray, rounded.between(jnp.asarray(t), jnp.asarray(u)))
    np.testing.assert_allclose(value, origin + step * np.round((u - origin) / step), atol=1e-12)
    part = (bend_s - t[:-1]) / np.diff(t)
    assert np.all((part >= 0.0) & (part <= 1.0))
    low, high = np.minimum(value[:-1], value[1:]), np.maximum(value[:-1], value[1:])
    assert np.all((bend >= low - 1e-12) & (bend <= high + 1e-12))
    mean = part * (value[:-1] + bend) / 2.0 + (1.0 - part) * (bend + value[1:]) / 2.0
    within = (np.arange(20_000) + 0.5) / 20_000
    between = u[:-1, None] + np.diff(u)[:, None] * within[None, :]
    exact = (origin + step * np.round((between - origin) / step)).mean(axis=1)
    np.testing.assert_allclose(mean, exact, atol=2.0 * step / 20_000 * (2 + np.ptp(u) / step))


@given(st.integers(0, 10**6), st.floats(-0.8, -0.2), st.floats(0.2, 0.8), st.floats(0.0, 0.5))
@settings(max_examples=50)
def test_a_corner_between_samples_is_drawn_where_it_is(seed, low, high, knee):
    """A sharp one exactly, against the mean of a fine grid; of a soft one a point on its curve."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, 40))
    u = np.cumsum(rng.uniform(-0.35, 0.35, 40))  # no step reaches from one end to the other
    for cut in (Saturation(low=low, high=high), Saturation(low=low, high=high, knee=knee + 0.01)):
        value, bend_s, bend = map(np.asarray, cut.between(jnp.asarray(t), jnp.asarray(u)))
        np.testing.assert_array_equal(value, np.asarray(cut(jnp.asarray(t), jnp.asarray(u))))
        part = (bend_s - t[:-1]) / np.diff(t)
        assert np.all((part > 0.0) & (part < 1.0))
        sent = jnp.asarray(u[:-1] + part * np.diff(u))
        np.testing.assert_allclose(bend, np.asarray(cut(jnp.asarray(bend_s), sent)), atol=1e-12)
        if not float(cut.knee):
            mean = part * (value[:-1] + bend) / 2.0 + (1.0 - part) * (bend + value[1:]) / 2.0
            within = (np.arange(20_000) + 0.5) / 20_000
            fine = u[:-1, None] + np.diff(u)[:, None] * within[None, :]
            np.testing.assert_allclose(mean, np.clip(fine, low, high).mean(axis=1), atol=1e-6)
