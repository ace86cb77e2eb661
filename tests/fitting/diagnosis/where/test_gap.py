"""Size of the gap, lines, and closed fractions, against errors and noise that are known."""

import dataclasses

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from silent import noise, session

from fitting.diagnosis.how_far._bootstrap import closed_fraction
from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum, measure_spectrum
from fitting.diagnosis.where._gap import measure_gap, split_gap
from fitting.diagnosis.where._harmonics import control_false_discoveries, find_harmonics
from fitting.diagnosis.where._sums_of_squares import sum_squares
from fitting.diagnosis.where._tones import find_tones, remove_tones


def wave(parts: list[PeriodBlock], rms: float, harmonic: int = 3) -> list[np.ndarray]:
    return [
        np.tile(rms * np.sqrt(2) * np.cos(2 * np.pi * harmonic * b.phase), (b.periods, 1))
        for b in parts
    ]


def tone(parts: list[PeriodBlock], rms: float, hertz: float) -> list[np.ndarray]:
    return [rms * np.sqrt(2) * np.sin(2 * np.pi * hertz * b.time) for b in parts]


def plus(one: list[np.ndarray], other: list[np.ndarray]) -> list[np.ndarray]:
    return [a + b for a, b in zip(one, other, strict=True)]


# --- the gap


@pytest.mark.slow
@pytest.mark.parametrize("low", [0.0, 3.0])
@pytest.mark.parametrize("rms", [0.0, 0.4])
def test_estimates_lie_within_their_own_standard_errors(low: float, rms: float):
    """Over 120 sessions z has mean 0 and deviation 1: bands are 0.35 and 0.8 to 1.25."""
    _, parts = session()
    z = []
    for seed in range(120):
        e = plus(noise(np.random.default_rng(seed), parts, low), wave(parts, rms))
        g = measure_gap(e, parts, measure_spectrum(e, parts))
        z.append(
            [
                (g.structural2 - rms**2) / g.structural2_stderr,
                (g.synchronous - rms**2) / g.synchronous_stderr,
                g.nonsynchronous / g.nonsynchronous_stderr,
            ]
        )
    assert (np.abs(np.mean(z, axis=0)) < 0.35).all()
    assert ((np.std(z, axis=0) > 0.8) & (np.std(z, axis=0) < 1.25)).all()


def test_a_tone_between_the_lines_is_not_locked_and_found_in_whole():
    """Mean square 0.16. By its definition `locked` holds -1/(P - 1) = -1/4 of it, or some more."""
    _, parts = session(phases=780)
    white = Spectrum.of_white(1.0)
    pure = tone(parts, 0.4, 47.3)
    synchronous = measure_gap(
        pure, parts, white
    ).synchronous  # of the tone itself, by its own scatter
    assert -0.16 / 4 - 0.005 < synchronous < 0.16 / 4
    z, whole = [], []
    for seed in range(40):
        g = measure_gap(plus(noise(np.random.default_rng(seed), parts), pure), parts, white)
        z.append((g.synchronous - synchronous) / g.synchronous_stderr)
        whole.append((g.structural2 - 0.16) / g.structural2_stderr)
        assert g.nonsynchronous > 0.1
        assert g.significant
    assert abs(np.mean(z)) < 0.5
    assert abs(np.mean(whole)) < 0.5


def test_noise_alone_is_seldom_significant():
    """At 1 %: of 600 sessions up to 15 (0.1 % chance of more)."""
    _, parts = session(rates=(10.0, 40.0), phases=60)
    white = Spectrum.of_white(1.0)
    rng = np.random.default_rng(0)
    alarms = sum(measure_gap(noise(rng, parts), parts, white).significant for _ in range(600))
    assert alarms <= 15


@pytest.mark.slow
def test_noise_alone_is_seldom_significant_with_a_measured_spectrum():
    _, parts = session()
    alarms = 0
    for seed in range(150):
        e = noise(np.random.default_rng(1000 + seed), parts, 3.0 * (seed % 2))
        alarms += measure_gap(e, parts, measure_spectrum(e, parts)).significant
    assert alarms <= 6  # 1.5 expected; 0.1 % chance of more


def test_the_definition_and_the_identity():
    """G2 by its formula, written out; total^2 is the sum of the three parts, run by run too."""
    _, parts = session(rates=(10.0, 30.0))
    e = plus(noise(np.random.default_rng(1), parts), wave(parts, 0.3))
    g = measure_gap(e, parts, Spectrum.of_white(1.0))
    mean = [x.mean(axis=0) for x in e]
    s2 = [x.var(axis=0, ddof=1) for x in e]
    synchronous = [np.mean(m**2) - np.mean(s) / 5 for m, s in zip(mean, s2, strict=True)]
    assert g.synchronous == pytest.approx(np.mean(synchronous), rel=1e-12)
    assert g.nonsynchronous == pytest.approx(np.mean(s2) - 1.0, rel=1e-9)
    assert [r.synchronous for r in g.runs] == pytest.approx(synchronous, rel=1e-12)
    for part in (g, *g.runs):
        assert part.noise_floor is not None
        whole = part.synchronous + part.nonsynchronous + part.noise_floor**2
        assert part.total**2 == pytest.approx(whole, rel=1e-12)


