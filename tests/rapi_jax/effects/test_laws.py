"""What every effect must obey, over all of them."""

import dataclasses
import functools

import equinox as eqx
import examples_drive
import examples_optical
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import Drive, Recording, effects
from rapi_jax._ecdl import ECDL, respond
from rapi_jax._parameter import follow, parameters
from rapi_jax._waveform import triangle
from rapi_jax.effects import (
    AbstractCouplingEffect,
    AbstractDriveEffect,
    AbstractEffect,
    AbstractInvertible,
    AbstractLagEffect,
    AbstractLinearEffect,
    AbstractOpticalEffect,
    ResidualSummary,
)
from rapi_jax.effects.base._first_order_lags import respond_linear
from rapi_jax.effects.base._linear import Past
from rapi_jax.examples import paper_device
from rapi_jax.io import read_model, write_model
from rapi_jax.sampling._batch import batch, on_device, to_batch
from rapi_jax.sampling._history import History
from rapi_jax.sampling._sampling_grid import row_of

EXAMPLES = {**examples_drive.EXAMPLES, **examples_optical.EXAMPLES}
NAMES = {
    "creep", "resonance", "amplifier_lowpass", "slew_limit", "delay", "saturation", "quantisation",
    "rate_law", "amplitude_law", "drift", "gain_drift", "mode_hop", "etalon", "pickup",
    "current_coupling",
}  # fmt: skip
ALL = pytest.mark.parametrize("name", sorted(NAMES))
SMOOTH = pytest.mark.parametrize("name", sorted(n for n, e in EXAMPLES.items() if e.smooth))
UNDONE = pytest.mark.parametrize(
    "name", sorted(n for n, e in EXAMPLES.items() if isinstance(e, AbstractInvertible))
)
OPERATOR = paper_device().operator
NOISE = 0.020  # GHz, of one reading


def turned(drive, samples, per_period):
    """The drive from another instant on, so that its corners lie between samples."""
    cycles = np.arange(samples) / per_period + 0.123
    value = 3.0 + 1.5 * (1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles, 1.0)))
    time = np.arange(samples) / per_period / drive.rate
    return dataclasses.replace(drive, time=time, value=value)


def triangles(per_period=500, periods=2):
    drives = triangle((10.0, 40.0), amplitude=3.0, bias=3.0, samples=100, periods=periods)
    return tuple(turned(d, per_period * periods, per_period) for d in drives)


def on_rows(drives):
    rows = [row_of(d, 0.0, lead=True) for d in drives]
    return on_device(batch(drives, rows)), rows


_respond = eqx.filter_jit(respond)


@functools.cache
def usual_rows():
    return on_rows(triangles())[0]


@functools.cache
def without_effects():
    return np.asarray(_respond(ECDL(OPERATOR), usual_rows()))


def answer(effect, rows):
    return _respond(ECDL(OPERATOR, (effect,)), rows)


def moved(effect, path, value):
    return eqx.tree_at(lambda e: follow(e, path), effect, jnp.asarray(value, dtype=float))


# --- what they are


def test_every_effect_is_there_under_its_name():
    assert set(EXAMPLES) == NAMES
    for name, effect in EXAMPLES.items():
        assert type(effect).name == name
        assert getattr(effects, type(effect).__name__) is type(effect)
        assert type(effect).__doc__ and isinstance(effect.smooth, bool)
        assert effect.label and effect.remedy.endswith(".")
    exported = {
        cls
        for cls in vars(effects).values()
        if isinstance(cls, type) and issubclass(cls, AbstractEffect) and hasattr(cls, "name")
        and not cls.__name__.startswith("Abstract")
    }  # fmt: skip
    assert exported == {type(effect) for effect in EXAMPLES.values()}


@ALL
def test_parameters_have_units_bounds_and_are_all_the_leaves(name):
    declared = parameters(EXAMPLES[name])
    assert len(declared) == len(jax.tree.leaves(EXAMPLES[name]))
    for p in declared:
        assert p.unit and p.unit.format(x="GHz", u="V")
        for effect in (EXAMPLES[name], type(EXAMPLES[name])()):
            value = float(follow(effect, p.path))
            assert p.bounds[0] <= value <= p.bounds[1], p.name
    free = [p for p in declared if not p.held]
    assert free
    for p in free:
        value = float(follow(EXAMPLES[name], p.path))
        assert p.bounds[0] < value < p.bounds[1], f"{p.name} of the example is on a bound"


# --- the identity


