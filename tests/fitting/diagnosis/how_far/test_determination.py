"""Which predictions of held-out runs the other runs determine, against drawn noise."""

import dataclasses

import numpy as np
import pytest
from worlds import BaseModel, Refit, WhitenedModel, answers, drives, flexible_operator, recorded

from fitting.diagnosis.how_far._cross_validation import cross_validate
from fitting.diagnosis.how_far._determination import prediction_variance
from fitting.diagnosis.how_far._held_out import FullRefit, folds
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.noise._whitening import Whitener
from rapi_jax import Recording, parameters
from rapi_jax._precision import float64
from rapi_jax.effects import AmplitudeLaw
from rapi_jax.examples import paper_device

NOISE = 0.02
SESSION = drives(rates=(10.0, 20.0, 40.0), amplitudes=(2.0, 3.0), periods=3, samples=80)


@float64
def test_the_variance_is_that_of_predictions_refitted_to_noise():
    """Of a linear model: the mean chi-square of 60 predictions, each of new noise."""
    whitened = WhitenedModel.of(Recording.of(SESSION, answers(SESSION)))
    operator, spectrum = paper_device().operator, Spectrum.of_white(NOISE**2)
    base = BaseModel.of(whitened, operator)
    linear = np.concatenate([np.full(p.size, p.linear) for p in parameters(operator)])
    base = dataclasses.replace(base, free=base.free & linear)
    use = np.array([drive.rate != 40.0 for drive in SESSION])
    blocks = whitened.blocks
    held = Whitener(blocks, spectrum, own_origin=False, use=~use)
    seen = Refit(whitened, Whitener(blocks, spectrum, own_origin=False, use=use), base)
    truth = seen.evaluate(base.prior_mean, ())
    rng, moved = np.random.default_rng(5), []
    for _ in range(60):
        noisy = [
            dataclasses.replace(b, data=b.data + NOISE * rng.standard_normal(b.data.shape))
            for b in blocks
        ]
        one = dataclasses.replace(seen, whitened=dataclasses.replace(whitened, blocks=noisy))
        end = one.minimise(one.evaluate(truth.values, ()), 2)
        there = seen.evaluate(end.values, ()).errors.raw
        off = [a - b for a, b in zip(there, truth.errors.raw, strict=True)]
        moved.append(float(np.sum(held.whiten(off)[0] ** 2)))
    error = float(np.std(moved)) / np.sqrt(len(moved))
    others = dataclasses.replace(seen, whitener=held).jacobian(truth)
    found = prediction_variance(seen.jacobian(truth), others, seen.prior_weight)
    assert found == pytest.approx(np.mean(moved), abs=4.0 * error)


def flexible(effects):
    whitened = WhitenedModel.of(recorded(effects, noise=NOISE, session=SESSION))
    plain = BaseModel.of(whitened, paper_device().operator)
    rich = flexible_operator(whitened, plain, plain.prior_mean)
    refit = Refit(whitened, whitened.make_whitener(Spectrum.of_white(NOISE**2)), rich)
    return refit, refit.evaluate(rich.prior_mean, effects)


@float64
def test_a_part_left_out_of_a_linear_model_is_predicted_as_its_normal_equations_say():
    """Lines of one run are left out of the Jacobian of all: the same as one that never saw them.

    To a third of the prediction's own standard error: a refit ends where a step gains next to none.
    """
    whitened = WhitenedModel.of(recorded((), noise=NOISE, session=SESSION))
    operator, spectrum = paper_device().operator, Spectrum.of_white(NOISE**2)
    base = BaseModel.of(whitened, operator)
    linear = np.concatenate([np.full(p.size, p.linear) for p in parameters(operator)])
    base = dataclasses.replace(base, free=base.free & linear)
    refit = Refit(whitened, whitened.make_whitener(spectrum), base)
    state = refit.minimise(refit.evaluate(base.prior_mean, ()), 5)
    jacobian, errors = refit.jacobian(state), state.errors.all
    for fold in folds(whitened):
        if fold.use.all():
            continue
        seen = fold.use[refit.whitener.run_of_line]
        move = np.linalg.lstsq(jacobian[seen], -errors[seen], rcond=1e-12)[0]
        expected = refit.evaluate(state.values + move, ()).errors.raw
        found = FullRefit(refit, state).held_out_errors(fold)
        assert found is not None
        off = sum(
            np.sum(((one - expected[run]) / NOISE) ** 2)
            for run, one in zip(fold.runs, found, strict=True)
        )
        assert off < 0.1 * prediction_variance(jacobian[seen], jacobian[~seen], refit.prior_weight)


@float64
def test_every_line_belongs_to_a_run():
    """Errors of one run alone are whitened into the lines of that run alone."""
    whitened = WhitenedModel.of(recorded((), noise=NOISE, session=SESSION))
    whitener = whitened.make_whitener(Spectrum.of_white(NOISE**2))
    for run in range(len(SESSION)):
        alone = [
            np.full(b.data.shape, float(k == run)) * np.arange(b.size).reshape(b.data.shape)
            for k, b in enumerate(whitened.blocks)
        ]
        lines = np.concatenate(whitener.whiten(alone))
        assert lines.size == whitener.run_of_line.size
        assert not lines[whitener.run_of_line != run].any()
        assert lines[whitener.run_of_line == run].any()


@float64
def test_one_amplitude_does_not_determine_what_grows_with_amplitude():
    """Of two amplitudes one is left, and says nothing of the other; of three rates two are.

    Such parts are listed, and take no part in the closed fraction.
    """
    law = AmplitudeLaw(threshold=0.2, gain=0.02, tilt=0.01, reference=4.0, centre=2.5)
    refit, state = flexible((law,))
    without = refit.evaluate(state.values, ())
    (found,) = cross_validate(refit.whitened, (refit, without), [(refit, state)])
    assert found is not None
    determined = {row["part"]: row["determined"] for row in found.parts}
    assert not determined["swing 2 V"] and not determined["swing 3 V"]
    assert determined["rate 20 Hz"] and determined["last periods"]
    assert all(row["closed_fraction"] is None for row in found.parts if not row["determined"])
    held = {fold.name: len(fold.held) for fold in folds(refit.whitened)}
    assert len(found.before) == sum(held[name] for name, yes in determined.items() if yes)
