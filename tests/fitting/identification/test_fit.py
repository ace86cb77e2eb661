"""Identification of the paper's device: values, errors, held-out data, verdict, precision."""

import re
import subprocess
import sys

import jax
import numpy as np
import pytest

from fitting import UntrustedFit, choose_order, fit, hysteresis_weights, identify
from fitting.report.fit._next_step import describe_next
from rapi_jax import ECDL, PI, RAPI, DataError, Recording, predict
from rapi_jax._waveform import triangle
from rapi_jax.examples import paper_device, paper_drives, paper_recording

SHARED = ("alpha", "zeta", "lam", "eta", "a", "b")


@pytest.fixture(scope="module")
def recorded():
    return paper_recording(samples=2000, seed=3)


@pytest.fixture(scope="module")
def result(recorded):
    recording, _ = recorded
    return fit(ECDL(RAPI.guess(recording)), recording)


def true_values():
    operator = paper_device().operator
    values = {name: float(getattr(operator, name)) for name in SHARED}
    return values | {f"d_{k + 1}": float(d) for k, d in enumerate(operator.d)} | {"d_0": 0.0}


def test_parameters_lie_within_their_errors(result):
    # ten estimates, correlated: each within four standard errors has a chance of failing below 1e-3
    for name, value in true_values().items():
        estimate = result[name]
        assert 0 < estimate.stderr < np.inf
        assert abs(estimate.value - value) < 4 * estimate.stderr, name


def test_noise_free_error_is_below_the_target(recorded, result):
    _, truth = recorded
    missed = [np.mean((p - t) ** 2) for p, t in zip(result.predicted, truth, strict=True)]
    assert np.sqrt(np.mean(missed)) < 2e-3  # GHz, of 20 MHz noise


def test_result_is_trusted_and_says_so_everywhere(result):
    assert result.verdict.trusted and result.verdict.reasons == ()
    table = result.to_dict()
    assert table["verdict"]["trusted"] is True
    assert "trusted" in result.summary() and "lam" in result._repr_html_()
    assert repr(result) == f"<FitResult: RAPI, trusted, rmse {1e3 * result.rmse:.3g} MHz>"
    assert set(table["parameters"]) == {*true_values(), "origin"}


def test_held_out_errors_are_those_of_the_noise(result):
    schemes = {h.scheme: h for h in result.held_out}
    rates = {f"rate {f} Hz" for f in (10, 20, 30, 40)}
    assert set(schemes) == {"last third"} | rates
    for rate in rates:
        assert 0.018 < schemes[rate].std < 0.022  # 20 MHz of white noise, 2000 samples
    # a run of one period loses the end of its falling branch, which the rest only extrapolates to
    assert 0.018 < schemes["last third"].std < 0.030


def test_a_rate_left_out_is_predicted_by_a_fit_that_never_saw_it(recorded):
    recording, _ = recorded
    part = Recording(recording.runs[:3])
    alone = fit(ECDL(RAPI.guess(part)), part, weights="uniform", hold_out=False)
    error = np.asarray(predict(alone.ecdl, recording.runs[3].drive)) - recording.runs[3].response
    full = fit(ECDL(RAPI.guess(recording)), recording, weights="uniform")
    scheme = next(h for h in full.held_out if h.scheme == "rate 40 Hz")
    assert np.sqrt(np.mean(error**2)) == pytest.approx(scheme.rmse, rel=1e-3)


def test_weights_grow_with_the_loop(recorded):
    weights = hysteresis_weights(recorded[0])
    assert weights.mean() == pytest.approx(1.0)
    assert (np.diff(weights) > 0).all()  # the loop opens with the rate


@pytest.mark.parametrize("seed", range(8))
def test_wild_starts_reach_the_optimum(recorded, result, seed):
    """A shorter form of tests/benchmarks/starts.py: up to 5 times off, a tenth with wrong signs."""
    rng = np.random.default_rng(seed)
    operator = paper_device().operator

    def off(value):
        value = np.asarray(value)
        sign = np.where(rng.random(value.shape) < 0.1, -1.0, 1.0)
        return value * sign * 5.0 ** rng.uniform(-1, 1, value.shape)

    wild = RAPI(**{n: off(getattr(operator, n)) for n in (*SHARED, "d")}, d_0=5.0)
    got = fit(ECDL(wild), recorded[0], hold_out=False, throw=False)
    best = min(start.cost for start in result.starts)
    assert min(start.cost for start in got.starts) == pytest.approx(best, rel=1e-4)
    assert got.verdict.trusted


