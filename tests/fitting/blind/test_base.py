"""Bases of worlds against a loop over Eq. (9), the paper's table and a fit of its operator."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from fitting.blind.simulator._piezo import Piezo, draw_other_form, draw_paper_form
from fitting.blind.simulator._plays import play_memory, stretch_index, turning_points
from fitting.blind.simulator._scan import Scan
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device


def looped(u, r, slope, offset, curvature):
    """One operator, sample by sample."""
    least = u.min()
    y = max(least - r, slope * least + offset + curvature * (least - 3) ** 2)
    out = []
    for v in u:
        y = max(v - r, min(slope * v + offset + curvature * (v - 3) ** 2, y))
        out.append(y)
    return np.array(out)


@pytest.mark.parametrize("seed", range(6))
def test_operators_of_whole_records_equal_the_loop(seed):
    """Also with plateaus, and with bounds that cross (slope below one)."""
    rng = np.random.default_rng(seed)
    u = 3 + np.clip(np.cumsum(rng.normal(0, 0.3, 400)), -2.5, 2.5)
    if seed % 2:
        u = np.round(u, 1)
    r, slope = rng.uniform(0, 1.5, 7), rng.uniform(0.7, 1.7, 7)
    offset, curvature = rng.uniform(0.0, 1.5, 7), float(rng.uniform(-0.05, 0.05))
    ends = turning_points(u)
    held = play_memory(u, ends, (r,), (slope, offset), curvature)[stretch_index(ends, len(u))]
    high = u[:, None] * slope + offset + curvature * ((u - 3) ** 2)[:, None]
    found = np.maximum(u[:, None] - r, np.minimum(high, held))
    for i in range(7):
        np.testing.assert_allclose(
            found[:, i], looped(u, r[i], slope[i], offset[i], curvature), atol=1e-12
        )


@pytest.mark.parametrize("make", [draw_paper_form, draw_other_form])
def test_a_base_is_the_sum_of_its_operators_and_its_polynomial(make):
    piezo = make(np.random.default_rng(3))
    u = Scan(20.0, 4.0, 3.0, "sine", 2, 150, phase=0.3).drive
    r = piezo.share * 4.0 / 2 + piezo.zeta * piezo.rate_law(20.0)
    p = piezo.weight * np.exp(-((piezo.decay * r) ** piezo.power))
    plays = [
        looped(u, *of)
        for of in zip(r, piezo.lam, piezo.eta * r, np.full(len(r), piezo.curvature), strict=True)
    ]
    expected = p @ np.array(plays) + sum(d * u**k for k, d in enumerate(piezo.line))
    total, hysteresis_part = piezo.respond(u, 20.0, 4.0)
    np.testing.assert_allclose(total, expected, atol=1e-9)
    middle = [
        (u - r[i] + piezo.lam[i] * u + piezo.eta[i] * r[i] + piezo.curvature * (u - 3) ** 2) / 2
        for i in range(len(r))
    ]
    np.testing.assert_allclose(hysteresis_part, p @ (np.array(plays) - np.array(middle)), atol=1e-9)


def test_the_published_device_has_the_published_nonlinearity():
    """Table 1, uncompensated, both branches at four rates."""
    n, ones = 10, np.ones(10)
    piezo = Piezo(
        share=0.28110 * np.arange(1, n + 1) / n, zeta=6.7126e-3 * ones, lam=1.6 * ones, eta=ones,
        weight=0.63170 * ones, decay=0.1, power=1.0, curvature=0.0,
        line=np.array([0.0, 18.787, -1.0789, 0.010040, 0.0]),
    )  # fmt: skip
    published = {10: (0.435, 3.28), 20: (0.400, 3.24), 30: (0.391, 3.12), 40: (0.400, 3.03)}
    for rate, expected in published.items():
        scan = Scan(float(rate), 4.5, 3.0, "triangle", 2, 4000)
        nu, _ = piezo.respond(scan.drive, scan.rate_hz, scan.swing)
        for branch, rms in zip((nu[4000:6000], nu[6000:]), expected, strict=True):
            y = branch[200:1800]
            t = np.arange(len(y))
            left = y - np.polyval(np.polyfit(t, y, 1), t)
            assert np.sqrt(np.mean(left**2)) == pytest.approx(rms, rel=0.012)


def rms_of_fit(world: SimulatedDevice, answers: tuple[np.ndarray, ...]) -> float:
    """Rms in GHz that the paper's operator leaves on noise-free answers of a world."""
    n = 12 if world.base_misfit else len(world.signal_path.piezo.share)
    ones, k = np.ones(n), np.arange(1, n + 1)
    parts, apart, count = [], 0.0, 0
    for run, nu in zip(world.runs, answers, strict=True):
        s = run.scan
        local = np.arange(-4 * s.samples, 4 * s.samples) * s.step_s / 4
        folded = nu.reshape(s.periods, -1)
        apart += float(np.sum((folded - folded.mean(axis=0)) ** 2))
        count += nu.size
        parts.append((s, s.voltage(local), folded.mean(axis=0) * np.sqrt(s.periods)))
    y = np.concatenate([mean for _, _, mean in parts])

    def left(theta):
        alpha, zeta, lam, eta, b = theta
        blocks = []
        for s, u, _ in parts:
            piezo = Piezo(
                alpha * k / n, zeta * ones, lam * ones, eta * ones, ones, float(b), 1.0, 0.0,
                np.zeros(5),
            )  # fmt: skip
            memory_part, _ = piezo.respond(u, s.rate_hz, s.swing)
            rows = slice(4 * s.samples, None, 4)
            block = np.column_stack([memory_part[rows], u[rows, None] ** np.arange(4)])
            blocks.append(np.sqrt(s.periods) * block)
        columns = np.concatenate(blocks)
        return columns @ np.linalg.lstsq(columns, y, rcond=None)[0] - y

    fits = [
        least_squares(left, start, x_scale=[0.3, 0.005, 1, 1, 0.2], max_nfev=40, diff_step=1e-4)
        for start in ([0.28, 0.0055, 1.45, 1.0, 0.15], [0.24, 0.0045, 1.3, 1.0, 0.1])
    ]
    return min(float(np.sqrt((np.sum(fit.fun**2) + apart) / count)) for fit in fits)


@pytest.mark.parametrize("seed", [0, 6])
def test_the_papers_operator_fits_half_of_the_bases_and_only_nearly_the_other_half(seed):
    inside, outside = (draw_device(seed, "null", base_misfit=misfit) for misfit in (False, True))
    assert rms_of_fit(inside, inside.noise_free) < 1e-3
    assert 0.015 < rms_of_fit(outside, outside.noise_free) < 0.15


@pytest.mark.parametrize("name", ["delay", "slew_limit", "pickup"])
def test_the_size_of_an_effect_is_about_what_a_refit_leaves_of_it(name):
    """The tangent space is wider than the paper's operator, so a refit leaves a little more."""
    w = draw_device(62, "listed", name, 6.0, base_misfit=False)
    assert 0.95 < rms_of_fit(w, w.noise_free) / (w.size * w.noise.rms) < 1.6