def test_fitted_parameters_and_origins_are_counted():
    """A fit of 30 waves takes the noise out of 30 of 156 phases a run; the count puts it back."""
    _, parts = session()
    white = Spectrum.of_white(1.0)
    basis, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((156, 30)))
    counted, naive = [], []
    for seed in range(60):
        e = noise(np.random.default_rng(seed), parts)
        e = [x - (basis @ (basis.T @ x.mean(axis=0)))[None, :] for x in e]
        g = measure_gap(e, parts, white, fitted=30 * len(parts))
        counted.append(g.synchronous / g.synchronous_stderr)
        naive.append(measure_gap(e, parts, white).synchronous / g.synchronous_stderr)
    assert abs(np.mean(counted)) < 0.4
    assert np.mean(naive) < -1.5
    offset = [x + 50.0 * (k + 1) for k, x in enumerate(noise(np.random.default_rng(0), parts))]
    g = measure_gap(offset, parts, white, own_origin=True)
    assert abs(g.synchronous) < 4 * g.synchronous_stderr
    assert not g.significant
    assert measure_gap(offset, parts, white).significant


def test_masked_readings_have_no_weight():
    _, parts = session(rates=(10.0, 20.0))
    rng = np.random.default_rng(4)
    masked = [dataclasses.replace(b, use=(rng.random(b.use.shape) > 0.2) * 1.0) for b in parts]
    z = []
    for seed in range(60):
        e = plus(noise(np.random.default_rng(seed), parts), wave(parts, 0.3))
        e = [x * b.use for x, b in zip(e, masked, strict=True)]
        g = measure_gap(e, masked, Spectrum.of_white(0.8))  # as zeros lower the lines
        assert g.noise_floor == pytest.approx(1.0, rel=0.03)
        z.append((g.synchronous - 0.09) / g.synchronous_stderr)
    assert abs(np.mean(z)) < 0.5
    one = sum_squares([e * 0 + 7.0 for e in e], masked, Spectrum.of_white(1.0))
    assert one[0].mean == pytest.approx(np.full(156, 7.0))


def test_one_period_gives_a_lower_edge_and_no_floor():
    _, parts = session(rates=(10.0, 20.0), periods=1, phases=600)
    e = noise(np.random.default_rng(0), parts)
    spectrum = measure_spectrum(e, parts)
    assert not spectrum.measured
    quiet = measure_gap(e, parts, spectrum)
    assert quiet.noise_floor is None
    assert not quiet.significant
    assert "lower bound" in quiet.note
    loud = measure_gap(plus(e, wave(parts, 3.0)), parts, spectrum)
    assert loud.significant
    assert loud.synchronous == pytest.approx(9.0, rel=0.15)


@pytest.mark.parametrize(
    ("given", "refit", "floor"),
    [(5.0, 3.0, 1.0), (None, 3.0, 1.0), (2.0, 3.0, 1.0), (0.9, 0.99, 1.0), (4.0, 2.0, None)],
)
def test_the_parts_of_the_total_sum_up(given: float | None, refit: float, floor: float | None):
    found = split_gap(given, refit, floor)
    squares = [(found[k] or 0.0) ** 2 for k in ("parametric", "structural", "noise_floor")]
    assert found["total"] ** 2 == pytest.approx(sum(squares), rel=1e-12)
    assert min(squares) >= 0
    if given is None or given < refit:
        assert found["parametric"] == 0


# --- lines


@pytest.mark.slow
def test_p_values_of_harmonics_are_uniform_and_false_ones_rare():
    """Harmonics are judged by lines beside them, so 3 % have p < 0.03 in coloured noise too."""
    _, parts = session()
    p, named = [], 0
    for seed in range(100):
        e = noise(np.random.default_rng(seed), parts, 3.0 * (seed % 2))
        found = find_harmonics(e, parts, measure_spectrum(e, parts), [])
        p += [h.p_value for h in found if h]
        named += any(h.significant.any() for h in found if h)
    share = np.mean(np.concatenate(p) < 0.03)
    assert 0.027 < share < 0.033  # 30 800 tests: three standard errors
    assert named <= 5


