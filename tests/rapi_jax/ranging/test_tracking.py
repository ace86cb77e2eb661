"""Tracks against a dense least-squares solution, and against targets whose motion is known."""

import jax
import jaxtyping
import moving_targets as targets
import numpy as np
import pytest
from tracked_shares import shares

from rapi_jax import DataError
from rapi_jax.ranging.tracking import Observations, _estimates, _hypotheses, _likelihood, track


def _observe(rng, velocity, *, scans=60, error=targets.ERROR, stated=None, first=0.7):
    t, gain = targets.middles(scans)
    truth = targets.constant(t, velocity, first=first)
    y = targets.apparent(rng, gain, *truth, error=error)
    return Observations(t, y, np.full(scans, stated or error), gain), truth


def _covered(found, truth, stderr):
    return float(np.mean(np.abs(found - truth) < 1.96 * stderr))


def _dense(observations, signed, intensity, order):
    """All states at once, as one whitened least-squares problem; no prior."""
    n, d = observations.size, order + 1
    rows, right = [], []
    for k in range(n):
        row = np.zeros((1, n * d))
        row[0, k * d : (k + 1) * d] = observations.gains(order)[k] / observations.stderr_m[k]
        rows.append(row)
        right.append([signed[k] / observations.stderr_m[k]])
    for k in range(n - 1):
        s = observations.time_s[k + 1] - observations.time_s[k]
        if order == 1:
            move = np.array([[1, s], [0, 1]])
            noise = np.array([[s**3 / 3, s**2 / 2], [s**2 / 2, s]])
        else:
            move = np.array([[1, s, s**2 / 2], [0, 1, s], [0, 0, 1]])
            x, w = np.polynomial.legendre.leggauss(6)
            tau = s * (x + 1) / 2
            g = np.stack([tau**2 / 2, tau, np.ones(6)])
            noise = (g * w * s / 2) @ g.T
        white = np.linalg.inv(np.linalg.cholesky(intensity * noise))
        row = np.zeros((d, n * d))
        row[:, k * d : (k + 1) * d] = -white @ move
        row[:, (k + 1) * d : (k + 2) * d] = white
        rows.append(row)
        right.append(np.zeros(d))
    matrix, vector = np.concatenate(rows), np.concatenate(right)
    q, r = np.linalg.qr(matrix)
    inverse = np.linalg.inv(r)
    mean, cov = inverse @ (q.T @ vector), inverse @ inverse.T
    return mean.reshape(n, d), np.sqrt(np.diag(cov)).reshape(n, d)


@pytest.mark.parametrize("order", (1, 2))
def test_smoother_is_the_least_squares_solution(order):
    """Mean and standard errors of the joint Gaussian of 30 scans at irregular times."""
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.03, 0.09, 30))
    gain = rng.choice([-1.0, 1.0], 30) * rng.uniform(200, 260, 30)
    error = rng.uniform(0.5, 2.0, 30) * 1e-5
    y = np.abs(0.7 + 0.0 * t + error * rng.standard_normal(30))
    seen = Observations(t, y, error, gain, np.full(30, 0.5))
    intensity = 1e-13 if order == 1 else 1e-11
    found = track(seen, order=order, intensity=intensity)
    assert found.sign.min() == 1 and not found.gated.any() and found.scale == 1.0
    mean, stderr = _dense(seen, y, intensity, order)
    near = {"rtol": 0.0, "atol": 1e-4}
    np.testing.assert_allclose((found.distance - mean[:, 0]) / stderr[:, 0], 0.0, **near)
    np.testing.assert_allclose((found.velocity - mean[:, 1]) / stderr[:, 1], 0.0, **near)
    np.testing.assert_allclose(found.distance_stderr, stderr[:, 0], rtol=1e-4)
    np.testing.assert_allclose(found.velocity_stderr, stderr[:, 1], rtol=1e-4)


@pytest.mark.parametrize("velocity", (0.0, 0.002, 0.005, 0.05, -0.03))
def test_signs_of_scans_are_found(velocity):
    """Above L / G = 2.7 mm/s one of the two directions reads a folded distance."""
    seen, (distance, v) = _observe(np.random.default_rng(1), velocity)
    found = track(seen)
    signed = distance + seen.doppler_gain_s * v
    assert (found.sign == np.sign(signed)).all() and found.odds > 1e3
    assert not found.gated.any() and found.changes == () and found.notes == ()
    assert (np.abs(found.distance - distance) < 5 * found.distance_stderr).all()
    assert (np.abs(found.velocity - v) < 5 * found.velocity_stderr).all()


def test_scans_near_the_fold_are_left_out_and_said():
    """With errors of 1 mm, scans that read a few mm may be of either sign."""
    seen, (distance, v) = _observe(np.random.default_rng(2), 0.7 / targets.GAIN, error=1e-3)
    found = track(seen)
    assert found.folded.any() and (found.folded <= found.gated).all()
    assert "too near zero" in " ".join(found.notes)
    assert _covered(found.distance, distance, found.distance_stderr) > 0.9


def test_outliers_are_gated_and_the_filter_goes_on_after_a_gap():
    seen, (distance, _) = _observe(np.random.default_rng(4), 0.01, scans=80)
    y = seen.apparent_m.copy()
    y[[20, 50]] += [3e-4, -0.2]
    keep = np.r_[0:30, 42:80]
    spoiled = Observations(*(c[keep] for c in (seen.time_s, y, seen.stderr_m, seen.doppler_gain_s)))
    found = track(spoiled)
    assert set(np.flatnonzero(found.gated)) == {20, int(np.flatnonzero(keep == 50)[0])}
    assert found.changes == () and "2 scan(s) are gated" in found.notes[0]
    assert (np.abs(found.distance - distance[keep]) < 5 * found.distance_stderr).all()


