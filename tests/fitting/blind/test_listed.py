"""Every listed effect of a world against its equation, on answers with and without it."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from fitting.blind.simulator._scan import Scan, place_in_time
from fitting.blind.simulator._signal_path import RunState, SignalPath
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device
from fitting.blind.simulator.effects._kinds import LISTED
from fitting.blind.simulator.effects._listed_optical import creep_response

TRIANGLE = Scan(40.0, 4.2, 3.0, "triangle", 3, 400)


@functools.cache
def world(name: str, seed: int = 5) -> SimulatedDevice:
    return draw_device(seed, "listed", name, 6.0)


def parameters(w: SimulatedDevice) -> dict:
    return w.parameters[w.truth[0]]


def difference(w: SimulatedDevice) -> list[np.ndarray]:
    return [a - b for a, b in zip(w.noise_free, w.without, strict=True)]


def clock(w: SimulatedDevice) -> list[np.ndarray]:
    return [run.start_s + run.time_s for run in w.runs]


def straight(n: int = 400, periods: int = 3) -> np.ndarray:
    """Samples of a triangle from its minimum that lie more than 5 % of a period from corners."""
    place = np.tile(np.arange(n) / n, periods)
    return np.minimum(np.abs(place - 0.5), 0.5 - np.abs(place - 0.5)) > 0.05


def driven(w: SimulatedDevice, scan: Scan) -> np.ndarray:
    """What the drive of one scan becomes."""
    (moment,) = w.signal_path.path([scan])
    count = scan.periods * scan.samples
    return moment.drive[:: w.signal_path.oversample][-count:]


@pytest.mark.parametrize("name", sorted(LISTED))
def test_a_world_holds_the_effect_asked_for_and_shows_it(name):
    w = world(name)
    assert w.truth == (name,)
    assert all(np.isfinite(nu).all() for nu in w.noise_free)
    assert max(np.max(np.abs(d)) for d in difference(w)) > w.size * w.noise.rms


def test_delay_is_the_scan_shifted():
    w = world("delay")
    tau = parameters(w)["tau"]
    sine = replace(TRIANGLE, waveform="sine", phase=0.2)
    late = replace(sine, phase=0.2 - tau * 40.0)
    np.testing.assert_allclose(
        w.simulate([sine])[0], w.simulate_without_effects([late])[0], atol=2e-4
    )


def test_lowpass_lags_a_ramp_by_its_slope_times_tau():
    w = world("amplifier_lowpass")
    slope = np.where(np.arange(1200) % 400 < 200, 1, -1) * 2 * 40.0 * 4.2
    lagging = TRIANGLE.drive - driven(w, TRIANGLE)
    assert 1e-6 < parameters(w)["tau"] < 2e-4
    np.testing.assert_allclose(
        lagging[straight()], (slope * parameters(w)["tau"])[straight()], rtol=2e-3
    )


def test_slew_limit_bites_on_the_steepest_run_only():
    w = world("slew_limit")
    limit = (1 - parameters(w)["cut"]) * parameters(w)["steepest"]
    for scan, d in zip((run.scan for run in w.runs), difference(w), strict=True):
        steepest = 2 * scan.swing * scan.rate_hz * (1 if scan.waveform == "triangle" else np.pi / 2)
        assert (np.max(np.abs(d)) > 1e-9) == (steepest > limit * (1 + 1e-6))


def test_saturation_cuts_one_end():
    w = world("saturation")
    cut = parameters(w)["part"] * (
        max(r.scan.bias + r.scan.swing / 2 for r in w.runs)
        - min(r.scan.bias - r.scan.swing / 2 for r in w.runs)
    )
    wide = max((r.scan for r in w.runs), key=lambda s: s.swing)
    lost = wide.drive - driven(w, wide)
    assert np.max(np.abs(lost)) == pytest.approx(cut, abs=wide.swing / 90)
    clipped = np.abs(lost) > 1e-9
    end = np.max if parameters(w)["end"] == "high" else np.min
    assert clipped[np.flatnonzero(wide.drive == end(wide.drive))].all()
    assert np.ptp(driven(w, wide)[clipped]) < 1e-12


def test_quantisation_rounds_to_its_step():
    w = world("quantisation")
    step, offset = parameters(w)["step"], parameters(w)["offset"]
    found = driven(w, TRIANGLE)
    steps = found / step - offset
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert np.max(np.abs(found - TRIANGLE.drive)) <= step / 2 * (1 + 1e-9)


def test_rate_law_is_a_power_of_the_rate():
    w = world("rate_law")
    p = parameters(w)
    law = w.signal_path.effects[0].law
    assert law is not None
    piezo = law(w.signal_path.piezo)
    zeta = (piezo.thresholds(2 * p["reference"], 0.0)) / (piezo.thresholds(p["reference"], 0.0))
    np.testing.assert_allclose(np.log2(zeta), 1 + p["sign"] * p["far"])
    np.testing.assert_allclose(piezo.thresholds(p["reference"], 0.0), p["reference"] * piezo.zeta)


def test_amplitude_law_is_a_power_of_the_swing():
    for seed in range(4):
        w = world("amplitude_law", seed)
        p = parameters(w)
        half = replace(TRIANGLE, swing=p["reference"] / 2)
        factor = 2.0 ** (-p["sign"] * p["exponent"])
        if p["on"] == "gain":
            found, bare = w.simulate([half])[0], w.simulate_without_effects([half])[0]
            np.testing.assert_allclose(
                found - w.signal_path.rest, factor * (bare - w.signal_path.rest)
            )
        else:
            law = w.signal_path.effects[0].law
            assert law is not None
            r = law(w.signal_path.piezo).thresholds(0.0, half.swing)
            np.testing.assert_allclose(r, factor * w.signal_path.piezo.share * half.swing / 2)


def test_creep_answers_a_step_by_the_logarithm_and_forgets_between_runs():
    step = 1e-3
    taus = np.geomspace(5e-3, 20.0, 12)
    weights = np.full(12, np.log10(taus[1] / taus[0]))
    t: np.ndarray = np.arange(1, 20001) * step
    x = np.ones(20000)
    at_rest = RunState(TRIANGLE, 0, t, step, x, x, x, x, 0.0, None, 0.0, {})
    y = creep_response(x, at_rest, taus, weights)
    decades = np.interp([0.02, 0.2, 2.0], t, y)
    np.testing.assert_allclose(np.diff(decades), 1.0, atol=0.03)
    # Four seconds later, at rest, the lags hold what the law says of a step back.
    later = RunState(TRIANGLE, 1, t + 24.0, step, x, x, x, x, 0.0, None, 0.0, at_rest.state)
    held = creep_response(np.zeros(20000), later, taus, weights)
    expected = np.sum(weights * -np.expm1(-20.0 / taus) * np.exp(-(4.0 + step) / taus))
    assert held[0] == pytest.approx(expected, rel=1e-3)


def test_creep_of_a_world_is_linear_in_its_gain_about_rest():
    w = world("creep")
    g = parameters(w)["gain"]
    whole = SignalPath(w.signal_path.piezo, (), w.signal_path.oversample, w.signal_path.rest)
    moments = whole.path([run.scan for run in w.runs])
    taus = np.geomspace(5e-3, 20.0, 12)
    weights = np.full(12, np.log10(taus[1] / taus[0]))
    state: dict = {}
    for moment, d in zip(moments, difference(w), strict=True):
        y = creep_response(
            moment.operator_response - w.signal_path.rest,
            replace(moment, state=state),
            taus,
            weights,
        )
        np.testing.assert_allclose(d, g * y[:: w.signal_path.oversample][-len(d) :], atol=1e-9)


def test_drift_is_an_exponential_of_the_session():
    w = world("drift")
    p = parameters(w)
    for t, d in zip(clock(w), difference(w), strict=True):
        np.testing.assert_allclose(
            d, p["sign"] * p["size"] * (1 - np.exp(-t / p["tau"])), atol=1e-9
        )


def test_gain_drift_grows_in_proportion_to_the_sessions_time():
    w = world("gain_drift")
    p = parameters(w)
    for t, d, nu in zip(clock(w), difference(w), w.without, strict=True):
        k = p["sign"] * p["total"] * t / p["session"]
        centre = np.median(nu - d / k)
        np.testing.assert_allclose(d, k * (nu - centre), atol=1e-9)
        assert np.min(nu) + 0.3 * np.ptp(nu) < centre < np.min(nu) + 0.7 * np.ptp(nu)


def test_mode_hop_is_a_switch_with_two_thresholds():
    w = world("mode_hop")
    p = parameters(w)
    hopped_at_all = 0
    for run, d in zip(w.runs, difference(w), strict=True):
        fine = replace(run.scan, samples=run.scan.samples * w.signal_path.oversample)
        on, states = False, []
        for nu in w.simulate_without_effects([fine])[0]:
            on = True if nu > p["up"] else False if nu < p["down"] else on
            states.append(on)
        first = run.scan.samples  # the loop knows nothing before the first sample
        expected = p["sign"] * p["jump"] * np.array(states, float)[:: w.signal_path.oversample]
        np.testing.assert_allclose(d[first:], expected[first:], atol=1e-9)
        hopped_at_all += int(np.any(states))
    assert hopped_at_all


def test_etalon_is_a_sine_of_the_frequency():
    w = world("etalon")
    p = parameters(w)
    nu, d = np.concatenate(w.without), np.concatenate(difference(w))
    turn = 2 * np.pi * nu / p["spacing"]
    (c, s), *_ = np.linalg.lstsq(np.column_stack([np.cos(turn), np.sin(turn)]), d, rcond=None)
    assert np.hypot(c, s) == pytest.approx(p["amplitude"])
    assert np.exp(1j * p["phase"]) == pytest.approx((s + 1j * c) / np.hypot(c, s))
    np.testing.assert_allclose(d, c * np.cos(turn) + s * np.sin(turn), atol=1e-9)


def test_pickup_is_a_sine_of_the_sessions_time():
    w = world("pickup")
    p = parameters(w)
    for t, d in zip(clock(w), difference(w), strict=True):
        expected = p["amplitude"] * np.sin(2 * np.pi * p["frequency"] * t + p["phase"])
        np.testing.assert_allclose(d, expected, atol=1e-8)


def test_current_coupling_adds_the_drives_slope():
    w = world("current_coupling")
    p = parameters(w)
    d = w.simulate([TRIANGLE])[0] - w.simulate_without_effects([TRIANGLE])[0]
    slope = np.where(np.arange(1200) % 400 < 200, 1, -1) * 2 * 40.0 * 4.2
    np.testing.assert_allclose(d[straight()], p["sign"] * p["k"] * slope[straight()], rtol=1e-6)


def test_resonance_answers_a_slow_sine_by_its_transfer_function():
    w = world("resonance")
    p = parameters(w)
    slow = place_in_time([Scan(5.0, 1e-3, 3.0, "sine", 3, 200)], 5.0)
    d, nu = (
        w.simulate(slow)[0] - w.simulate_without_effects(slow)[0],
        w.simulate_without_effects(slow)[0],
    )
    # 1/(1 + a s) to first order: the lag is 2 z/w0.
    lag = p["damping"] * p["period"] / np.pi
    expected = -lag * np.gradient(nu, slow[0].step_s)
    assert np.max(np.abs((d - expected)[2:-2])) < 0.1 * np.max(np.abs(expected))
