"""Each form and unlisted effect of the second set, against its law computed another way."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate
from unseen_devices import TRIANGLE, clock, difference, parameters

from fitting.blind.simulator._scan import Scan, place_in_time
from fitting.blind.simulator._signal_path import RunState, SignalPath
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device
from fitting.blind.simulator.effects._listed_optical import creep_response
from fitting.blind.simulator.effects.second._second_forms_optical import stretched_exponential


@functools.cache
def world(name: str, kind: str = "form", seed: int = 5) -> SimulatedDevice:
    return draw_device(seed, kind, f"{name}/2" if kind == "form" else name, 6.0)


def ends(w: SimulatedDevice) -> tuple[float, float]:
    scans = [run.scan for run in w.runs]
    return min(s.drive.min() for s in scans), max(s.drive.max() for s in scans)


def driven(w: SimulatedDevice, scan: Scan) -> np.ndarray:
    (moment,) = w.signal_path.path([scan])
    count = scan.periods * scan.samples
    return moment.drive[:: w.signal_path.oversample][-count:]


def end_s(w: SimulatedDevice) -> float:
    return w.runs[-1].start_s + w.runs[-1].scan.duration_s


def test_lowpass_2():
    w = world("amplifier_lowpass")
    p = parameters(w)
    rising, falling = p["tau"], p["ratio"] * p["tau"]
    assert not 0.7 < falling / rising < 1.4
    lag = TRIANGLE.drive - driven(w, TRIANGLE)
    place = np.tile(np.arange(400) / 400, 3)
    slope = 2 * 40.0 * 4.2
    on = np.minimum(np.mod(place, 0.5), 0.5 - np.mod(place, 0.5)) > 0.1
    up = on & (place < 0.5)
    np.testing.assert_allclose(lag[up], slope * rising, rtol=2e-3)
    np.testing.assert_allclose(lag[on & (place > 0.5)], -slope * falling, rtol=2e-3)


def test_delay_2():
    w = world("delay")
    p = parameters(w)
    sine = replace(TRIANGLE, waveform="sine", samples=500)
    for start in (2.0, 0.4 * end_s(w), 3 * end_s(w)):
        found = driven(w, replace(sine, start_s=start))
        t = sine.time_s
        late = p["tau"] * (1 + p["start"] * np.exp(-(start + t) / p["settling_s"]))
        np.testing.assert_allclose(found, sine.voltage(t - late), atol=1e-4)


def test_slew_limit_2():
    w = world("slew_limit")
    p = parameters(w)
    low, high = ends(w)
    scan = max((r.scan for r in w.runs), key=lambda s: s.swing * s.rate_hz)
    steep = replace(scan, swing=high - low, bias=(high + low) / 2, rate_hz=1.3 * scan.rate_hz)
    (moment,) = w.signal_path.path([steep])
    slope = np.diff(moment.drive) / moment.step
    height = (moment.drive[:-1] - low) / (high - low)
    most = (1 - p["cut"]) * p["steepest"] * (1 + p["bend"] * (1 - height))
    assert (np.abs(slope) <= most * (1 + 1e-6)).all()
    apart = np.abs(moment.command - moment.drive)[1:] > 1e-9
    assert np.mean(apart) > 0.3
    np.testing.assert_allclose(np.abs(slope[apart]), most[apart], rtol=1e-6)


def test_saturation_2():
    w = world("saturation")
    p = parameters(w)
    low, high = ends(w)
    wide = max((r.scan for r in w.runs), key=lambda s: s.swing)
    found, t = driven(w, wide), wide.start_s + wide.time_s
    wave = np.cos(2 * np.pi * p["frequency"] * t + p["phase"] - np.pi / 2)
    rail = high - p["part"] * (high - low) * (1 + p["share"] * wave)
    cut = wide.drive > found + 1e-9
    assert cut.any() and not cut.all()
    np.testing.assert_allclose(found[cut], rail[cut], atol=1e-3 * (high - low) * p["part"])
    assert (wide.drive[~cut] <= rail[~cut] + 1e-6).all()


def test_quantisation_2():
    w = world("quantisation")
    p = parameters(w)
    drive = np.linspace(*ends(w), 20001)
    scan = replace(TRIANGLE, rate_hz=5.0, periods=1, samples=2000)
    found, code = driven(w, scan), np.round(scan.drive / p["step"])
    errors = found / p["step"] - code
    levels = {c: errors[code == c] for c in np.unique(code)}
    assert all(np.ptp(e) < 1e-9 for e in levels.values())
    each = np.array([e[0] for e in levels.values()])
    assert len(each) > 20 and np.std(each) == pytest.approx(p["spread"], rel=0.5)
    assert np.ptp(drive) > 20 * p["step"]


def test_rate_law_2():
    w = world("rate_law")
    p = parameters(w)
    law = w.signal_path.effects[0].law
    assert law is not None
    bare, changed = w.signal_path.piezo, law(w.signal_path.piezo)
    for f in (5.0, 20.0, 80.0):
        more = changed.thresholds(f, 4.0) - bare.thresholds(f, 4.0)
        loss = (2 / (1 + 1j * f / p["peak"])).imag  # of a Debye relaxator, 1 at its peak
        np.testing.assert_allclose(more, -loss * bare.zeta * p["height"] * p["peak"])


def test_amplitude_law_2():
    w = world("amplitude_law")
    p = parameters(w)
    for part in (1.0, 0.5):
        scan = replace(TRIANGLE, swing=part * p["reference"])
        d, nu = (
            w.simulate([scan])[0] - w.simulate_without_effects([scan])[0],
            w.simulate_without_effects([scan])[0],
        )
        (moment,) = SignalPath(w.signal_path.piezo, (), w.signal_path.oversample, 0.0).path([scan])
        wide = np.ptp(moment.hysteresis_part)
        assert np.ptp(d) == pytest.approx((1 - part) * p["part"] * wide, rel=0.02)
        # In the second half of a triangle the loop's opening has changed sides, and so has this.
        up, down = nu[50:150], nu[350:250:-1]
        more = -p["sign"] * (1 - part) * p["part"]
        change = d[50:150] - d[350:250:-1]
        inside = moment.hysteresis_part[:: w.signal_path.oversample][-1200:]
        np.testing.assert_allclose(change, more * (inside[50:150] - inside[350:250:-1]), atol=1e-9)
        assert (down > up).all()


def test_creep_2():
    w = world("creep")
    p = parameters(w)
    taus, weights = stretched_exponential(p["tau"], p["beta"])
    assert (weights > 0).all() and weights.sum() == pytest.approx(1.0)
    step = p["tau"] / 2000
    t: np.ndarray = np.arange(1, 20001) * step
    x = np.ones(20000)
    at_rest = RunState(TRIANGLE, 0, t, step, x, x, x, x, 0.0, None, 0.0, {})
    y = creep_response(x, at_rest, taus, weights)
    np.testing.assert_allclose(y[100:], 1 - np.exp(-((t[100:] / p["tau"]) ** p["beta"])), atol=5e-3)
    bare = SignalPath(w.signal_path.piezo, (), w.signal_path.oversample, w.signal_path.rest)
    state: dict = {}
    for moment, d in zip(bare.path([r.scan for r in w.runs]), difference(w), strict=True):
        y = creep_response(
            moment.operator_response - w.signal_path.rest,
            replace(moment, state=state),
            taus,
            weights,
        )
        np.testing.assert_allclose(
            d, p["gain"] * y[:: w.signal_path.oversample][-len(d) :], atol=1e-9
        )


@pytest.mark.parametrize("beta", np.linspace(0.35, 0.6, 11).tolist())
@pytest.mark.parametrize("tau", [0.1, 0.37, 2.0])
def test_creep_2_steps(beta, tau):
    taus, weights = stretched_exponential(tau, beta)
    t = tau * np.geomspace(1e-3, 10.0, 50)
    found = weights @ -np.expm1(-t / taus[:, None])
    np.testing.assert_allclose(found, 1 - np.exp(-((t / tau) ** beta)), atol=5e-3)
    assert len(weights) > 10


def test_resonance_2():
    w = world("resonance")
    p = parameters(w)
    for start in (0.0, end_s(w)):
        f = (1 + p["shift"] * (1 - np.exp(-start / p["warming_s"]))) / p["period"]
        slow = place_in_time([Scan(5.0, 1e-3, 3.0, "sine", 3, 200)], start)
        nu = w.simulate_without_effects(slow)[0]
        expected = -p["damping"] / (np.pi * f) * np.gradient(nu, slow[0].step_s)
        d = w.simulate(slow)[0] - nu
        assert np.max(np.abs((d - expected)[2:-2])) < 0.1 * np.max(np.abs(expected))
        # After a corner it rings at f.
        fast = place_in_time([replace(TRIANGLE, rate_hz=7.0, samples=4000, periods=1)], start)
        d = w.simulate(fast)[0] - w.simulate_without_effects(fast)[0]
        count = int(min(6 / f, 0.06) / fast[0].step_s)
        x: np.ndarray = np.arange(count) * fast[0].step_s
        fits = {}
        for g in f * np.linspace(0.8, 1.2, 161):
            decay = np.exp(-2 * np.pi * g * p["damping"] * x)
            turn = 2 * np.pi * g * np.sqrt(1 - p["damping"] ** 2) * x
            parts = np.column_stack([decay * np.cos(turn), decay * np.sin(turn), x**0, x])
            left = np.linalg.lstsq(parts, d[2000 : 2000 + count], rcond=None)[1]
            fits[g] = float(left[0])
        assert min(fits, key=lambda g: fits[g]) == pytest.approx(f, rel=0.015)


def test_drift_2():
    w = world("drift")
    p = parameters(w)
    for t, d in zip(clock(w), difference(w), strict=True):
        for since, found in zip((t - p["onset"])[::97], d[::97], strict=True):
            expected = 0.0
            if since > 0:  # the tail of a Gaussian
                z = (p["tau"] / since) ** 0.5
                expected = 2 / np.sqrt(np.pi) * integrate.quad(lambda s: np.exp(-s * s), z, 40.0)[0]
            assert found == pytest.approx(p["sign"] * p["size"] * expected, abs=1e-7)


def test_gain_drift_2():
    w = world("gain_drift")
    p = parameters(w)
    for t, d, nu in zip(clock(w), difference(w), w.without, strict=True):
        k = p["amplitude"] * np.cos(2 * np.pi * t / p["cycle_s"] + p["phase"] - np.pi / 2)
        centre = np.median(nu - d / k)
        np.testing.assert_allclose(d, k * (nu - centre), atol=1e-9)
        assert np.min(nu) + 0.3 * np.ptp(nu) < centre < np.min(nu) + 0.7 * np.ptp(nu)


def test_mode_hop_2():
    w = world("mode_hop")
    p = parameters(w)
    assert p["second"] > p["up"]
    seen = set()
    for run, d in zip(w.runs, difference(w), strict=True):
        fine = replace(run.scan, samples=run.scan.samples * w.signal_path.oversample)
        on, counts = [False, False], []
        for nu in w.simulate_without_effects([fine])[0]:
            for k, up in enumerate((p["up"], p["second"])):
                on[k] = True if nu > up else False if nu < up - p["width"] else on[k]
            counts.append(sum(on))
        expected = p["sign"] * p["jump"] * np.array(counts, float)[:: w.signal_path.oversample]
        first = run.scan.samples
        np.testing.assert_allclose(d[first:], expected[first:], atol=1e-9)
        seen |= set(counts)
    assert seen == {0, 1, 2}


def test_etalon_2():
    w = world("etalon")
    p = parameters(w)
    nu, d = np.concatenate(w.without), np.concatenate(difference(w))
    turns = [2 * np.pi * nu / p["spacing"] * r for r in (1.0, p["ratio"])]
    waves = np.column_stack([wave(turn) for turn in turns for wave in (np.cos, np.sin)])
    c, *_ = np.linalg.lstsq(waves, d, rcond=None)
    np.testing.assert_allclose(d, waves @ c, atol=1e-9)
    assert np.hypot(c[0], c[1]) == pytest.approx(p["amplitude"])
    assert np.hypot(c[2], c[3]) == pytest.approx(p["amplitude"] * p["share"])


def test_pickup_2():
    w = world("pickup")
    p = parameters(w)
    cycle = 1 / p["frequency"]
    for t, d in zip(clock(w), difference(w), strict=True):
        expected = sum(
            (-1) ** k * np.exp(-((t - p["begin"] - k * cycle / 2) ** 2) / (2 * p["width"] ** 2))
            for k in range(int(2 * t[0] / cycle) - 4, int(2 * t[-1] / cycle) + 5)
        )
        np.testing.assert_allclose(d, p["height"] * expected, atol=1e-4 * p["height"])


def test_current_coupling_2():
    w = world("current_coupling")
    p = parameters(w)
    low, high = ends(w)
    charge = lambda u: p["k"] * ((1 - p["bend"]) * u + p["bend"] * (u - low) ** 2 / (high - low))  # noqa: E731
    sine = replace(TRIANGLE, waveform="sine", samples=500)
    d = w.simulate([sine])[0] - w.simulate_without_effects([sine])[0]
    step = 1e-6
    flow = charge(sine.voltage(sine.time_s + step)) - charge(sine.voltage(sine.time_s - step))
    expected = p["sign"] * flow / (2 * step)
    np.testing.assert_allclose(d[1:-1], expected[1:-1], atol=2e-3 * np.max(np.abs(expected)))


def test_unlisted_a():
    w = world("echo", "unlisted")
    p = parameters(w)
    scan = replace(TRIANGLE, phase=0.1)
    late = replace(scan, phase=0.1 - p["late_s"] * scan.rate_hz)
    nu, other = w.simulate_without_effects([scan])[0], w.simulate_without_effects([late])[0]
    expected = (1 - p["part"]) * nu + p["part"] * other
    np.testing.assert_allclose(w.simulate([scan])[0], expected, atol=2e-2 * p["part"])


def test_unlisted_b():
    w = world("knocks", "unlisted")
    p = parameters(w)
    # Between events it obeys a damped oscillator's equation, so few samples break its recursion.
    for t, d in zip(clock(w), difference(w), strict=True):
        step = t[1] - t[0]
        kept = np.exp(-step / p["decay"])
        turn = np.cos(2 * np.pi * p["frequency"] * step)
        left = d[2:] - 2 * kept * turn * d[1:-1] + kept**2 * d[:-2]
        broken = np.abs(left) > 1e-9 * p["size"]
        assert np.sum(broken) <= 2 * (3 + (t[-1] - t[0]) / 0.05)
    assert max(np.max(np.abs(d)) for d in difference(w)) < 4 * p["size"]


def test_unlisted_c():
    w = world("lost_counts", "unlisted")
    p = parameters(w)
    limit = (1 - p["cut"]) * p["fastest"]
    touched = []
    for run, d in zip(w.runs, difference(w), strict=True):
        fine = replace(run.scan, samples=run.scan.samples * w.signal_path.oversample)
        bare = w.simulate_without_effects([fine])[0]
        missed = np.diff(bare) - np.clip(np.diff(bare), -limit * fine.step_s, limit * fine.step_s)
        lost = np.concatenate(([0.0], np.cumsum(missed)))[:: w.signal_path.oversample]
        np.testing.assert_allclose(d, -lost, atol=1e-6 + 1e-3 * np.max(np.abs(lost)))
        assert d[0] == 0
        touched.append(bool(np.max(np.abs(d)) > 1e-9))
    assert any(touched) and not all(touched)


def test_unlisted_d():
    w = world("stale", "unlisted")
    p = parameters(w)
    late = []
    for run, nu, d in zip(w.runs, w.noise_free, difference(w), strict=True):
        wrong = np.abs(d) > 1e-9
        late.append(float(np.mean(wrong)))
        # A stale reading is a reading of at most its duration before.
        fine = replace(run.scan, samples=run.scan.samples * 8)
        bare = w.simulate_without_effects([fine])[0]
        reach = int(np.ceil(p["duration"] / fine.step_s)) + 1
        for k in np.flatnonzero(wrong)[::7]:
            past = bare[max(8 * k - reach, 0) : 8 * k + 1]
            if 8 * k >= reach:
                assert past.min() - 1e-2 <= nu[k] <= past.max() + 1e-2
    share = 1 - np.exp(-p["duration"] / p["mean_s"])  # of the time is within one of an event
    assert np.mean(late) == pytest.approx(share, rel=0.6)


def test_unlisted_e():
    w = world("subharmonic", "unlisted")
    p = parameters(w)
    for run, d in zip(w.runs, difference(w), strict=True):
        n = run.scan.samples
        np.testing.assert_allclose(d[n:], -d[:-n], atol=1e-9)  # the other sign a period later
        np.testing.assert_allclose(d[2 * n :], d[: -2 * n], atol=1e-9)
        turn: np.ndarray = np.arange(n) / n * np.pi
        waves = np.column_stack([np.cos(turn), np.sin(turn)])
        (c, s), *_ = np.linalg.lstsq(waves, d[:n], rcond=None)
        assert np.hypot(c, s) == pytest.approx(p["size"] * run.scan.swing / p["reference"])
        np.testing.assert_allclose(d[:n], waves @ (c, s), atol=1e-9)
