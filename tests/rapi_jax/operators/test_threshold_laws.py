"""FixedRAPI and MixedRAPI: against PI, RAPI and a plain loop; held values, couplings, flexible."""

import hashlib
import io
import json

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import (
    ECDL,
    PI,
    RAPI,
    DriveLimits,
    FixedRAPI,
    GeneralRAPI,
    MixedRAPI,
    Recording,
    StreamingCompensator,
    compensate,
    exact_inverse,
    linear_scan,
    predict,
)
from rapi_jax._waveform import triangle
from rapi_jax.inversion.certificate._certify import certify
from rapi_jax.io import read_model, write_model

EXACT = dict(rtol=1e-12, atol=1e-11)
# Two programs of one function: a compiler fuses their products and sums in its own ways.
ROUNDING: dict[str, float] = {"rtol": 1e-15, "atol": 0.0}
SHAPE = dict(zeta=4e-3, lam=1.4, eta=0.8, a=0.7, b=0.3, d=(16.0, -0.4, 0.02), d_0=3.0)
FIXED = FixedRAPI(rho=0.9, **SHAPE, plays=5)
MIXED = MixedRAPI(alpha=0.25, rho=0.4, **SHAPE, plays=5)
OWN = {
    "fixed": FIXED,
    "mixed": MIXED,
    "fixed, a value a play": FixedRAPI(
        **{**SHAPE, "lam": (0.7, 1.0, 1.5), "eta": (1.0, 0.2, 0.6)}, rho=(0.3, 0.9, 0.8), plays=3
    ),
    "mixed, a value a play": MixedRAPI(
        **{**SHAPE, "a": (0.7, 0.2, 0.5)}, alpha=(0.3, 0.2, 0.1), rho=(0.1, 0.0, 0.5), plays=3
    ),
}
DRIVES = [
    d
    for u_pp in (1.0, 2.5, 4.0)
    for d in triangle((10.0, 80.0), amplitude=u_pp, bias=3.0, samples=200, periods=2)
]


def thresholds(operator, u_pp, freq):
    """The class docstrings, read play by play."""
    alpha, rho = (np.asarray(getattr(operator, name, 0.0)) for name in ("alpha", "rho"))
    n, out = operator.count, []
    for i in range(1, n + 1):
        own = [float(x[i - 1]) if x.ndim else float(x) for x in (alpha, rho)]
        out.append((own[0] * u_pp / 2 + own[1]) * i / n + float(operator.zeta) * freq)
    return np.array(out)


@pytest.mark.parametrize("name", OWN)
def test_thresholds_are_those_of_the_docstring(name):
    for u_pp, freq in ((4.0, 0.0), (1.5, 40.0), (0.2, 200.0)):
        found = OWN[name].plays(jnp.asarray(u_pp), jnp.asarray(freq))
        np.testing.assert_allclose(found.r, thresholds(OWN[name], u_pp, freq), rtol=1e-14)
        weights = np.asarray(OWN[name].a) * np.exp(-0.3 * np.asarray(found.r))
        np.testing.assert_allclose(found.p, weights, rtol=1e-14)


@pytest.mark.parametrize("name", OWN)
def test_the_response_is_that_of_rapi_with_the_same_thresholds(name):
    """`RAPI` with a share a play that gives these thresholds at this swing; its oracle is Eq. 9."""
    operator = OWN[name]
    for drive in DRIVES:
        rank = np.arange(1, operator.count + 1) / operator.count
        alpha = thresholds(operator, drive.u_pp, 0.0) / rank / (drive.u_pp / 2)
        same = {k: getattr(operator, k) for k in SHAPE}
        twin = RAPI(alpha=alpha, **same, plays=operator.count)
        np.testing.assert_allclose(
            predict(ECDL(operator), drive), predict(ECDL(twin), drive), **EXACT
        )


def test_without_rho_it_is_rapi_and_without_alpha_fixed():
    apart = []
    for drive in DRIVES:
        plain = predict(ECDL(RAPI(alpha=0.25, **SHAPE, plays=5)), drive)
        mixed = predict(ECDL(MixedRAPI(alpha=0.25, rho=0.0, **SHAPE, plays=5)), drive)
        np.testing.assert_allclose(plain, mixed, **ROUNDING)
        fixed = predict(ECDL(FIXED), drive)
        mixed = predict(ECDL(MixedRAPI(alpha=0.0, rho=0.9, **SHAPE, plays=5)), drive)
        np.testing.assert_allclose(fixed, mixed, **ROUNDING)
        apart.append(np.ptp(fixed - plain))
    assert max(apart) > 0.1