def test_first_guesses_are_made_once(recorded, result, monkeypatch):
    """Half of the time of a fit went into making them again, for the same recording."""
    made = []
    guesses = RAPI.initial_guesses

    def count(recording, **options):
        made.append(recording)
        return guesses(recording, **options)

    monkeypatch.setattr(RAPI, "initial_guesses", count)
    found = identify(recorded[0], hold_out=False)
    assert len(made) == 1
    assert [s.origin for s in found.starts] == [s.origin for s in result.starts]
    assert [p.value for p in found.parameters] == [p.value for p in result.parameters]


def test_one_start_alone_is_not_trusted(recorded):
    with pytest.raises(UntrustedFit, match="one start only") as caught:
        fit(ECDL(RAPI.guess(recorded[0])), recorded[0], starts=1, hold_out=False)
    assert caught.value.result.rmse < 0.021


def test_fixed_parameters_stay(recorded):
    recording, _ = recorded
    start = ECDL(RAPI.guess(recording))
    got = fit(start, recording, free=lambda e: (e.operator.lam, e.operator.d), throw=False)
    for name in ("alpha", "zeta", "eta", "a", "b", "d_0"):
        assert got[name].held and got[name].stderr == 0
        assert got[name].value == float(getattr(start.operator, name))
    assert not got["lam"].held and not got["d_1"].held


def test_the_others_are_fitted_to_a_value_held_on_its_bound():
    """Thresholds without growth: the bound of `zeta`. Nothing else is off, so nothing is left."""
    still = dict.fromkeys(("zeta", "d_0"), 0.0)
    values = {name: np.asarray(getattr(paper_device().operator, name)) for name in (*SHARED, "d")}
    device = ECDL(RAPI(**{**values, **still}))
    drives = paper_drives(samples=500)
    recording = Recording.of(drives, [np.asarray(predict(device, drive)) for drive in drives])
    start = ECDL(RAPI(**{**values, **still, "lam": 1.4, "a": 0.5}))
    got = fit(
        start, recording, free=lambda e: (e.operator.lam, e.operator.a, e.operator.d),
        starts=1, guess=False, hold_out=False, throw=False,
    )  # fmt: skip
    assert got["zeta"].held and got["zeta"].value == 0.0
    for name in ("lam", "a"):
        assert got[name].value == pytest.approx(float(values[name]), rel=1e-6)
    assert got.rmse < 1e-7  # GHz, of a span of 75


def test_play_parameters_of_their_own_are_recovered():
    lam = np.linspace(1.3, 1.9, 6)
    device = RAPI(
        alpha=0.3, zeta=0.006, lam=lam, eta=1.0, a=0.9, b=0.1, d=(18.8, -1.1, 0.01), plays=6
    )
    drives = paper_drives(samples=2000)
    rng = np.random.default_rng(0)
    truth = [np.asarray(predict(ECDL(device), d)) for d in drives]
    recording = Recording.of(drives, [y + 0.02 * rng.standard_normal(y.size) for y in truth])
    got = fit(ECDL(RAPI.guess(recording, plays=6, each=("lam",))), recording, throw=False)
    missed = [np.mean((p - t) ** 2) for p, t in zip(got.predicted, truth, strict=True)]
    assert np.sqrt(np.mean(missed)) < 2e-3
    for i in range(6):
        estimate = got[f"lam_{i + 1}"]
        assert abs(estimate.value - lam[i]) < 5 * estimate.stderr


