"""Fits of many recordings: the ends of single fits, also where a program solves many at once."""

import numpy as np
import pytest

from fitting import fit, fit_many
from rapi_jax import ECDL, RAPI, DataError, Drive, Recording
from rapi_jax.examples import paper_device, paper_recording


def recordings(count, samples=500):
    return [paper_recording(samples=samples, seed=i)[0] for i in range(count)]


def start(**changes):
    """The paper's device, somewhat off."""
    paper = paper_device().operator
    fields = {name: np.asarray(getattr(paper, name)) for name in ("zeta", "eta", "b", "d", "d_0")}
    fields |= {"alpha": 1.2 * paper.alpha, "lam": 1.3, "a": 0.8 * paper.a}
    return ECDL(RAPI(**{**fields, **changes}, plays=10))


def values(result):
    return np.array([parameter.value for parameter in result.parameters])


SLOW = pytest.mark.slow  # compiles for each number of lanes, with plays tied and free


@pytest.mark.parametrize(
    ("lanes", "lam", "count"),
    [
        pytest.param(1, 1.3, 6, id="1-shared"),
        pytest.param(1, np.full(10, 1.3), 6, id="1-each"),
        pytest.param(4, 1.3, 6, id="4-shared", marks=SLOW),  # a batch of four and one of two
        pytest.param(4, np.full(10, 1.3), 4, id="4-each", marks=SLOW),
    ],
)
def test_results_are_those_of_single_fits(lanes, lam, count):
    """Recordings of two shapes, which are solved together."""
    data = [*recordings(count - 1), *recordings(1, samples=400)]
    model = start(lam=lam)
    many = fit_many(model, data, lanes=lanes)
    assert [result.recording for result in many] == data
    for result, recording in zip(many, data, strict=True):
        one = fit(model, recording, starts=1, guess=False, hold_out=False, throw=False)
        mine, best = (r.starts[0].cost for r in (result, one))
        assert mine < best * (1.0 + 1e-8)
        assert result.rmse == pytest.approx(one.rmse, rel=1e-4)
        stderr = np.array([p.stderr for p in one.parameters])
        assert np.all(np.abs(values(result) - values(one)) < 0.05 * stderr + 1e-12)
        assert len(result.starts) == 2 and result.verdict.trusted


def test_a_value_held_on_its_bound_is_held_there():
    """Without growth of the thresholds, as in `test_fit.py`; the paper's device has some."""
    options = {"free": lambda e: (e.operator.lam, e.operator.a, e.operator.d), "hold_out": False}
    model, data = start(zeta=0.0), recordings(2)
    for result, recording in zip(fit_many(model, data, lanes=1, **options), data, strict=True):
        one = fit(model, recording, starts=1, guess=False, throw=False, **options)
        assert result["zeta"].value == one["zeta"].value == 0.0
        assert result["lam"].value == pytest.approx(one["lam"].value, abs=0.05 * one["lam"].stderr)
        assert result.rmse == pytest.approx(one.rmse, rel=1e-6)


def test_a_recording_that_needs_samples_is_fitted_beside_the_others():
    """A random walk turns at every sample: no intervals, so no lane of its own."""
    data = recordings(2)
    rng = np.random.default_rng(0)
    drive = data[0].drives[0]
    walk = Drive(drive.time, 3.0 + 0.5 * rng.standard_normal(drive.size), 10.0, "other")
    other = Recording.of([walk], [data[0].runs[0].response])
    found = fit_many(start(), [data[0], other, data[1]], lanes=4, check=False)
    assert [len(result.runs) for result in found] == [4, 1, 4]
    assert not found[1].verdict.trusted and found[0].rmse < 0.03


def test_what_cannot_be_fitted_is_refused_before_any_fit():
    short = Recording.of([Drive(np.arange(4) * 1e-3, np.arange(4.0))], [np.arange(4.0)])
    with pytest.raises(DataError, match="cannot fix"):
        fit_many(start(), [*recordings(1), short])
    with pytest.raises(ValueError, match="one model or one per recording"):
        fit_many([start()], recordings(2))