def test_a_symmetric_rate_independent_fixed_rapi_is_a_pi_at_every_amplitude():
    plain = dict(SHAPE, lam=1.0, eta=1.0, b=0.0, zeta=0.0)
    classical = PI(r=0.9 * np.arange(1, 6) / 5, p=np.full(5, 0.7), d=SHAPE["d"], d_0=3.0)
    for drive in DRIVES:
        one = predict(ECDL(FixedRAPI(rho=0.9, **plain, plays=5)), drive)
        np.testing.assert_allclose(one, predict(ECDL(classical), drive), **EXACT)


# --- what the data cannot tell, and bounds that move together


def recording(rates, amplitudes, origin="session"):
    drives = [d for a in amplitudes for d in triangle(rates, amplitude=a, bias=3.0, samples=64)]
    return Recording.of(drives, [d.value for d in drives], response_origin=origin)


@pytest.mark.parametrize(
    "name, rates, amplitudes, origin, held",
    [
        ("fixed", (10.0, 40.0), (2.0, 4.0), "session", set()),
        ("fixed", (10.0, 40.0), (4.0,), "session", set()),
        ("fixed", (10.0,), (2.0, 4.0), "session", {"eta"}),
        ("fixed", (10.0, 40.0), (2.0, 4.0), "run", {"eta"}),
        ("fixed, a value a play", (10.0,), (2.0, 4.0), "session", {"rho", "zeta"}),
        ("mixed", (10.0, 40.0), (2.0, 4.0), "session", set()),
        ("mixed", (10.0,), (2.0, 4.0), "session", set()),
        ("mixed", (10.0, 40.0), (4.0,), "session", {"rho"}),
        ("mixed", (10.0,), (4.0,), "session", {"rho", "eta"}),
    ],
)
def test_what_the_data_cannot_tell_is_held(name, rates, amplitudes, origin, held):
    assert OWN[name].held(recording(rates, amplitudes, origin)) == held


def test_at_one_rate_eta_only_rescales_thresholds_that_are_fixed():
    """The response moves by the same offset at every amplitude."""
    s = 1.3
    wide = dict(SHAPE, zeta=s * 4e-3, eta=1.8 / s - 1.0, b=0.3 / s)
    moved = [
        np.asarray(predict(ECDL(FixedRAPI(rho=s * 0.9, **wide, plays=5)), d))
        - np.asarray(predict(ECDL(FIXED), d))
        for d in DRIVES[::2]
    ]
    assert np.ptp(np.concatenate(moved)) < 1e-11 and abs(moved[0][0]) > 0.1


@pytest.mark.parametrize("name, edge_is_sharp", [("fixed", True), ("mixed", False)])
def test_couplings_keep_every_threshold_positive(name, edge_is_sharp):
    u_pp, freq = [4.0, 1.0, 3.0, 2.0], [10.0, 30.0, 40.0, 0.0]
    operator = OWN[name]
    couplings = operator.couplings(u_pp, freq)
    edge = sum(slope * float(getattr(operator, by)) for (_, by), slope in couplings.items())
    assert edge < 0 and {moved for moved, _ in couplings} == {"zeta"}
    for factor in (0.999, 1.001):
        low = eqx.tree_at(lambda o: o.zeta, operator, jnp.asarray(factor * edge))
        least = min(thresholds(low, *run).min() for run in zip(u_pp, freq, strict=True))
        assert least > 0 if factor < 1 else (least < 0) == edge_is_sharp
    assert operator.couplings([4.0], [0.0]) == {}
    assert OWN[f"{name}, a value a play"].couplings(u_pp, freq) == {}


# --- guesses and the flexible form


@pytest.mark.parametrize("operator", [FIXED, MIXED])
def test_guesses_have_the_law_and_are_near(operator):
    cls = type(operator)
    clean = Recording.of(DRIVES, [np.asarray(predict(ECDL(operator), d)) for d in DRIVES])
    best, *rest = cls.initial_guesses(clean, plays=5)
    assert type(best) is cls and len(rest) == 7
    wide = cls.initial_guesses(clean, plays=5, each=("lam", "alpha"), count=1)[0]
    assert wide.lam.shape == (5,) == getattr(wide, operator.tied_first[0]).shape
    with pytest.raises(ValueError, match="`each` may name .*lam and eta"):
        cls.initial_guesses(clean, each=("zeta",))
    errors = [
        np.asarray(predict(ECDL(best), d)) - run.response
        for d, run in zip(DRIVES, clean.runs, strict=True)
    ]
    span = max(run.span for run in clean.runs)
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 0.02 * span