def test_redundant_parameters_are_named():
    """One run: eta cannot be told from the scale of thresholds; freed, it is found out."""
    recording, _ = paper_recording(samples=2000)
    one = Recording(recording.runs[:1])
    start = ECDL(RAPI.guess(one))
    got = fit(start, one, free=lambda e: e.operator, hold_out=False, throw=False)
    assert {"alpha", "eta", "b"} <= set(got.verdict.unidentifiable)
    assert np.isinf(got["eta"].stderr) and got.to_dict()["parameters"]["eta"]["stderr"] is None
    assert any("unidentifiable" in reason for reason in got.verdict.reasons)
    held = fit(start, one, throw=False)
    assert held["eta"].held and held.verdict.unidentifiable == ()


def test_zeta_is_held_where_no_run_has_a_rate():
    from rapi_jax._waveform import step_and_hold

    drive = step_and_hold((1.0, 4.0, 2.0, 5.0, 1.0), hold_s=0.02, rise_s=0.02, step_s=1e-4)
    truth = np.asarray(predict(paper_device(), drive[0]))
    noisy = truth + 0.02 * np.random.default_rng(0).standard_normal(truth.size)
    steps = Recording.of(drive, [noisy])
    got = fit(ECDL(RAPI.guess(steps)), steps, starts=2, hold_out=False, throw=False)
    assert got["zeta"].held and "zeta" not in got.verdict.unidentifiable
    assert got.rmse < 0.022


def test_one_rate_is_noted():
    recording, _ = paper_recording(samples=2000)
    got = fit(ECDL(RAPI.guess(r := Recording(recording.runs[:1]))), r, throw=False)
    assert any("lag" in note and "hysteresis" in note for note in got.verdict.notes)


def test_a_model_without_an_inverse_is_noted_with_where_and_what_next():
    operator = RAPI(
        alpha=0.5, zeta=0.002, lam=1.2, eta=1.0, a=2.0, b=0.1, d=(-1.0, 0.0, 0.0), plays=6
    )
    drives = triangle([10.0, 20.0], amplitude=4.0, bias=3.0, samples=400)
    noise = 0.02 * np.random.default_rng(2).standard_normal((2, 400))
    clean = [np.asarray(predict(ECDL(operator), drive)) for drive in drives]
    recording = Recording.of(drives, [y + e for y, e in zip(clean, noise, strict=True)])
    got = fit(ECDL(operator), recording, guess=False, starts=1, hold_out=False, throw=False)
    (note,) = [n for n in got.verdict.notes if n.startswith("no inverse")]
    slope = re.search(r"slope down to (-[\d.]+) GHz/V", note)
    assert slope and float(slope[1]) == pytest.approx(-1.0, abs=0.1)
    assert "between 1 and 5 V" in note
    assert "no drive can be computed" in describe_next((), notes=got.verdict.notes)
    healthy, _ = paper_recording(samples=2000)
    fine = fit(ECDL(RAPI.guess(healthy)), healthy, hold_out=False, throw=False)
    assert not any("no inverse" in note for note in fine.verdict.notes)


def test_amplitudes_are_left_out_where_there_are_several():
    drives = (
        *triangle((10.0, 40.0), amplitude=4.5, bias=3.0, samples=1000),
        *triangle((10.0, 40.0), amplitude=2.5, bias=3.0, samples=1000),
    )
    rng = np.random.default_rng(0)
    device = paper_device()
    noisy = [np.asarray(predict(device, d)) + 0.02 * rng.standard_normal(d.size) for d in drives]
    got = fit(ECDL(RAPI.guess(r := Recording.of(drives, noisy))), r, throw=False)
    assert {"swing 4.5 V", "swing 2.5 V"} <= {h.scheme for h in got.held_out}
    assert not any("one swing" in note for note in got.verdict.notes)


def test_runs_with_an_origin_of_their_own():
    recording, truth = paper_recording(samples=2000, seed=1)
    shifts = (0.0, 30.0, -20.0, 7.0)
    moved = [run.response + s for run, s in zip(recording.runs, shifts, strict=True)]
    own = Recording.of(recording.drives, moved, response_origin="run")
    got = fit(ECDL(RAPI.guess(own)), own, throw=False)
    offsets = np.array([run.offset for run in got.runs])
    assert offsets.mean() == pytest.approx(0.0, abs=1e-9)
    missed = [p - s - t for p, s, t in zip(got.predicted, shifts, truth, strict=True)]
    assert np.sqrt(np.mean(np.square(missed))) < 2e-3