def test_harmonics_and_a_tone_are_told_apart():
    """50 Hz is the fifth harmonic of the first run, and between the lines of the others."""
    _, parts = session()
    e = plus(noise(np.random.default_rng(2), parts), wave(parts, 0.5, harmonic=7))
    e = plus(e, tone(parts, 0.4, 50.0))
    spectrum = measure_spectrum(e, parts)
    found = find_tones(e, parts, spectrum)
    assert len(found) == 1
    assert found[0].hz == pytest.approx(50.0, abs=0.5)
    assert found[0].amplitude == pytest.approx(0.4 * np.sqrt(2), rel=0.15)
    assert found[0].p_value < 1e-6
    for h, hz in zip(find_harmonics(e, parts, spectrum, found), (10, 20, 30, 40), strict=True):
        assert h is not None
        assert h.significant[6]
        assert h.amplitude[6] == pytest.approx(0.5 * np.sqrt(2), rel=0.25)
        assert h.hertz[6] == pytest.approx(7 * hz)
        assert h.significant.sum() <= 3
    cleaned = remove_tones(e, parts, found)
    assert find_tones(cleaned, parts, spectrum) == []


@pytest.mark.slow
@pytest.mark.parametrize("low", [0.0, 3.0])
def test_tones_in_noise_alone_are_rare(low: float):
    """At 1 %: of 150 sessions up to 6 (0.1 % chance of more)."""
    _, parts = session()
    alarms = 0
    for seed in range(150):
        e = noise(np.random.default_rng(seed), parts, low)
        alarms += bool(find_tones(e, parts, measure_spectrum(e, parts)))
    assert alarms <= 6


def test_no_tone_is_claimed_from_one_period():
    _, parts = session(periods=1)
    e = plus(noise(np.random.default_rng(0), parts), tone(parts, 3.0, 50.0))
    assert find_tones(e, parts, measure_spectrum(e, parts)) == []


@hypothesis.given(st.lists(st.floats(0.0, 1.0), max_size=60), st.integers(1, 12))
def test_false_discoveries_are_controlled_as_defined(values: list[float], power: int):
    """Those at or below the largest p(k) with p(k) <= k/n of the level (Benjamini, Hochberg)."""
    p = np.array(values) ** power
    ordered = np.sort(p)
    under = [x for k, x in enumerate(ordered, 1) if x * (p.size / k) <= 0.01]
    expected = p <= max(under, default=-1.0)
    np.testing.assert_array_equal(control_false_discoveries(p), expected)


# --- the closed fraction


def _closing(
    rng: np.random.Generator, parts: list[PeriodBlock], left: float, spread: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Errors before and after; `left` of the mean square, on average over runs."""
    e, error = noise(rng, parts), wave(parts, 0.8)
    share = left * np.exp(spread * rng.standard_normal(len(parts)) - spread**2 / 2)
    after = [x + w * np.sqrt(s) for x, w, s in zip(e, error, share, strict=True)]
    return plus(e, error), after


@pytest.mark.slow
@pytest.mark.parametrize(("left", "spread"), [(0.1, 0.0), (0.1, 0.7), (0.5, 0.0), (0.5, 0.4)])
def test_intervals_cover_the_truth(left: float, spread: float):
    """95 % intervals cover 90 to 99 % of 160 truths; runs that close alike, and that do not."""
    _, parts = session(rates=(10.0, 20.0, 30.0, 40.0) * 2)
    covered = 0
    for seed in range(160):
        before, after = _closing(np.random.default_rng(seed), parts, left, spread)
        found = closed_fraction(
            before, after, parts, measure_spectrum(before, parts), draws=400, seed=seed
        )
        assert found is not None
        covered += found["low"] <= 1.0 - left <= found["high"]
    assert 0.90 <= covered / 160 <= 0.99


def test_there_is_no_closed_fraction_without_a_gap():
    _, parts = session()
    e = noise(np.random.default_rng(0), parts)
    assert closed_fraction(e, e, parts, measure_spectrum(e, parts)) is None


def test_fewer_runs_and_periods_make_intervals_wider():
    """On average over 30 sessions, with a gap far above the noise."""
    white = Spectrum.of_white(1.0)
    width = []
    for runs, periods in ((4, 5), (1, 5), (1, 1)):
        _, parts = session(rates=(10.0, 20.0, 30.0, 40.0)[:runs], periods=periods)
        each = []
        for seed in range(30):
            before, after = _closing(np.random.default_rng(seed), parts, 0.2, 0.0)
            before, after = plus(before, wave(parts, 0.8)), plus(after, wave(parts, 0.2))
            found = closed_fraction(before, after, parts, white, draws=300)
            assert found is not None
            assert found["low"] < found["value"] < found["high"]
            each.append(found["high"] - found["low"])
        width.append(float(np.mean(each)))
    assert width == sorted(width)


def test_the_last_period_alone_may_be_held_out():
    """Four runs of one period each: 95 % intervals cover at least 90 % of 200 truths."""
    _, parts = session()
    white = Spectrum.of_white(1.0)
    covered = 0
    for seed in range(200):
        both = _closing(np.random.default_rng(seed), parts, 0.1, 0.0)
        before, after = ([e[-1:] for e in x] for x in both)
        found = closed_fraction(before, after, parts, white, apart=True, draws=300)
        assert found is not None
        covered += found["low"] <= 0.9 <= found["high"]
    assert covered >= 180