def test_guesses_of_one_amplitude_have_nothing_fixed():
    runs = recording((10.0, 40.0), (4.0,))
    assert float(MixedRAPI.guess(runs).rho) == 0.0 and float(FixedRAPI.guess(runs).rho) > 0.0


@pytest.mark.parametrize("name", OWN)
def test_the_flexible_form_begins_as_the_same_function_at_every_swing(name):
    operator = OWN[name]
    form = operator.flexible(recording((10.0, 80.0), (1.0, 2.5, 4.0)))
    assert isinstance(form.operator, GeneralRAPI) and form.operator.count == 24
    for drive in DRIVES:
        ours, theirs = (predict(ECDL(o), drive) for o in (operator, form.operator))
        np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-9)
    assert ("alpha" in form.held) == (type(operator) is FixedRAPI) and "rho" in form.deviations


def test_the_flexible_form_of_rapi_has_nothing_fixed():
    form = RAPI(alpha=0.3, **SHAPE, plays=5).flexible(recording((10.0,), (1.0, 4.0)))
    assert float(form.operator.rho) == 0.0 and "rho" in form.held
    assert "rho" not in form.deviations


@pytest.mark.parametrize("name", OWN)
def test_general_rapi_holds_the_same_function(name):
    general = GeneralRAPI.of(OWN[name], u_0=2.5)
    for drive in DRIVES:
        ours, theirs = (predict(ECDL(o), drive) for o in (OWN[name], general))
        np.testing.assert_allclose(ours, theirs, **ROUNDING)


# --- files and inverses


@pytest.mark.parametrize("name", OWN)
def test_a_file_holds_it(name, tmp_path):
    write_model(tmp_path / "model.rapi", ECDL(OWN[name]))
    assert eqx.tree_equal(read_model(tmp_path / "model.rapi")[0], ECDL(OWN[name]))


def test_a_general_rapi_of_a_file_without_rho_has_nothing_fixed(tmp_path):
    plain, path = ECDL(GeneralRAPI.of(RAPI(alpha=0.3, **SHAPE, plays=5))), tmp_path / "model.rapi"
    write_model(path, plain)
    body, _, _ = path.read_bytes().rstrip(b"\n").rpartition(b"\n")
    line, _, leaves = body.partition(b"\n")
    header = json.loads(line)
    assert header["operator"]["shapes"].pop("rho") == []
    one = io.BytesIO()
    np.save(one, np.zeros(()))
    old = json.dumps(header).encode() + b"\n" + leaves[: -len(one.getvalue())]
    path.write_bytes(old + b"\n" + hashlib.sha256(old).hexdigest().encode() + b"\n")
    assert eqx.tree_equal(read_model(path)[0], plain)


@pytest.mark.parametrize("name", OWN)
@pytest.mark.parametrize("span", [pytest.param(20.0, marks=pytest.mark.slow), 50.0])
def test_the_exact_inverse_is_exact(name, span):
    operator, freq = OWN[name], 20.0
    assert certify(operator, 0.0, 7.0, freq).invertible
    x = np.arange(300) / 300
    y = jnp.asarray(20.0 + span * (1.0 - np.abs(1.0 - 2.0 * x)))
    u = exact_inverse(operator, y, freq, within=(0.0, 7.0))
    assert float(jnp.abs(operator(u, jnp.asarray(freq)) - y).max()) < 1e-11 * span


@pytest.mark.parametrize("operator", [FIXED, MIXED])
def test_a_device_is_compensated_and_streamed(operator):
    target = linear_scan(20.0, span=40.0, samples=1024)[0]
    limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=5000.0)
    got = compensate(ECDL(operator), target, limits=limits, bias=3.0)
    assert got.certificate.invertible and got.inverse == "exact"
    answer = np.asarray(predict(ECDL(operator), got.drive))
    assert np.ptp(answer - np.mean(answer) - (target.value - np.mean(target.value))) < 1e-9
    stream = StreamingCompensator.of(operator, 20.0, within=(0.0, 7.0))
    state, _ = stream.run(30.0 + target.value)
    assert float(state.error) < 1e-11
