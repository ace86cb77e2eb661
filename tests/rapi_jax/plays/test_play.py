"""The play operator against a loop written from Eq. 9, its properties, and its derivative."""

import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from rapi_jax import memory, play
from rapi_jax.operators import Plays

ROOT = Path(__file__).resolve().parents[3]
NAMES = ("u", "r", "lam", "eta", "p", "start")

# A handful of sums and products of numbers near 10, in another order: a few hundred roundings.
EXACT = 1e-12
# Central differences: plays are at most bilinear in their inputs, so all that is left is rounding
# over the step, 1e-15 * 10 / 1e-6, with room for a hundred such terms.
STEP, DIFFERENCE = 1e-6, 1e-6


def loop(u, r, lam, eta, start):
    """Eq. 9, sample by sample, for one operator."""
    out = []
    for x in u:
        start = max(x - r, min(lam * x + eta * r, start))
        out.append(start)
    return np.array(out)


def loops(u, r, lam, eta, start):
    return np.stack([loop(u, *one) for one in zip(r, lam, eta, start, strict=True)], axis=1)


def bands(u, r, lam, eta):
    return u[:, None] - r, lam * u[:, None] + eta * r


@jax.jit
def plays(lower, upper, start):
    """Plays side by side."""
    return jax.vmap(play, in_axes=(1, 1, 0), out_axes=1)(lower, upper, start)


def outputs(u, r, lam, eta, start):
    """Our operators, given NumPy arrays and giving one column a play."""
    lower, upper = bands(u, r, lam, eta)
    return np.asarray(plays(jnp.asarray(lower), jnp.asarray(upper), jnp.asarray(start)))


def case(seed, samples=60, count=5):
    """A random drive and plays; the first play is crossed in places, the last long untouched."""
    rng = np.random.default_rng(seed)
    u = np.cumsum(rng.normal(0.0, 0.8, samples))
    u = 4.0 * (u - u.min()) / np.ptp(u) + 0.5
    r = np.sort(rng.uniform(0.1, 1.5, count))
    lam = rng.uniform(0.6, 2.0, count)
    eta = rng.uniform(0.3, 1.5, count)
    lam[0], eta[0] = 0.5, 0.9
    r[0] = 0.9  # crossed above (1 + eta) r / (1 - lam) = 3.42
    r[-1] = 4.2
    p = rng.normal(0.0, 1.0, count)
    start = u[0] + rng.uniform(-0.05, 0.05, count)
    return {"u": u, "r": r, "lam": lam, "eta": eta, "p": p, "start": start}


def as_jax(values):
    return [jnp.asarray(values[name]) for name in NAMES]


