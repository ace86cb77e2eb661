"""Another form of an effect: its evidence in closed form, and where it is named."""

import dataclasses
from typing import ClassVar

import numpy as np
import pytest
from edge_worlds import NOISE, drives, off, record
from jaxtyping import Array, Float
from scipy import signal
from scipy.stats import multivariate_normal

from fitting import diagnose
from fitting.diagnosis.mechanism._other_form import refit_form, synchronous_cost
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import Recording
from rapi_jax.effects import (
    AbstractEffect,
    AbstractLawEffect,
    Creep,
    Delay,
    Drift,
    Etalon,
    GainDrift,
    Law,
    ModeHop,
    Pickup,
    Quantisation,
    RateLaw,
    ResidualSummary,
)

SESSION = drives((10.0, 40.0), amplitudes=(3.0, 2.0))


def with_added(added) -> Recording:
    """The paper's device, to whose readings `added(time, drive, response)` (GHz) is added."""
    recording = record(SESSION)
    runs = [
        run.response + added(run.drive.start_s + run.drive.time, run.drive.value, run.response)
        for run in recording.runs
    ]
    return Recording.of(SESSION, runs)


def pulses(time: np.ndarray, drive: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Of a dimmer: two a cycle of 50 Hz, of opposite signs."""
    del drive, response
    number = np.round((time - 0.004) / 0.01)
    return (
        0.3
        * np.where(number % 2, -1.0, 1.0)
        * np.exp(-(((time - 0.004 - 0.01 * number) / 8e-4) ** 2))
    )


def cycle_of_the_gain(time: np.ndarray, drive: np.ndarray, response: np.ndarray) -> np.ndarray:
    """By 2 %, once in 1.1 s, about the middle of the drive."""
    del response
    return 0.02 * np.sin(2.0 * np.pi * time / 1.1 + 1.0) * 16.0 * (drive - 3.0)


def two_cavities(time: np.ndarray, drive: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Fringes of 5 GHz and of 4 GHz."""
    del time, drive
    turn = 2.0 * np.pi * response / 5.0
    return 0.2 * np.sin(turn + 0.5) + 0.15 * np.sin(1.25 * turn + 2.0)


def in_session(path: np.ndarray, lasts: float = 2.0):
    """What adds `path`, in equal steps over `lasts` seconds of the session, to a response."""
    clock = np.linspace(0.0, lasts, path.size)
    return lambda time, drive, response: np.interp(time, clock, path)


def random_walk_of_the_light() -> np.ndarray:
    """In steps of 5 ms, about 1 GHz in a second."""
    return 0.07 * np.random.default_rng(3).standard_normal(400).cumsum()


def hunting_controller() -> np.ndarray:
    """Noise of 0.2 GHz about 4 Hz, in steps of 1 ms, by a resonator of SciPy's."""
    numerator, denominator = signal.iirpeak(4.0, 3.0, fs=1000.0)
    wave = signal.lfilter(numerator, denominator, np.random.default_rng(4).standard_normal(6000))
    return 0.2 * wave[4000:] / np.std(wave[4000:])


class RelaxationPeak(AbstractLawEffect):
    """Thresholds that grow with the rate, and faster about 20 Hz."""

    name: ClassVar[str] = "relaxation_peak"

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        return []

    def __call__(self, law: Law, bias: Float[Array, ""]) -> Law:
        ratio = law.freq / 20.0
        return law._replace(freq=law.freq + 45.0 * ratio / (1.0 + ratio**2))


def at_five_rates() -> Recording:
    return record(drives((5.0, 10.0, 20.0, 40.0, 80.0)), RelaxationPeak())


def by_an_uneven_converter() -> Recording:
    """Of steps of 41.7 mV, whose levels are off by a fifth of that."""
    errors = 0.008 * np.random.default_rng(2).standard_normal(200)

    def played(value: np.ndarray) -> np.ndarray:
        code = np.round(value / 0.0417).astype(int)
        return 0.0417 * code + errors[code]

    sent = [dataclasses.replace(drive, value=played(drive.value)) for drive in SESSION]
    return Recording.of(SESSION, [run.response for run in record(sent).runs])


@pytest.fixture(scope="module")
def stood() -> tuple[Refit, State]:
    """A refit of a short recording, and a state some way off."""
    whitened = WhitenedModel.of(record(drives(samples=60)))
    base = BaseModel.of(whitened, off(0.001))
    refit = Refit(whitened, whitened.make_whitener(Spectrum.of_white(NOISE**2)), base)
    return refit, refit.evaluate(base.prior_mean, ())


def test_its_cost_is_that_of_the_marginal_likelihood(stood):
    """A normal density whose covariance has the functions' beside the noise's, the best scale's."""
    refit, state = stood
    rng = np.random.default_rng(0)
    functions = [0.02 * rng.standard_normal((7, *b.time.shape)) for b in refit.whitened.blocks]
    end = refit_form(refit, state, functions)
    columns = np.concatenate(refit.whitener.whiten(functions), axis=1)
    errors = state.errors.all

    def minus_twice_log(scale: float) -> float:
        covariance = np.eye(errors.size) + scale**2 * columns.T @ columns
        law = multivariate_normal(np.zeros(errors.size), covariance)
        return -2.0 * float(law.logpdf(errors)) - errors.size * np.log(2.0 * np.pi)

    best = min(minus_twice_log(scale) for scale in np.geomspace(1e-3, 1e2, 26))
    assert end.cost - state.prior_cost == pytest.approx(best, rel=1e-9)
    assert end.cost <= state.cost


def test_functions_of_which_the_errors_are_a_sum_leave_the_noise(stood):
    refit, state = stood
    rng = np.random.default_rng(1)
    functions = [0.5 * rng.standard_normal((4, *b.time.shape)) for b in refit.whitened.blocks]
    sizes = np.array([1.0, -0.4, 0.2, 0.0])
    there = refit.whitener.whiten([np.tensordot(sizes, f, 1) for f in functions])
    moved = state.errors._replace(
        synchronous=state.errors.synchronous + there[0],
        nonsynchronous=state.errors.nonsynchronous + there[1],
    )
    end = refit_form(refit, dataclasses.replace(state, errors=moved), functions)
    before = float(state.errors.all @ state.errors.all)
    assert float(end.errors.all @ end.errors.all) < before + 4.0
    assert float(moved.all @ moved.all) > 20.0 * before


@pytest.mark.parametrize(("times", "follows"), [(0.2, False), (1.0, False), (6.0, True)])
def test_more_in_what_repeats_than_in_the_rest_follows_the_drive(stood, times, follows):
    """Functions' sizes drawn with one deviation, and `times` it in what repeats with the drive."""
    refit, state = stood
    blocks = refit.whitened.blocks
    for seed in range(8):
        rng = np.random.default_rng(seed)
        functions = rng.standard_normal((30, sum(block.size for block in blocks)))
        ends = np.cumsum([block.size for block in blocks])[:-1]
        parts = np.split(functions, ends, axis=1)
        by_run = [p.reshape(-1, *b.time.shape) for p, b in zip(parts, blocks, strict=True)]
        repeated, rest = refit.whitener.whiten(by_run)
        sizes = 0.05 * rng.standard_normal(30)
        errors = state.errors._replace(
            synchronous=rng.standard_normal(repeated.shape[1]) + times * sizes @ repeated,
            nonsynchronous=rng.standard_normal(rest.shape[1]) + sizes @ rest,
        )
        drawn = dataclasses.replace(state, errors=errors)
        one_size = refit_form(refit, drawn, by_run).cost
        assert (synchronous_cost([functions], refit, drawn) < one_size) == follows


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cls", "rival", "make"),
    [
        (Pickup, Etalon, lambda: with_added(pulses)),
        (Drift, Creep, lambda: with_added(in_session(random_walk_of_the_light()))),
        (GainDrift, Creep, lambda: with_added(cycle_of_the_gain)),
        (Etalon, ModeHop, lambda: with_added(two_cavities)),
        (RateLaw, GainDrift, at_five_rates),
        (Quantisation, Pickup, by_an_uneven_converter),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_another_form_is_named_and_said_to_be_one(cls, rival, make):
    found = diagnose(None, make(), candidates=(rival, cls), scan=False)
    assert found.verdict.name == cls.name and found.verdict.probability > 0.9
    assert any("another form than the model's equation" in note for note in found.notes)


@pytest.mark.slow
def test_of_four_rates_the_law_is_named_though_its_form_may_be_hysteresis():
    """What the equation leaves there (1.2 of chi-square a line) finer and bent plays can be."""
    recording = record(drives((5.0, 10.0, 20.0, 60.0)), RelaxationPeak())
    found = diagnose(None, recording, candidates=(GainDrift, RateLaw), scan=False)
    assert found.verdict.name == RateLaw.name


@pytest.mark.slow
def test_what_no_form_explains_stays_unlisted():
    """A dispersive curve about one voltage: no harmonics in time, nor fringes of two cavities."""

    def curve(time, drive, response):
        x = (drive - 3.3) / 0.08
        return 0.5 * x / (1.0 + x**2)

    found = diagnose(None, with_added(curve), candidates=(Pickup, Etalon, Delay), scan=False)
    assert found.verdict.name == "unlisted"
    assert not any("another form" in note for note in found.notes)


@pytest.mark.slow
def test_noise_about_one_frequency_is_no_drift():
    """A walk explains all of it; noise about one frequency does so with fewer functions."""
    recording = with_added(in_session(hunting_controller()))
    found = diagnose(None, recording, candidates=(Drift, Creep), scan=False)
    assert found.verdict.name != Drift.name
    assert not any("another form" in note for note in found.notes)
