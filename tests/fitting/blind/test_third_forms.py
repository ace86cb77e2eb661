"""Each form of the third set against its law computed another way; named by the listed effect."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate
from unseen_devices import (
    TRIANGLE,
    acts,
    change,
    clock,
    difference,
    driven,
    on_waves,
    parameters,
    world,
)

from fitting.blind.simulator._scan import place_in_time
from fitting.blind.simulator._signal_path import SignalPath
from fitting.blind.simulator.effects.third._third_forms_drive import electrode_mean

SINE = replace(TRIANGLE, waveform="sine", samples=500)


@pytest.mark.parametrize("tau", [1e-3, 2e-2])
def test_lowpass_3(tau):
    t: np.ndarray = np.arange(60_000) * 5e-6
    for f in (20.0, 150.0):
        root = np.sqrt(2j * np.pi * f * tau)
        expected = (np.tanh(root) / root * np.exp(2j * np.pi * f * t)).imag
        found = electrode_mean(np.sin(2 * np.pi * f * t), 5e-6, tau)
        np.testing.assert_allclose(found[-20_000:], expected[-20_000:], atol=2e-3)
    w = world("amplifier_lowpass")
    lag = (TRIANGLE.drive - driven(w, TRIANGLE))[100:180]
    # On a ramp the mean is late by a third of the whole electrode's R C.
    np.testing.assert_allclose(lag, 2 * 40.0 * 4.2 * parameters(w)["tau"] / 3, rtol=1e-3)


def test_delay_3():
    w = world("delay")
    p = parameters(w)
    scan = replace(TRIANGLE, periods=200)
    found = driven(w, scan).reshape(200, 400)
    late = (scan.drive.reshape(200, 400) - found)[:, 50:150] / (2 * 40.0 * 4.2)
    assert np.max(np.ptp(late, axis=1)) < 1e-9  # one latency a period
    assert np.min(late) >= (1 - p["share"]) * p["tau"] - 1e-9
    assert np.mean(late[:, 0]) == pytest.approx(p["tau"], rel=0.2)
    assert np.std(late[:, 0]) == pytest.approx(p["share"] * p["tau"], rel=0.3)
    falling = (found - scan.drive.reshape(200, 400))[:, 250:350] / (2 * 40.0 * 4.2)
    np.testing.assert_allclose(falling, late, atol=1e-9)


def test_delay_3_begins_with_its_trigger():
    w = world("delay")
    (moment,) = w.signal_path.path([replace(TRIANGLE, periods=30)])
    rising = np.diff(moment.drive) > 0
    t = moment.t[1:] - moment.scan.start_s
    after = np.mod(t, 1 / 40.0)
    assert (moment.drive >= moment.scan.bias - 2.1 - 1e-9).all()
    earliest = (1 - parameters(w)["share"]) * parameters(w)["tau"]
    assert not rising[(after < earliest - moment.step) & (after > 2 * moment.step)].any()


def test_slew_limit_3():
    w = world("slew_limit")
    p = parameters(w)
    least = (1 - p["cut"]) * p["steepest"]
    steep = replace(TRIANGLE, rate_hz=1.1 * p["ratio"] * least / (2 * 4.2), waveform="triangle")
    (moment,) = w.signal_path.path([steep])
    slope = np.diff(moment.drive) / moment.step
    up, down = (1.0, p["ratio"]) if p["lower"] == "rising" else (p["ratio"], 1.0)
    assert np.max(slope) == pytest.approx(up * least, rel=1e-6)
    assert np.min(slope) == pytest.approx(-down * least, rel=1e-6)
    apart = np.abs(moment.command - moment.drive)[1:] > 1e-9
    assert np.mean(apart) > 0.3
    limits = np.where(slope[apart] > 0, up, -down) * least
    np.testing.assert_allclose(slope[apart], limits, rtol=1e-6)


def test_saturation_3():
    w = world("saturation")
    p = parameters(w)
    scans = [run.scan for run in w.runs]
    low, high = min(s.drive.min() for s in scans), max(s.drive.max() for s in scans)
    cut = p["part"] * (max(s.bias + s.swing / 2 for s in scans) - low)
    rail, tau = high - cut, p["share"] * cut / p["steepest"]
    wide = replace(TRIANGLE, rate_hz=20.0, swing=high - low, bias=(high + low) / 2, samples=4000)
    y, t, slope = driven(w, wide)[:4000], wide.time_s[:4000], 2 * 20.0 * (high - low)
    # It follows the ramp as long as the resistance lets it, then charges exponentially.
    leaves = (rail - slope * tau - low) / slope
    charging = rail - slope * tau * np.exp(-np.maximum(t - leaves, 0) / tau)
    falling = high - slope * (t - 0.025)
    expected = np.where(t < leaves, low + slope * t, np.minimum(charging, falling))
    np.testing.assert_allclose(y, expected, atol=0.02 * cut)
    assert (expected < wide.drive[:4000] - 0.5 * cut).any()


def test_quantisation_3():
    w = world("quantisation")
    p = parameters(w)
    scan = replace(TRIANGLE, rate_hz=5.0, periods=1, samples=20_000)
    found, code = driven(w, scan) / p["step"], np.round(scan.drive / p["step"]).astype(int)
    codes, first = np.unique(code, return_index=True)
    assert np.max(np.abs(found - found[first][np.searchsorted(codes, code)])) < 1e-9
    bits = np.array([[int(b) for b in f"{c:014b}"] for c in codes])
    errors = (found - code)[first]
    each, *_ = np.linalg.lstsq(bits, errors, rcond=None)
    np.testing.assert_allclose(errors, bits @ each, atol=1e-9)  # of each bit by itself
    used = np.ptp(bits, axis=0) > 0
    relative = (each / np.sqrt(2.0 ** np.arange(13, -1, -1)))[used]
    assert len(relative) > 5 and np.max(np.abs(relative)) < 4 * p["spread"]
    assert np.std(relative) == pytest.approx(p["spread"], rel=0.8)


def test_rate_law_3():
    w = world("rate_law")
    p = parameters(w)
    law = w.signal_path.effects[0].law
    assert law is not None
    bare, changed = w.signal_path.piezo, law(w.signal_path.piezo)
    area = [
        integrate.quad(lambda q: 1 / (p["attempt"] + q), 0, f)[0]
        for f in (p["reference"], 0.5, 5.0, 80.0)
    ]
    for f, log in zip((p["reference"], 0.5, 5.0, 80.0), area, strict=True):
        more = changed.thresholds(f, 4.0) - bare.thresholds(f, 4.0)
        np.testing.assert_allclose(more, bare.zeta * p["ratio"] * p["reference"] * log / area[0])


def test_amplitude_law_3():
    w = world("amplitude_law")
    p = parameters(w)
    middle = (p["threshold"] + p["reference"]) / 2
    for swing, part in (
        (p["reference"], 0.0), (middle, 0.5), (p["threshold"], 1.0), (0.7 * p["threshold"], 1.0),
    ):  # fmt: skip
        scan = replace(TRIANGLE, swing=swing)
        far = w.simulate_without_effects([scan])[0] - w.signal_path.rest
        np.testing.assert_allclose(change(w, scan), -part * p["part"] * far, atol=1e-9)


def test_creep_3():
    w = world("creep")
    p = parameters(w)
    for step in (1e-4, 1e-2, 1.0):
        t = np.arange(1, 2001) * step
        x = np.full(2000, w.signal_path.rest + 1.0)
        found = acts(w, "displacement", x, t) - x
        expected = p["gain"] * (t ** p["exponent"] - t[20] ** p["exponent"])
        np.testing.assert_allclose((found - found[20])[20:], expected[20:], rtol=0.02, atol=1e-6)


def test_creep_3_goes_on_between_runs():
    w = world("creep")
    bare = SignalPath(w.signal_path.piezo, (), w.signal_path.oversample, w.signal_path.rest)
    moments = bare.path([run.scan for run in w.runs])
    law, state = w.signal_path.effects[0].displacement, {}
    assert law is not None
    last = [law(m.operator_response, replace(m, state=state)) for m in moments][-1]
    alone = law(moments[-1].operator_response, replace(moments[-1], state={}))
    assert np.max(np.abs(last - alone)) > 1e-6
    np.testing.assert_allclose(
        last[:: w.signal_path.oversample][-w.noise_free[-1].size :], w.noise_free[-1], atol=1e-9
    )


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_resonance_3(seed):
    w = world("resonance", seed=seed)
    p = parameters(w)
    f0, z = 1 / p["period"], p["damping"]
    assert 0.15 <= abs(p["share"]) <= 0.4
    for ratio in (0.3, 1.0, p["ratio"], 5.0):
        f = ratio * f0
        t = np.arange(40_000) / (f0 * 200)
        modes = [1 / (1 - (f / g) ** 2 + 2j * z * f / g) for g in (f0, p["ratio"] * f0)]
        gain = (1 - p["share"]) * modes[0] + p["share"] * modes[1]
        found = acts(w, "displacement", np.sin(2 * np.pi * f * t), t)
        expected = (gain * np.exp(2j * np.pi * f * t)).imag
        np.testing.assert_allclose(found[-500:], expected[-500:], atol=0.02 * max(abs(gain), 0.1))


def test_drift_3():
    w = world("drift")
    p = parameters(w)
    t = np.linspace(0, 6 * p["cycle_s"], 600_001)
    y = acts(w, "light", np.zeros_like(t), t)
    assert np.ptp(y) == pytest.approx(p["size"], rel=1e-4)
    np.testing.assert_allclose(y[100_000:], y[:-100_000], atol=1e-6 * p["size"])
    # A first-order lag of what is on or off.
    source = p["tau"] * np.gradient(y, t) + y
    on = source > (source.max() + source.min()) / 2
    assert np.mean(on) == pytest.approx(p["on_s"] / p["cycle_s"], abs=0.01)
    for side in (source[on], source[~on]):
        assert np.ptp(np.quantile(side, [0.01, 0.99])) < 1e-4 * np.ptp(source)
    for moments, d in zip(clock(w), difference(w), strict=True):
        np.testing.assert_allclose(d, np.interp(moments, t, y), atol=1e-4 * p["size"])


def test_gain_drift_3():
    w = world("gain_drift")
    p = parameters(w)
    moments = w.signal_path.path([run.scan for run in w.runs])
    warm, step, now = 0.0, 1e-3, moments[0].t[0]
    for moment, t, d, nu in zip(moments, clock(w), difference(w), w.without, strict=True):
        scan, known = moment.scan, []
        times = np.arange(now, moment.t[-1] + step, step)
        for x in times:  # Euler
            known.append(warm)
            loss = scan.rate_hz * scan.swing**2 / p["hardest"] if x >= moment.t[0] else 0.0
            warm += step * (loss - warm) / p["tau"]
        now = times[-1] + step
        warmth = np.interp(t, times, known) / (1 - np.exp(-1 / p["tau"]))
        k = p["sign"] * p["gain"] * warmth
        centre = np.median(nu - d / k)
        np.testing.assert_allclose(d, k * (nu - centre), atol=0.02 * np.max(np.abs(d)))
        assert np.min(nu) + 0.3 * np.ptp(nu) < centre < np.min(nu) + 0.7 * np.ptp(nu)


def test_mode_hop_3():
    w = world("mode_hop")
    p = parameters(w)
    scan = replace(TRIANGLE, rate_hz=10.0, periods=400, start_s=0.0)
    t: np.ndarray = np.arange(400 * 1000) / 10_000
    nu = p["up"] + 4 * (1 - np.abs(4 * np.mod(10 * t, 1) - 2))
    d = acts(w, "light", nu, t, scan) - nu
    assert set(np.round(np.unique(d), 9)) == {0.0, round(p["sign"] * p["jump"], 9)}
    on = d.reshape(400, 1000) != 0
    up, down = on[:, :500], on[:, 500:]
    assert (np.diff(up.astype(int), axis=1).sum(axis=1) == 1).all()
    ups = nu[:1000][np.argmax(up, axis=1)]
    downs = nu[:1000][500 + np.argmin(down, axis=1)]
    assert np.mean(ups) == pytest.approx(p["up"], abs=4 * p["spread"] / 20 + 0.02)
    assert np.std(ups) == pytest.approx(p["spread"], rel=0.15)
    np.testing.assert_allclose(ups - downs, p["up"] - p["down"], atol=0.035)
    assert abs(np.corrcoef(ups[1:], ups[:-1])[0, 1]) < 0.2


def test_etalon_3():
    w = world("etalon")
    p = parameters(w)
    phases = []
    for begin in (0.0, p["warming_s"] * np.log(2), 60 * p["warming_s"]):
        (scan,) = place_in_time([replace(TRIANGLE, rate_hz=80.0, periods=1)], begin)
        nu = w.simulate_without_effects([scan])[0]
        waves = 2 * np.pi * nu / p["spacing"]
        c, *_ = np.linalg.lstsq(
            np.column_stack([np.sin(waves), np.cos(waves)]), change(w, scan), rcond=None
        )
        assert np.hypot(*c) == pytest.approx(p["amplitude"], rel=1e-3)
        phases.append(np.arctan2(c[1], c[0]))
    assert 1.0 <= abs(p["turn"]) <= 4.0
    wanted = p["phase"] + p["turn"] * np.array([0.0, 0.5, 1.0])
    off = np.angle(np.exp(1j * (np.array(phases) - wanted)))
    np.testing.assert_allclose(off, 0.0, atol=0.01)


def test_pickup_3():
    w = world("pickup")
    p = parameters(w)
    turns = [2 * np.pi * f * np.concatenate(clock(w)) for f in
             (p["frequency"], p["frequency_second"])]  # fmt: skip
    found = on_waves(np.concatenate(difference(w)), *turns)
    np.testing.assert_allclose(found, [p["amplitude"], p["amplitude"] * p["share"]], rtol=1e-6)
    assert 0.93 <= p["frequency_second"] / p["frequency"] < 0.996
    speed = min((25.0, 30.0, 50.0, 60.0), key=lambda f: abs(f * 0.98 - p["frequency"]))
    assert 0.97 <= p["frequency"] / speed <= 0.99


def test_current_coupling_3():
    w = world("current_coupling")
    p = parameters(w)
    slope = np.pi * 40.0 * 4.2 * np.sin(2 * np.pi * 40.0 * SINE.time_s)
    expected = p["sign"] * p["k"] * np.where(slope > 0, slope, 0.0)
    np.testing.assert_allclose(
        change(w, SINE)[1:-1], expected[1:-1], atol=2e-3 * np.max(np.abs(expected))
    )