SEEDS = (0, 1, 2)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_cases_hold_every_kind_of_contact_and_no_tie(seed):
    c = case(seed)
    lower, upper = bands(c["u"], c["r"], c["lam"], c["eta"])
    value = loops(c["u"], c["r"], c["lam"], c["eta"], c["start"])
    before = np.concatenate([c["start"][None], value[:-1]])
    assert (lower > upper).any() and (lower < upper).any()
    assert ((value == lower) & (lower < upper)).any() and ((value == upper) & (lower < upper)).any()
    assert (value[: value.shape[0] // 5, -1] == c["start"][-1]).all()
    margins = np.abs([lower - upper, lower - before, upper - before])
    assert margins.min() > 10 * STEP


@pytest.mark.parametrize("seed", SEEDS)
def test_play_is_the_loop(seed):
    c = case(seed)
    given_ = (c["u"], c["r"], c["lam"], c["eta"], c["start"])
    assert np.abs(outputs(*given_) - loops(*given_)).max() <= EXACT
    one = play(*(jnp.asarray(b[:, 1]) for b in bands(*given_[:4])), jnp.asarray(c["start"][1]))
    assert np.abs(np.asarray(one) - loops(*given_)[:, 1]).max() <= EXACT


@pytest.mark.parametrize("seed", SEEDS)
def test_memory_is_the_weighted_loops(seed):
    c = case(seed)
    expected = loops(c["u"], c["r"], c["lam"], c["eta"], c["start"]) @ c["p"]
    assert np.abs(np.asarray(memory(*as_jax(c))) - expected).max() <= EXACT


def test_the_classical_play_is_eq_8():
    c = case(3)
    u, r = c["u"], 0.7
    expected, state = [], u[0]
    for x in u:
        state = max(x - r, min(x + r, state))
        expected.append(state)
    out = play(jnp.asarray(u - r), jnp.asarray(u + r), jnp.asarray(u[0]))
    assert np.abs(np.asarray(out) - expected).max() <= EXACT


def test_a_crossed_band_is_memoryless_with_the_lower_bound():
    u = np.linspace(2.0, 5.0, 40) + 0.3 * np.sin(np.arange(40.0))
    r, lam, eta = 0.5, 0.2, 0.5  # crossed above 0.94
    for start in (-9.0, 0.0, 9.0):
        out = play(jnp.asarray(u - r), jnp.asarray(lam * u + eta * r), jnp.asarray(start))
        assert np.array_equal(np.asarray(out), u - r)


def test_eq_13_starts_on_the_upper_bound_or_on_the_lower_where_crossed():
    r, lam, eta = np.array([0.4, 0.5]), np.array([1.5, 0.2]), np.array([1.0, 0.5])
    start = Plays(*(jnp.asarray(x) for x in (r, lam, eta, r))).lowest(jnp.asarray(3.0))
    assert np.allclose(start, [1.5 * 3.0 + 0.4, 3.0 - 0.5], rtol=1e-15, atol=0.0)


# --- Preisach's properties. Numbers are multiples of 1/64, so bounds are exact and so is equality;
# ties are common, which is what values must survive. Shapes are fixed: one compilation for all.

SAMPLES, COUNT = 24, 4
FEW = settings(max_examples=60)


def sixty_fourths(low, high):
    return st.integers(64 * low, 64 * high).map(lambda n: n / 64.0)


def drives(size=SAMPLES, low=-5, high=5):
    return st.lists(sixty_fourths(low, high), min_size=size, max_size=size).map(np.array)


@st.composite
def operators(draw):
    """Thresholds and shapes of `COUNT` plays (lam > 0), and a start anywhere."""
    columns = [
        st.integers(1, 192).map(lambda n: n / 64.0),  # r
        st.integers(1, 20).map(lambda n: n / 8.0),  # lam
        st.integers(0, 16).map(lambda n: n / 8.0),  # eta
        sixty_fourths(-8, 8),  # start
    ]
    return [np.array(draw(st.lists(column, min_size=COUNT, max_size=COUNT))) for column in columns]


@FEW
@given(drives(), operators())
def test_any_play_is_the_loop(u, operator):
    assert np.array_equal(outputs(u, *operator), loops(u, *operator))


@FEW
@given(drives(), drives(SAMPLES // 2), operators())
def test_a_larger_excursion_wipes_out_what_was_inside(after, inner, operator):
    """From a minimum to a maximum, it does not matter what happened between."""
    low, high = inner.min(), inner.max()
    direct = np.concatenate([[low], np.linspace(low, high, inner.size), [high]])
    wandering = np.concatenate([[low], inner, [high]])
    after = after[: SAMPLES - direct.size]
    one = outputs(np.concatenate([direct, after]), *operator)
    two = outputs(np.concatenate([wandering, after]), *operator)
    assert np.array_equal(one[direct.size - 1 :], two[direct.size - 1 :])


@FEW
@given(drives(SAMPLES // 2), drives(SAMPLES // 4), operators())
def test_a_minor_loop_returns_to_the_point_it_left(history, inner, operator):
    """A small loop inside a rising branch closes, and is forgotten (return-point memory)."""
    low, top = history.min(), history.max()
    inner = np.clip(inner, low, top)
    u = np.concatenate([history, [low, top], inner, [top]])
    u = np.concatenate([u, np.full(SAMPLES - u.size, top)])
    out = outputs(u, *operator)
    left, back = history.size + 1, history.size + 2 + inner.size
    assert np.array_equal(out[left], out[back])


@FEW
@given(drives(6), operators())
def test_one_period_settles(cycle, operator):
    """After one whole period from any state, every further period is the same."""
    out = outputs(np.tile(cycle, 4), *operator).reshape(4, cycle.size, COUNT)
    turn = max(cycle.argmin(), cycle.argmax())  # both extremes have been visited once
    assert np.array_equal(out[1, turn:], out[2, turn:])
    assert np.array_equal(out[2], out[3])


@FEW
@given(drives(6), drives(6), sixty_fourths(-5, 5), sixty_fourths(-5, 5), operators())
def test_loops_between_the_same_inputs_are_congruent(one, two, low, high, operator):
    """Whatever the history, a settled loop differs only by a shift of each play's output."""
    low, high = min(low, high), max(low, high)
    cycle = np.array([low, (low + high) / 2, high, high, (low + high) / 2, low])
    settled = [outputs(np.concatenate([h, np.tile(cycle, 3)]), *operator)[-6:] for h in (one, two)]
    assert np.ptp(settled[0] - settled[1], axis=0).max() == 0.0


@FEW
@given(drives(), drives(low=0), operators(), sixty_fourths(0, 3))
def test_a_higher_drive_or_state_gives_no_lower_output(u, more, operator, higher):
    r, lam, eta, start = operator
    out = outputs(u, r, lam, eta, start)
    assert (outputs(u + more, r, lam, eta, start + higher) >= out).all()


@FEW
@given(drives(SAMPLES // 3), st.lists(st.integers(0, 64), min_size=16, max_size=16), operators())
def test_only_the_path_matters_and_not_its_timing(u, places, operator):
    """Resampling anywhere between two samples leaves the outputs at these samples as they were."""
    between = np.sort(np.array(places).reshape(-1, 2) / 64.0, axis=1)
    previous = np.concatenate([u[:1], u[:-1]])[:, None]
    fine = np.concatenate([previous + between * (u[:, None] - previous), u[:, None]], axis=1)
    coarse = outputs(u, *operator)
    assert np.array_equal(outputs(fine.ravel(), *operator)[2::3], coarse)


@FEW
@given(drives(), drives(), st.integers(0, SAMPLES - 2), operators())
def test_the_future_has_no_effect(u, other, last, operator):
    changed = np.concatenate([u[: last + 1], other[last + 1 :]])
    assert np.array_equal(
        outputs(u, *operator)[: last + 1], outputs(changed, *operator)[: last + 1]
    )


@FEW
@given(drives(), operators())
@example(np.linspace(-5, 5, SAMPLES), [np.full(COUNT, x) for x in (0.5, 1.0, 1.0, 0.0)])
def test_outputs_stay_in_the_band(u, operator):
    r, lam, eta, _ = operator
    lower, upper = bands(u, r, lam, eta)
    assume((lower <= upper).any())
    out = outputs(u, *operator)
    assert (out >= lower).all() and (out <= np.maximum(lower, upper)).all()


# --- Derivatives, where there is no tie: the plain scan differentiated by JAX is the reference.


def plain_play(lower, upper, start):
    def step(value, bounds):
        value = jnp.maximum(bounds[0], jnp.minimum(bounds[1], value))
        return value, value

    return jax.lax.scan(step, start, (lower, upper))[1]


def plain_memory(u, r, lam, eta, p, start):
    column = u[:, None]
    width = (eta * r)[None, :]
    return plain_play(column - r[None, :], lam[None, :] * column + width, start) @ p


ALL = tuple(range(6))
forward = jax.jit(jax.jacfwd(memory, argnums=ALL))
reverse = jax.jit(jax.jacrev(memory, argnums=ALL))
plain = jax.jit(jax.jacfwd(plain_memory, argnums=ALL))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("jacobian", [forward, reverse], ids=["forward", "reverse"])
def test_derivatives_are_those_of_the_plain_scan(jacobian, seed):
    values = as_jax(case(seed))
    for name, ours, theirs in zip(NAMES, jacobian(*values), plain(*values), strict=True):
        assert np.abs(theirs).max() > 0.1, name
        assert np.abs(np.asarray(ours - theirs)).max() <= EXACT, name


@pytest.mark.parametrize("seed", SEEDS)
def test_derivatives_are_those_of_central_differences(seed):
    values = as_jax(case(seed))
    rng = np.random.default_rng(seed)
    value = jax.jit(memory)
    for i, (name, columns) in enumerate(zip(NAMES, forward(*values), strict=True)):
        way = rng.normal(size=values[i].shape)
        way = jnp.asarray(way / np.abs(way).max())
        moved = [
            [v + s * way if k == i else v for k, v in enumerate(values)] for s in (STEP, -STEP)
        ]
        ends = [value(*arguments) for arguments in moved]
        slope = np.asarray(ends[0] - ends[1]) / (2 * STEP)
        assert np.abs(slope - np.asarray(columns @ way)).max() <= DIFFERENCE, name


@pytest.mark.parametrize("transform", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize("column", [0, 1, 4], ids=["crossed", "ordinary", "wide"])
def test_derivatives_of_one_play(transform, column):
    c = case(1)
    lower, upper = bands(c["u"], c["r"], c["lam"], c["eta"])
    arguments = [jnp.asarray(x) for x in (lower[:, column], upper[:, column], c["start"][column])]
    ours = jax.jit(transform(play, argnums=(0, 1, 2)))(*arguments)
    theirs = jax.jit(transform(plain_play, argnums=(0, 1, 2)))(*arguments)
    for one, two in zip(ours, theirs, strict=True):
        assert np.array_equal(one, two)
    assert any(np.any(x != 0) for x in ours)


def loss(function):
    return lambda *arguments: jnp.sum(jnp.sin(function(*arguments)))


def test_second_derivatives_are_those_of_the_plain_scan():
    values = as_jax(case(0))
    names = (1, 2, 3)
    ours = jax.jit(jax.hessian(loss(memory), argnums=names))(*values)
    theirs = jax.jit(jax.hessian(loss(plain_memory), argnums=names))(*values)
    for one, two in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        # Entries are sums of 60 terms of some 100.
        assert np.abs(one - two).max() <= 1e-10


def test_grad_vmap_and_linearize_agree_with_the_jacobian():
    cases = [as_jax(case(seed)) for seed in SEEDS]
    batch = [jnp.stack(column) for column in zip(*cases, strict=True)]
    grads = jax.vmap(jax.grad(loss(memory), argnums=ALL))(*batch)
    for k, values in enumerate(cases):
        cotangent = jnp.cos(memory(*values))
        for name, grad, columns in zip(NAMES, grads, forward(*values), strict=True):
            # Sums over 60 samples of products near 10.
            assert np.abs(grad[k] - cotangent @ columns).max() <= 1e-11, name
    tangents = [jnp.ones_like(v) for v in cases[0]]
    value, push = jax.linearize(memory, *cases[0])
    expected = sum(columns @ t for columns, t in zip(forward(*cases[0]), tangents, strict=True))
    assert np.abs(value - memory(*cases[0])).max() <= EXACT
    assert np.abs(push(*tangents) - expected).max() <= EXACT


def test_each_argument_alone_has_the_same_derivative():
    values = as_jax(case(2))
    reference = plain(*values)
    for i, name in enumerate(NAMES):
        alone = jax.jit(jax.jacfwd(memory, argnums=i))(*values)
        assert np.abs(alone - reference[i]).max() <= EXACT, name


def test_a_resting_drive_is_no_kink():
    """At rest a play stays on the bound it touched, and so does its derivative."""
    u = np.array([0.0, 1.0, 2.0, 2.0, 2.0, 1.0, -1.0, -1.0, -1.0])
    r, lam, eta = (np.array([x]) for x in (0.3, 1.2, 0.8))
    values = [jnp.asarray(x) for x in (u, r, lam, eta, np.ones(1), np.zeros(1))]
    by_u, by_r, by_lam, by_eta, _, _ = forward(*values)
    assert np.array_equal(by_r[2:5, 0], [-1.0, -1.0, -1.0])
    assert np.allclose(by_r[6:, 0], 0.8) and np.allclose(by_eta[6:, 0], 0.3)
    assert np.allclose(by_lam[6:, 0], -1.0)
    assert np.allclose(by_u[2:5].sum(axis=1), 1.0) and np.allclose(by_u[6:].sum(axis=1), 1.2)


def test_plays_called_eagerly_compile_once(caplog):
    """A new compilation would cost a thousand times the call."""
    lower = jnp.linspace(0.0, 3.0, 37)
    first = play(lower, lower + 1.0, jnp.asarray(0.0))
    with jax.log_compiles(), caplog.at_level("WARNING"):
        assert np.array_equal(play(lower, lower + 1.0, jnp.asarray(0.0)), first)
        assert not [m for m in caplog.messages if "ompil" in m]
        jax.jit(lambda x: x * 1.25)(lower)
        assert [m for m in caplog.messages if "ompil" in m]  # so the log would have shown one


HOST_WITH_32_BITS = """
import jax, jax.numpy as jnp, numpy as np
from rapi_jax import memory, play, predict
from rapi_jax.examples import paper_device, paper_drives

assert not jax.config.jax_enable_x64
u = 1.0 + np.sin(np.arange(50) * 0.37)
state, expected = 0.1, []
for x in u:
    state = max(x - 0.2, min(1.3 * x + 0.9 * 0.2, state))
    expected.append(state)
one = np.ones(1)
arrays = [u, 0.2 * one, 1.3 * one, 0.9 * one, 2.0 * one, 0.1 * one]
out = play(u - 0.2, 1.3 * u + 0.9 * 0.2, np.array(0.1))
summed = memory(*arrays)
predicted = predict(paper_device(), paper_drives(samples=100)[0])
assert out.dtype == summed.dtype == predicted.dtype == jnp.float64, (out.dtype, summed.dtype)
assert np.abs(np.asarray(out) - expected).max() < 1e-14
assert np.abs(np.asarray(summed) - 2.0 * np.array(expected)).max() < 1e-14
single = jnp.asarray(u)
assert single.dtype == jnp.float32
inside = jax.jit(lambda r: play(single - r, single + r, single[0]))
assert inside(jnp.asarray(0.2)).dtype == jnp.float64
by_r = jax.jacfwd(inside)(jnp.asarray(0.2))
assert by_r.dtype == jnp.float64 and set(np.unique(by_r)) <= {-1.0, 0.0, 1.0}, by_r
assert not jax.config.jax_enable_x64 and jnp.asarray(1.5).dtype == jnp.float32
print("done")
"""


def test_a_host_with_32_bits_gets_64_and_keeps_its_flag():
    code = [sys.executable, "-W", "error", "-c", HOST_WITH_32_BITS]
    done = subprocess.run(code, capture_output=True, text=True, cwd=ROOT, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "done\n"