@ALL
def test_an_effect_does_nothing_at_its_defaults_and_something_at_its_size(name):
    idle = type(EXAMPLES[name])()
    # With a drive effect the plays are summed another way, so equal to rounding.
    rounding = 16 * np.finfo(float).eps * np.abs(without_effects()).max()
    np.testing.assert_allclose(answer(idle, usual_rows()), without_effects(), rtol=0, atol=rounding)
    change = np.asarray(answer(EXAMPLES[name], usual_rows())) - without_effects()
    assert np.isfinite(change).all()
    assert 1e-3 < np.sqrt(np.mean(change**2)) < 10.0  # GHz; the noise is 0.02


@ALL
def test_gradients_at_the_defaults_are_finite(name):
    idle = type(EXAMPLES[name])()
    for p in parameters(idle):
        if not np.isfinite(float(follow(idle, p.path))):
            continue  # no limit at all: nothing to differentiate
        assert np.isfinite(slope(idle, p.path)).all(), p.name


@eqx.filter_jit
def _slope(effect, tangent, rows):
    return eqx.filter_jvp(lambda e: respond(ECDL(OPERATOR, (e,)), rows), (effect,), (tangent,))[1]


def slope(effect, path):
    """The derivative of the response by one parameter, forward mode."""
    tangent = moved(jax.tree.map(jnp.zeros_like, effect), path, 1.0)
    return np.asarray(_slope(effect, tangent, usual_rows()))


# A step that moves the response by far more than rounding and far less than the kinks of the plays
# are apart.
STEPS = {"delay": {"tau": 1e-8}, "amplifier_lowpass": {"tau": 1e-8}}


@SMOOTH
def test_gradients_are_central_differences(name):
    effect = EXAMPLES[name]
    for p in parameters(effect):
        value = float(follow(effect, p.path))
        h = STEPS.get(name, {}).get(p.name, 1e-6 * max(abs(value), 1e-3))
        up, down = (
            np.asarray(answer(moved(effect, p.path, value + s * h), usual_rows())) for s in (1, -1)
        )
        want = (up - down) / (2 * h)
        got = slope(effect, p.path)
        floor = 1e-12 * 100.0 / h  # rounding of a response of 100 GHz
        # Samples between the two corners that a play or a clip moves by h see half of a kink.
        off = np.abs(got - want)
        assert np.quantile(off, 0.99) <= 1e-4 * np.abs(want).max() + floor, p.name
        assert np.sqrt(np.mean(off**2)) <= 1e-3 * np.sqrt(np.mean(want**2)) + floor, p.name


# --- clocks


@ALL
def test_nothing_is_known_before_it_happens(name):
    """A drive that does not repeat, changed after a sample: only a slope sees the one before."""
    rng = np.random.default_rng(3)
    time = np.arange(600) * 1e-4
    smooth = np.convolve(rng.normal(size=700), np.hanning(60), "same")[50:650]
    value = 3.0 + 1.2 * smooth / np.abs(smooth).max()
    late = value.copy()
    at = 400
    late[at:] = value[at - 1] + 0.3 * (value[at:] - value[at - 1])
    for k in (int(np.argmin(value)), int(np.argmax(value))):
        assert k < at - 1  # the numbers of the run stay the same
    both = [on_rows([Drive(time, v, 20.0, "other")])[0] for v in (value, late)]
    before, after = (np.asarray(answer(EXAMPLES[name], rows))[0, :600] for rows in both)
    last = at - isinstance(EXAMPLES[name], AbstractCouplingEffect)
    if name == "gain_drift":  # about the middle of the run, which as its u_pp is one number of it
        shift = (before - after)[1 : last - 1] / time[1 : last - 1]
        np.testing.assert_allclose(shift, shift[0], rtol=1e-6)
    else:
        assert np.array_equal(before[: last - 1], after[: last - 1])
    assert np.abs(before[at:] - after[at:]).max() > 0.1


@ALL
def test_a_finer_clock_gives_the_same_response(name):
    """To a tenth of the noise: effects see straight lines where the response is bent.

    Where an amplifier at its limit catches up with the drive, its output turns between two samples,
    and the turn is missed by half a step at most.
    """
    coarse, fine = triangles(1000), triangles(8000)
    answers = []
    for drives, every in ((coarse, 1), (fine, 8)):
        rows, places = on_rows(drives)
        full = np.asarray(answer(EXAMPLES[name], rows))
        runs = [full[k, : p.sample.size][p.sample >= 0] for k, p in enumerate(places)]
        answers.append(np.stack([run[::every] for run in runs]))
    tolerance = NOISE / 10
    if isinstance(EXAMPLES[name], effects.SlewLimit):
        fastest = 200.0 * np.ptp(without_effects()[1]) / coarse[1].u_pp  # GHz/s, at 200 V/s
        tolerance = fastest * coarse[1].step_s / 2
    assert np.abs(answers[0] - answers[1]).max() <= tolerance


