"""Each unlisted effect of the third set against its law computed another way; numbered, so that
a list of tests does not name them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, signal
from unseen_devices import TRIANGLE, acts, change, difference, on_waves, parameters, world

from fitting.blind.simulator.effects.third._third_unlisted_readout import count_late, held_means


def test_unlisted_1():
    w = world("accommodation", "unlisted")
    p = parameters(w)
    decay = np.exp(-1 / p["decay"])
    for rate, lead in ((5.0, 2), (20.0, 2), (80.0, 8)):
        d = change(w, replace(TRIANGLE, rate_hz=rate))
        np.testing.assert_allclose(d[400:], decay * d[:-400], atol=1e-9)
        first = p["sign"] * p["size"] * 4.2 / p["reference"] * decay**lead
        assert d[0] == pytest.approx(first)
        half = change(w, replace(TRIANGLE, rate_hz=rate, swing=2.1))
        np.testing.assert_allclose(half, d / 2, atol=1e-9)


def test_unlisted_2():
    w = world("charge_leak", "unlisted")
    leak = parameters(w)["leak"]
    t = np.arange(400_000) * 5e-5
    found = acts(w, "drive", np.full_like(t, 4.0), t) - 3.0
    np.testing.assert_allclose(found, np.exp(-leak * (t + 2.5e-5)), atol=1e-4)  # a step is lost
    s = 2j * np.pi * 5.0
    expected = (s / (s + leak) * np.exp(s * t)).imag
    found = acts(w, "drive", 3.0 + np.sin(2 * np.pi * 5.0 * t), t) - 3.0
    np.testing.assert_allclose(found[-9000:], expected[-9000:], atol=1e-4 + np.exp(-leak * 18))


def test_unlisted_3():
    w = world("converter_ripple", "unlisted")
    p = parameters(w)
    scans = [run.scan for run in w.runs]
    low, high = min(s.drive.min() for s in scans), max(s.drive.max() for s in scans)
    t: np.ndarray = np.arange(100_000) * 1e-5
    for height in (0.0, 0.5, 1.0):
        u = np.full_like(t, low + height * (high - low))
        ripple = acts(w, "drive", u, t) - u
        assert np.max(np.abs(ripple)) == pytest.approx(p["ripple"], rel=1e-3)
        crossings = np.flatnonzero((ripple[1:] > 0) & (ripple[:-1] <= 0))
        found = (len(crossings) - 1) / (t[crossings[-1]] - t[crossings[0]])
        expected = p["centre"] * (1 + p["bend"] * (2 * height - 1))
        assert found == pytest.approx(expected, rel=0.02)
    chirp = acts(w, "drive", low + (high - low) * t, t) - (low + (high - low) * t)
    turned = np.unwrap(np.angle(signal.hilbert(chirp)))
    assert (turned[-3000] - turned[3000]) / (2 * np.pi) == pytest.approx(
        p["centre"] * 0.94, rel=0.02
    )


def test_unlisted_4():
    w = world("cycle_slips", "unlisted")
    p = parameters(w)
    slips, seconds = 0, 0.0
    for run, d in zip(w.runs, difference(w), strict=True):
        counts = d / p["fringe"]
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        assert d[0] == 0  # set to zero as the run begins
        slips += int(np.sum(np.abs(np.diff(np.round(counts)))))
        seconds += run.scan.duration_s
    assert slips == pytest.approx(seconds / p["mean_s"], abs=4 * (seconds / p["mean_s"]) ** 0.5 + 2)
    t: np.ndarray = np.arange(40_000) * 1e-3
    long = acts(w, "light", np.zeros_like(t), t, replace(TRIANGLE, start_s=0.0)) / p["fringe"]
    steps = np.diff(np.round(long))
    assert {-1.0, 1.0} <= set(np.unique(steps)) and np.max(np.abs(steps)) <= 2


def test_unlisted_5():
    w = world("hum_modulation", "unlisted")
    p = parameters(w)
    t: np.ndarray = np.arange(5000) * 1e-4
    np.testing.assert_array_equal(acts(w, "drive", np.full_like(t, 3.0), t), 3.0)
    for far in (2.0, -1.0):
        more = (acts(w, "drive", np.full_like(t, 3.0 + far), t) - 3.0) / far - 1
        turn = 2 * np.pi * p["frequency"] * t
        found = on_waves(more, turn, 2 * turn)
        np.testing.assert_allclose(found, [p["modulation"], p["modulation"] / 2], rtol=1e-6)
    assert p["frequency"] in (100.0, 120.0)


def test_unlisted_6():
    w = world("injection_locking", "unlisted")
    p = parameters(w)
    reach = p["range"]
    off = reach * np.array([-3.0, -1.2, -0.6, 0.0, 0.5, 0.99, 1.1, 2.0])
    t = np.arange(len(off)) * 1.0
    found = acts(w, "light", p["other"] + off, t) - p["other"]
    for detuning, mean in zip(off / reach, found / reach, strict=True):
        # Adler's equation for the phase between the lasers, from its integral over one beat.
        beat = 0.0
        if abs(detuning) > 1:
            lasts = integrate.quad(lambda a, d=detuning: 1 / (d - np.sin(a)), 0, 2 * np.pi)[0]
            beat = 2 * np.pi / lasts
        assert mean == pytest.approx(beat, abs=1e-6)


@pytest.mark.parametrize("late", [0.0, 3e-6, 1e-4, 2.37e-3])
def test_unlisted_7(late):
    t: np.ndarray = np.arange(8000) * 1e-5
    nu = 50 * (1 - np.abs(np.mod(50 * t, 2) - 1))  # up and down within 20 ms each
    d = count_late(nu, 1e-5, late) - nu
    place = np.mod(t, 0.04)
    high = np.clip(place - 0.02, 0.0, late) - np.where(t >= 0.04, np.clip(late - place, 0, late), 0)
    expected = 2 * 2500.0 * np.where(place >= 0.02, high, np.clip(late - place, 0, late))
    expected[t < 0.02] = 0.0  # it begins with the right direction
    begins = 10 + int(late / 1e-5) + 1
    np.testing.assert_allclose(d[begins:], (expected + d[begins])[begins:], atol=0.06)
    w = world("late_reversal", "unlisted")
    for run, of in zip(w.runs, difference(w), strict=True):
        assert of[0] == 0
        on = np.abs(np.diff(of)) > 1e-6  # it goes wrong about turns alone
        turns = 2 * run.scan.rate_hz * parameters(w)["late"] + 8 / run.scan.samples
        assert on.any() and np.mean(on) < turns


def test_unlisted_8():
    w = world("photothermal", "unlisted")
    p = parameters(w)
    t = np.arange(20_000) * p["tau"] / 1000
    rest = max(1 - ((w.signal_path.rest - p["peak"]) / p["width"]) ** 2, 0.0)
    for far, power in ((0.0, 1.0), (0.5, 0.75), (-0.5, 0.75), (1.0, 0.0), (2.0, 0.0)):
        nu = np.full_like(t, p["peak"] + far * p["width"])
        d = (acts(w, "light", nu, t) - nu) / p["size"]
        expected = power + (rest - power) * np.exp(-t / p["tau"])
        np.testing.assert_allclose(d, expected, atol=2e-3)


def test_unlisted_9():
    w = world("quadratic_drag", "unlisted")
    p = parameters(w)
    t: np.ndarray = np.arange(20_000) * 1e-5
    for f in (5.0, 40.0):
        turn = 2 * np.pi * f * t
        d = acts(w, "displacement", 30 * np.sin(turn), t) - 30 * np.sin(turn)
        wave = np.cos(turn) * np.abs(np.cos(turn))
        expected = -p["size"] * (2 * np.pi * f * 30 / p["fastest"]) ** 2 * wave
        np.testing.assert_allclose(d[1:-1], expected[1:-1], atol=1e-4 * np.max(np.abs(expected)))
    steps = [r.scan.step_s for r in w.runs]
    fastest = [np.max(np.abs(np.diff(nu))) / s for nu, s in zip(w.without, steps, strict=True)]
    assert p["fastest"] == pytest.approx(max(fastest))


@pytest.mark.parametrize("window", [3e-6, 2.4e-5, 7e-4, 1.3e-2])
def test_unlisted_10(window):
    rng = np.random.default_rng(3)
    t, begin = 2.0 + np.arange(3000) * 1e-5, 1.2345
    nu = np.cumsum(rng.standard_normal(3000))
    found = held_means(nu, t, window, begin)
    for k in range(0, 3000, 61):
        last = begin + window * np.floor((t[k] - begin) / window)
        if last - window < t[0]:
            continue
        knots = t[(t > last - window) & (t < last)]
        x = np.concatenate(([last - window], knots, [last]))
        mean = integrate.trapezoid(np.interp(x, t, nu), x) / window
        assert found[k] == pytest.approx(mean, abs=1e-6)
    ramp = held_means(t, t, window, begin)
    kept = t > t[0] + 2 * window
    assert np.min((t - ramp)[kept]) >= window / 2 - 1e-9
    assert np.max((t - ramp)[kept]) <= 1.5 * window + 1e-9
    if window > 1e-5:
        assert len(np.unique(np.round(ramp[kept], 9))) <= np.ptp(t[kept]) / window + 2


def test_unlisted_10_before_its_first_window_reads_the_first_value():
    t = np.arange(1000) * 1e-4
    found = held_means(5 + t, t, 0.03, -0.01)
    assert (found[:200] == 5).all() and found[200] == pytest.approx(5.01)
    np.testing.assert_array_equal(held_means(t, t, 1e-12, 0.0), t)