def test_another_target_is_a_change():
    """A run of scans that do not fit is no run of outliers for ever."""
    t, gain = targets.middles(60)
    distance = np.where(np.arange(60) < 30, 0.6, 0.75)
    y = targets.apparent(np.random.default_rng(5), gain, distance, np.zeros(60))
    found = track(Observations(t, y, np.full(60, targets.ERROR), gain))
    assert found.changes == (30,) and not found.gated.any()
    assert "another distance" in " ".join(found.notes)
    assert (np.abs(found.distance - distance) < 5 * found.distance_stderr).all()


def test_a_stage_that_starts_and_stops_is_two_changes():
    t, gain = targets.middles(80)
    distance, v = targets.stage(t, 0.05, begin=1.31, end=2.74)
    y = targets.apparent(np.random.default_rng(6), gain, distance, v)
    found = track(Observations(t, y, np.full(80, targets.ERROR), gain))
    assert len(found.changes) == 2
    assert _covered(found.distance, distance, 2.5 * found.distance_stderr) == 1.0
    assert _covered(found.velocity, v, 2.5 * found.velocity_stderr) == 1.0
    steady = ~found.gated
    assert found.distance_stderr[steady].max() < 1e-5 < found.distance_stderr[~steady].min()


def test_errors_stated_too_small_are_scaled():
    seen, _ = _observe(np.random.default_rng(7), 0.0, scans=120, error=2e-5, stated=1e-5)
    found = track(seen)
    assert abs(found.scale - 2.0) < 0.3 and "were scaled" in " ".join(found.notes)
    good, _ = _observe(np.random.default_rng(7), 0.0, scans=120)
    assert track(good).scale == 1.0


def test_intensity_is_found_within_its_interval():
    """White noise of acceleration, integrated exactly between scans."""
    rng = np.random.default_rng(8)
    t, gain = targets.middles(200)
    q, s = 1e-11, 1.0 / targets.RATE
    cholesky = np.linalg.cholesky(q * np.array([[s**3 / 3, s**2 / 2], [s**2 / 2, s]]))
    state, path = np.array([0.7, 0.01]), []
    for _ in t:
        path.append(state)
        state = np.array([[1, s], [0, 1]]) @ state + cholesky @ rng.standard_normal(2)
    distance, v = np.array(path).T
    found = track(
        Observations(t, targets.apparent(rng, gain, distance, v), np.full(200, 1e-5), gain)
    )
    low, high = found.intensity_interval
    assert low < q < high < 3 * low
    assert 0.7 < np.nanmean(found.nis) < 1.3
    assert _covered(found.distance, distance, found.distance_stderr) > 0.85
    assert _covered(found.velocity, v, found.velocity_stderr) > 0.85


def test_two_tracks_that_fit_alike_are_said():
    """Distance and Doppler shift change roles with the signs; a range of distances settles it."""
    seen, (distance, _) = _observe(np.random.default_rng(9), 0.05, scans=6, error=1e-3)
    found = track(seen, intensity=1e-6)
    assert found.odds < 20 and "Another track fits" in found.notes[0]
    sure = track(seen, intensity=1e-6, expected_m=(0.5, 1.0))
    assert sure.odds > 20
    assert (np.abs(sure.distance - distance) < 5 * sure.distance_stderr).all()


def test_another_number_of_scans_compiles_nothing():
    programs = (_hypotheses._follow, _likelihood.log_likelihoods, _estimates._smoothed)
    track(_observe(np.random.default_rng(0), 0.01, scans=40)[0])
    before = [program._cache_size() for program in programs]
    track(_observe(np.random.default_rng(0), 0.01, scans=57)[0])
    assert [program._cache_size() for program in programs] == before


def test_track_is_float64_whatever_the_hosts_flag():
    seen, _ = _observe(np.random.default_rng(1), 0.05, scans=40)
    expected = track(seen)
    with jax.enable_x64(False):
        found = track(seen)
        assert not jax.config.jax_enable_x64
    np.testing.assert_array_equal(found.distance, expected.distance)


def test_observations_that_cannot_be_are_refused():
    t, gain = targets.middles(5)
    ones = np.ones(5)
    with pytest.raises(DataError, match="must increase, but does not at scan 1"):
        Observations(t[::-1].copy(), ones, ones, gain)
    with pytest.raises(DataError, match="scan 2: its error must be positive"):
        Observations(t, ones, np.where(t == t[2], 0.0, 1.0), gain)
    with pytest.raises((DataError, jaxtyping.TypeCheckError), match="apparent_m"):
        Observations(t, ones[:4], ones, gain)
    with pytest.raises(DataError, match="too few"):
        Observations(t[:2], ones[:2], ones[:2], gain[:2])
    seen = Observations(t, ones, ones, gain)
    with pytest.raises(DataError, match="`order`"):
        track(seen, order=3)
    with pytest.raises(DataError, match="`expected_m`"):
        track(seen, expected_m=(1.0, 0.5))


REPLICATES = 60
MOTIONS = [("constant", 0.0), ("constant", 0.05), ("vibrating", 0.0), ("stage", 0.05)]


@pytest.mark.slow
@pytest.mark.parametrize(("motion", "velocity"), MOTIONS)
def test_intervals_hold_the_truth(motion, velocity):
    """Shares of 95 % intervals within three standard errors of a share; 300 replicates of more
    motions in `tests/benchmarks/ranging.py tracking`.

    Of a shaking target, distances are on the safe side: a vibration of the scan rate's half looks
    like another distance, and is allowed for.
    """
    distances, velocities = shares(motion, velocity, REPLICATES)
    spread = 3 * np.sqrt(0.95 * 0.05 / REPLICATES)
    assert distances > 0.95 - spread and velocities > 0.95 - spread