@ALL
def test_jit_vmap_and_plain_calls_agree(name):
    effect = EXAMPLES[name]
    idle = jax.tree.map(
        lambda leaf: jnp.nan_to_num(leaf, posinf=50.0, neginf=-50.0), type(effect)()
    )
    two = jax.tree.map(lambda a, b: jnp.stack([a, b]), effect, idle)
    drive = triangles(120)[1]
    t, u, freq = jnp.asarray(drive.time), jnp.asarray(drive.value), jnp.array(40.0)

    def run(effect):
        return ECDL(OPERATOR, (effect,))(t, u, freq)

    plain = run(effect)
    np.testing.assert_allclose(eqx.filter_jit(run)(effect), plain, rtol=0, atol=1e-9)
    mapped = eqx.filter_jit(eqx.filter_vmap(run))(two)
    np.testing.assert_allclose(mapped[0], plain, rtol=0, atol=1e-9)
    np.testing.assert_allclose(mapped[1], run(idle), rtol=0, atol=1e-9)


# --- linear effects


@pytest.mark.parametrize(
    "name", sorted(n for n, e in EXAMPLES.items() if isinstance(e, AbstractLinearEffect))
)
def test_the_response_to_a_sine_is_given_by_the_transfer_function(name):
    effect, count, period = EXAMPLES[name], 2000, 0.05
    t = np.arange(2 * count) * (period / count)
    for harmonic in (1, 5):
        wave = np.exp(2j * np.pi * harmonic * t / period)
        found = forward(effect, t, wave.real, period)[count:]
        want = (effect.transfer(np.array([harmonic / period]))[0] * wave[count:]).real
        # A sine that is straight between samples misses the true one by this much at most.
        assert np.abs(found - want).max() <= (2 * np.pi * harmonic / count) ** 2


# --- undoing


@UNDONE
def test_what_is_undone_comes_back(name):
    effect = EXAMPLES[name]
    count, period = 2000, 0.05
    t = np.arange(2 * count) * (period / count)
    turn = 2 * np.pi * t / period
    drive = isinstance(effect, AbstractDriveEffect)
    middle, half = (3.0, 1.2) if drive else (60.0, 30.0)
    target = middle + half * (0.85 * np.sin(turn) + 0.15 * np.cos(2 * turn + 0.4))
    given = effect.inverse(jnp.asarray(t[:count]), jnp.asarray(target[:count]))
    assert given.shape == (count,)
    if alters(effect):
        assert np.abs(given - target[:count]).max() > 1e-3 * half
    back = forward(effect, t, np.tile(np.asarray(given), 2), period)[count:]
    # Straight lines between samples miss a second harmonic by (2 pi / 2000)^2 / 3 of it at most.
    dynamic = isinstance(effect, AbstractLinearEffect)
    bound = half * (2 * np.pi / count) ** 2 / 3 if dynamic else 1e-12 * middle
    assert np.abs(back - target[count:]).max() <= bound


def alters(effect):
    """Others pass what stays within their limits as it is."""
    return not isinstance(effect, effects.Saturation | effects.SlewLimit)


def forward(effect, t, x, period):
    """Two periods, the first of which settles it."""
    if isinstance(effect, AbstractLagEffect):
        count = t.size // 2
        one, two = jnp.full(1, period), jnp.full(1, count)
        history = History(one, two, jnp.full(1, jnp.inf))
        rows = (jnp.asarray(t)[None, :], jnp.asarray(x)[None, :])
        out = respond_linear(effect.modes(), *rows, history, session=False, past=Past.of(1.0))
        return np.asarray(out)[0]
    assert isinstance(effect, AbstractDriveEffect | AbstractOpticalEffect)
    return np.asarray(effect(jnp.asarray(t), jnp.asarray(x)))


# --- trials