def test_unknown_history_is_freed_in_runs_that_do_not_repeat():
    device = paper_device()
    drive = triangle(10.0, amplitude=4.5, bias=3.0, samples=2000)[0]
    free = type(drive)(drive.time, drive.value, 10.0, "other")
    initial = np.linspace(0.1, 0.8, 10)
    truth = np.asarray(predict(device, free, initial=initial))
    rng = np.random.default_rng(0)
    recording = Recording.of((free,), [truth + 0.02 * rng.standard_normal(truth.size)])
    known = fit(ECDL(RAPI.guess(recording)), recording, history=False, hold_out=False, throw=False)
    freed = fit(ECDL(RAPI.guess(recording)), recording, hold_out=False, throw=False)
    assert freed.rmse < 0.021 and known.rmse > 1.2 * freed.rmse


@pytest.mark.slow
def test_drift_of_the_origin_does_not_spoil_held_out_periods():
    recording, _ = paper_recording(samples=4000, periods=8)
    drifted = [
        run.response + 0.3 * np.log10(1.0 + run.drive.session_time / 0.1) for run in recording.runs
    ]
    slow = Recording.of(recording.drives, drifted)
    with_drift = fit(ECDL(RAPI.guess(slow)), slow, throw=False)
    without = fit(ECDL(RAPI.guess(slow)), slow, drift=False, throw=False)
    assert with_drift.rmse_held_out < 0.022 < 0.03 < without.rmse_held_out


def test_pi_fits_a_pi_device():
    drives = triangle((10.0, 20.0), amplitude=4.0, bias=2.5, samples=1000)
    device = PI(r=[0.2, 0.5, 0.9], p=[1.0, 0.7, 0.4], d=[15.0, -0.5])
    truth = [np.asarray(predict(ECDL(device), d)) for d in drives]
    rng = np.random.default_rng(0)
    recording = Recording.of(drives, [y + 0.01 * rng.standard_normal(y.size) for y in truth])
    start = PI(r=[0.25, 0.4, 1.0], p=[0.8, 0.8, 0.8], d=[10.0, 0.0])
    got = fit(ECDL(start), recording, throw=False)
    missed = [np.mean((p - t) ** 2) for p, t in zip(got.predicted, truth, strict=True)]
    assert np.sqrt(np.mean(missed)) < 1e-3


def test_too_few_samples_are_refused():
    drives = triangle((10.0,), amplitude=4.0, bias=2.5, samples=9)
    recording = Recording.of(drives, [np.arange(9.0)])
    with pytest.raises(DataError, match="cannot fix"):
        fit(ECDL(RAPI.guess(recording)), recording)


@pytest.mark.slow
def test_size_is_chosen_on_held_out_runs():
    recording, _ = paper_recording(samples=1000)
    choices = choose_order(recording, plays=(2, 10), order=(1, 3), each=((),), starts=2)
    assert (choices[0].plays, choices[0].order) == (10, 3)
    assert choices[0].score < 0.5 * max(choice.score for choice in choices)


def test_identify_stops_at_white_residuals(recorded):
    seen = []
    got = identify(recorded[0], progress=seen.append)
    assert got.ecdl.operator.lam.ndim == 0
    assert not any("own lam" in line for line in seen)


def test_float64_whatever_the_host_says():
    code = """
import jax, numpy as np
from rapi_jax import ECDL, RAPI, predict
from rapi_jax.examples import paper_recording
from fitting import fit
recording, truth = paper_recording(samples=1000)
got = fit(ECDL(RAPI.guess(recording)), recording, hold_out=False)
assert not jax.config.jax_enable_x64
assert predict(got.ecdl, recording.runs[0].drive).dtype == np.float64
assert jax.numpy.ones(2).dtype == np.float32
missed = [np.mean((p - t) ** 2) for p, t in zip(got.predicted, truth)]
assert np.sqrt(np.mean(missed)) < 2e-3
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert jax.config.jax_enable_x64  # ours, set by the tests