def evidence(effect=None, *, drives=None, noise=NOISE, scale=1.0, seed=0):
    """What a fit that left `effect` out would hold in its hands, but for the base's own changes."""
    drives = triangles() if drives is None else drives
    rows = to_batch(Recording.of(drives, [np.zeros(d.size) for d in drives]), lead=True)
    inside = rows.sample >= 0
    base = np.asarray(_respond(ECDL(OPERATOR), rows.device()))
    full = base if effect is None else np.asarray(answer(effect, rows.device()))
    rest = (full - base)[inside] + noise * np.random.default_rng(seed).normal(size=inside.sum())
    return ResidualSummary(
        time=rows.time[inside],
        drive=rows.u[inside],
        response=scale * base[inside],
        residual=scale * rest,
        run=np.nonzero(inside)[0],
        rates=tuple(d.rate for d in drives),
        u_pp=tuple(d.u_pp for d in drives),
        step_s=min(d.step_s for d in drives),
        noise=scale * noise,
        span=scale * float(np.ptp(base[inside])),
    )


def odd():
    """Evidence that a recording may hold, and that makes careless scales zero or infinite."""
    usual = evidence()
    flat = np.full_like(usual.response, 3.0)
    one = triangles()[:1]
    free = [dataclasses.replace(d, excitation_hz=None, waveform="other") for d in triangles()]
    return {
        "usual": usual,
        "one run": evidence(drives=one),
        "no rate": evidence(drives=free),
        "nothing left": dataclasses.replace(usual, residual=0.0 * usual.residual, noise=0.0),
        "constant residual": dataclasses.replace(usual, residual=0.0 * usual.residual + 1.0),
        "constant": dataclasses.replace(usual, response=flat, span=0.0),
        "constant drive": dataclasses.replace(
            usual, drive=flat, response=flat, u_pp=(0.0, 0.0), span=0.0
        ),
        "um": evidence(scale=1e-4),
        "late": dataclasses.replace(usual, time=usual.time + 1.7e9),
        "three samples": ResidualSummary(
            np.arange(3.0), np.arange(3.0), np.arange(3.0), np.zeros(3), np.zeros(3, dtype=int),
            (0.0,), (2.0,), 1.0, 0.0, 2.0,
        ),
        "no clock": dataclasses.replace(
            usual, time=np.concatenate([usual.time[usual.run == 0], usual.time[usual.run == 0]])
        ),
    }  # fmt: skip


ODD = odd()


@ALL
@pytest.mark.parametrize("kind", sorted(ODD))
def test_trials_are_numbers_within_bounds(name, kind):
    cls = type(EXAMPLES[name])
    found = cls.initial_guesses(ODD[kind])
    again = cls.initial_guesses(ODD[kind])
    assert len(found) <= 24 and len(found) == len(again)
    for one, other in zip(found, again, strict=True):
        assert type(one) is cls
        for p in parameters(one):
            value = float(follow(one, p.path))
            assert value == float(follow(other, p.path)), "trials must not be drawn anew"
            # "no limit" may be infinite, and a knee may be left out; what is fitted starts inside
            inside = p.bounds[0] < value < p.bounds[1]
            left_out = p.held or value == float(follow(cls.at(), p.path))
            assert inside or (left_out and p.bounds[0] <= value <= p.bounds[1]), (p.name, value)
            assert np.isfinite(value), p.name


@ALL
def test_trials_change_something(name):
    """With evidence of the effect itself there are some, and none is the identity."""
    found = type(EXAMPLES[name]).initial_guesses(evidence(EXAMPLES[name]))
    drives = triangles()
    if name == "amplitude_law":  # one amplitude cannot show most of it
        drives = (*drives, dataclasses.replace(drives[0], value=2.0 + 0.4 * drives[0].value))
        found = type(EXAMPLES[name]).initial_guesses(evidence(EXAMPLES[name], drives=drives))
    assert found
    rows, _ = on_rows(drives)
    bare = np.asarray(_respond(ECDL(OPERATOR), rows))
    for one in found:
        change = np.asarray(answer(one, rows)) - bare
        assert np.isfinite(change).all() and np.abs(change).max() > 0


# --- files


@ALL
def test_a_model_file_keeps_them(name, tmp_path):
    path = tmp_path / "model.rapi"
    ecdl = ECDL(OPERATOR, (EXAMPLES[name], type(EXAMPLES[name])()))
    write_model(path, ecdl, unit="GHz")
    read, about = read_model(path)
    assert about == {"unit": "GHz"}
    assert [type(e) for e in read.effects] == [type(e) for e in ecdl.effects]
    leaves = zip(jax.tree.leaves(read), jax.tree.leaves(ecdl), strict=True)
    assert all(np.array_equal(a, b) for a, b in leaves)
