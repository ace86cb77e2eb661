"""Effects behind the operator: against loops, closed forms and SciPy; their first guesses."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal

from rapi_jax import Drive, NotInvertible, Recording, predict
from rapi_jax._ecdl import ECDL, respond
from rapi_jax._waveform import step_and_hold, triangle
from rapi_jax.effects import (
    Creep,
    CurrentCoupling,
    Drift,
    Etalon,
    GainDrift,
    ModeHop,
    Pickup,
    ResidualSummary,
    Resonance,
)
from rapi_jax.examples import paper_device
from rapi_jax.operators import RAPI
from rapi_jax.sampling._batch import to_batch

_respond = eqx.filter_jit(respond)


def straight(*effects):
    """A device without hysteresis, 25 GHz/V, so that what an effect does is known exactly."""
    plain = RAPI(
        alpha=0.1, zeta=1e-3, lam=1.0, eta=1.0, a=1e-30, b=0.0, d=(25.0,), d_0=0.0, plays=1
    )
    return ECDL(plain, tuple(effects))


def on(effect, t, nu):
    return np.asarray(effect(jnp.asarray(t), jnp.asarray(nu)))


# --- creep


def test_a_step_creeps_as_a_logarithm():
    """Sum over eight lags by hand; the law it stands for to the figures of its description."""
    g = 0.02
    t = np.concatenate([[0.0, 1e-9], np.geomspace(1e-4, 2e3, 2000)])
    y = on(Creep.at(gain=g), t, np.where(t > 0, 1.0, 0.0))
    tau = 5e-3 * 4000 ** (np.arange(8) / 7)
    per_decade = 7 / np.log10(4000)
    want = 1 - g / per_decade * np.exp(-t[1:, None] / tau[None, :]).sum(axis=1)
    np.testing.assert_allclose(y[1:], want, rtol=0, atol=1e-8)  # the step lasts 1 ns of 5 ms
    assert y[1] == pytest.approx(1 - 4.117 * g, abs=1e-4) and y[-1] == pytest.approx(1, abs=1e-9)
    law = (t > 1e-2) & (t < 2.0)
    slope = np.gradient(y[law], np.log10(t[law]))
    assert np.abs(slope / g - 1).max() < 0.06
    # Ripple of two lags a decade, 2 sqrt(x / sinh x) with x = 2 pi^2 / ln(4000^(1/7)), and the end
    # of the lags, t / 20 s.
    middle = (t > 2e-2) & (t < 0.2)
    off = np.abs(np.gradient(y[middle], np.log10(t[middle])) / g - 1)
    assert (off <= 3e-3 + t[middle] / 20.0).all()
    assert np.abs(y[middle] - 1 - g * np.log10(t[middle] / 20.3)).max() < 1e-2 * g


def test_creep_is_the_usual_form_with_another_gain():
    """nu + g' sum w_k L_k[nu - nu_rest], of an operator that is smaller about the rest."""
    g = 0.03
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 3, 400))
    x = 40.0 + rng.normal(size=400).cumsum()
    per_decade, tau = 7 / np.log10(4000), 5e-3 * 4000 ** (np.arange(8) / 7)
    fast = 1 - g * 8 / per_decade
    lags = np.zeros(8)
    usual = [x[0]]
    for h, a, b in zip(np.diff(t), x[:-1] - x[0], x[1:] - x[0], strict=True):
        slope = (b - a) / h  # the solution of tau L' = a + slope s - L over h
        lags = b - slope * tau + (lags - a + slope * tau) * np.exp(-h / tau)
        usual.append(x[0] + fast * (b + g / fast * lags.sum() / per_decade))
    np.testing.assert_allclose(on(Creep.at(gain=g), t, x), usual, rtol=0, atol=1e-10)


@pytest.mark.parametrize("begin", [0.0, 0.25, 0.5])  # of a period after the minimum
@pytest.mark.parametrize("rate", [1.5, 12.0])  # Hz
def test_a_creep_with_rests_is_among_its_guesses_wherever_runs_begin(begin, rate):
    """It rests in the middle, and each run has been on for two periods, or a tenth of a second."""
    samples, starts, device = 200, (0.0, 4.0, 11.0), straight()
    time = np.arange(3 * samples) / (samples * rate)
    value = 3.0 - 2.0 * scipy.signal.sawtooth(2.0 * np.pi * (time * rate + begin + 0.5), 0.5)
    drives = [Drive(time, value, rate, "triangle", start) for start in starts]
    clean = [np.asarray(predict(device, drive)) for drive in drives]
    data = to_batch(Recording.of(drives, clean), lead=True)
    rows, use = data.device(), data.use

    def signature(creep):
        """What it adds, beside a gain and a constant."""
        added = np.asarray(_respond(straight(creep), rows) - _respond(device, rows))[use]
        known = np.stack([np.ones(use.sum()), data.u[use]], axis=1)
        return added - known @ np.linalg.lstsq(known, added, rcond=None)[0]

    rest = (3.0 - value[0]) / np.ptp(value)
    lead = max(2.0, np.ceil(0.1 * rate)) / rate
    wanted = signature(Creep.at(gain=0.04, history=0.0, rest=rest, lead_s=lead))
    none = np.zeros(use.sum())
    summary = ResidualSummary(
        data.time[use], data.u[use], data.y[use], none, np.nonzero(use)[0],
        (rate,) * 3, (4.0,) * 3, float(time[1]), 0.02, float(np.ptp(clean)),
    )  # fmt: skip
    alike = [
        float(wanted @ one) / float(np.linalg.norm(wanted) * np.linalg.norm(one))
        for one in (signature(guess) for guess in Creep.initial_guesses(summary))
        if np.linalg.norm(one) > 0
    ]
    assert max(alike) > 0.95


def test_creep_remembers_the_run_before():
    """A hold after scans, and the same without them; `history` says what came before the first."""
    scans = triangle(10.0, amplitude=3.0, bias=3.0, samples=2000, periods=4)[0]
    hold = step_and_hold((1.5, 1.5), hold_s=1.0, rise_s=0.01, step_s=5e-4)[0]
    hold = dataclasses.replace(hold, start_s=0.4)
    rows = to_batch(Recording.of([scans, hold], [scans.value, hold.value]), lead=True).device()
    answers = {}
    for history in (0.0, 1.0):
        full = _respond(straight(Creep.at(gain=0.03, history=history)), rows)
        answers[history] = np.asarray(full)[1]
    creep, rest = answers[0.0], 25 * 1.5
    assert creep[0] - rest > 0.03  # GHz: the lags still hold some of the mean, 37 GHz above
    assert abs(creep[-1] - rest) < 0.5 * (creep[0] - rest)
    assert (np.diff(creep[: hold.size]) <= 1e-12).all()
    assert answers[1.0][0] - rest > 1.5 * (creep[0] - rest)
    alone = np.asarray(predict(straight(Creep.at(gain=0.03)), hold))
    np.testing.assert_allclose(alone, rest, rtol=0, atol=1e-12)


# --- resonance


def test_a_turning_point_rings_as_the_description_says():
    hertz, z, slope = 400.0, 0.02, 6000.0  # GHz/s
    t = np.arange(5600) * 2.5e-5
    corner = 0.12  # six times as long as the start rings
    nu = slope * (corner - np.abs(t - corner))
    off = on(Resonance.at(hertz=hertz, damping=z, share=1.0), t, nu) - nu
    w0 = 2 * np.pi * hertz
    system = scipy.signal.TransferFunction([w0**2], [1, 2 * z * w0, w0**2])
    want = scipy.signal.lsim(system, nu, t)[1] - nu
    np.testing.assert_allclose(off, want, rtol=0, atol=1e-8)
    later = (t > corner) & (t < corner + 1.0 / hertz)
    lag = 2 * z / w0 * slope
    assert np.ptp(off[later]) / 2 == pytest.approx(2 * slope / w0, rel=0.12)
    assert np.mean(off[later]) == pytest.approx(lag, abs=0.1 * 2 * slope / w0)


def test_a_resonance_passes_by_its_share():
    t = np.arange(300) * 1e-4
    nu = np.cos(300 * t)
    whole, half = (
        on(Resonance.at(hertz=300.0, damping=0.9499, share=s), t, nu) for s in (1.0, 0.5)
    )
    np.testing.assert_allclose(half, (whole + nu) / 2, rtol=0, atol=1e-12)
    assert np.isfinite(whole).all() and np.abs(whole).max() < 2.0


# --- drift, gain drift, pickup


@pytest.mark.parametrize("offset", [0.0, -7.0])
def test_a_gain_drifts_about_the_middle_of_the_drive(offset):
    """Of a loop it is the mean of both branches where the drive crosses its middle."""
    t = np.linspace(-0.1, 9.0, 200)
    u = 3.0 + np.sin(t)
    loop = np.where(np.cos(t) > 0, 2.0, -2.0)
    nu = 50.0 + 30.0 * (u - 3.0) + loop
    about = 50.0 + 30.0 * ((u.max() + u.min()) / 2 - 3.0) + offset
    found = GainDrift.at(rate=1e-3, centre=offset, start=0.5)(*(jnp.asarray(x) for x in (t, nu, u)))
    wanted = about + (nu - about) * (1 + 1e-3 * (t - 0.5))
    np.testing.assert_allclose(
        found, wanted, rtol=0, atol=1e-5
    )  # straight but for its age over tau
    settles = GainDrift.at(rate=1e-3, start=0.5, tau=3.0)(*(jnp.asarray(x) for x in (t, nu, u)))
    gain = 1 + 3e-3 * (1 - np.exp(-(t - 0.5) / 3.0))
    np.testing.assert_allclose(settles, about - offset + (nu - about + offset) * gain, atol=1e-12)
    still = GainDrift.at(rate=1e-3)(*(jnp.asarray(x) for x in (t, nu, np.full(t.size, 3.0))))
    np.testing.assert_allclose(still, nu + 1e-3 * t * (nu - nu[0]), rtol=0, atol=1e-5)


def test_what_is_fixed_in_time_is_so():
    t = np.linspace(-0.1, 9.0, 200)
    nu = 50.0 + 30.0 * np.sin(t)
    slow = np.where(t > 0.5, 0.7 * (1 - np.exp(-(t - 0.5) / 3.0)), 0.0)
    np.testing.assert_allclose(
        on(Drift.at(amplitude=0.7, tau=3.0, start=0.5), t, nu), nu + slow, rtol=1e-14
    )
    np.testing.assert_allclose(
        on(Pickup.at(amplitude=0.1, hertz=50.0, phase=0.3), t, nu),
        nu + 0.1 * np.sin(100 * np.pi * t + 0.3),
        rtol=1e-13,
    )


def test_drift_before_its_start_is_none_and_long_after_it_all():
    drift = Drift.at(amplitude=2.0, tau=1e-2)
    assert np.array_equal(on(drift, [-1e9, -1.0, 0.0, 1e9], np.zeros(4)), [0.0, 0.0, 0.0, 2.0])


# --- mode hop


@pytest.mark.parametrize("width", [0.0, 2.0, 9.0])
@pytest.mark.parametrize("begin", [0.0, -0.05, 1.5, 3.1])
def test_a_hop_is_a_latch(width, begin):
    noise = np.random.default_rng(1).normal(size=500)
    nu = 50.0 + 20.0 * np.sin(0.05 * np.arange(500) + begin) + noise
    hopped, want = False, []
    for value in nu:
        hopped = value >= 50.0 or (hopped and value >= 50.0 - width)
        want.append(value + 3.0 if hopped else value)
    found = on(ModeHop.at(size=3.0, threshold=50.0, width=width), np.arange(500.0), nu)
    assert np.array_equal(found, want)
    assert 0 < np.sum(found != nu) < 500


# --- etalon


@pytest.mark.parametrize("steep", [0.0, 0.3, -0.9, 0.9999])
def test_an_etalon_is_undone_to_rounding(steep):
    etalon = Etalon.at(amplitude=steep * 5.0 / (2 * np.pi), phase=0.4, spacing=5.0)
    target = np.linspace(0.0, 80.0, 4001)
    given = etalon.inverse(jnp.asarray(target), jnp.asarray(target))
    np.testing.assert_allclose(on(etalon, target, given), target, rtol=0, atol=1e-12)


def test_an_etalon_that_turns_the_scan_back_is_refused():
    etalon = Etalon.at(amplitude=1.0, spacing=6.0)
    with pytest.raises(NotInvertible, match="amplitude 1 and spacing 6.*1.05.*Tilt or coat"):
        etalon.inverse(jnp.zeros(4), jnp.zeros(4))


# --- current coupling


def test_coupling_adds_the_slope_and_half_of_it_on_a_corner():
    t = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.9, 0.9, 0.9])
    u = np.array([0.0, 0.2, 0.5, 0.6, 0.0, -1.2, -1.2, -1.2])
    coupling = CurrentCoupling.at(coupling=2.0)
    found = np.asarray(coupling(jnp.asarray(t), jnp.zeros(8), jnp.asarray(u)))
    np.testing.assert_allclose(found[:6], [4.0, 4.0, 4.0, -1.0, -6.0, -6.0], atol=1e-12)
    assert np.isfinite(found).all()


def test_coupling_on_a_triangle_between_samples():
    """40 Hz, 3 V: 240 V/s on every sample, of either sign, the steady first one included."""
    phase = (np.arange(500) / 97 + 0.123) % 1.0
    value = 3.0 + 1.5 * (1 - 2 * np.abs(1 - 2 * phase))
    drive = Drive(np.arange(500) / 97 / 40.0, value, 40.0, "triangle")
    change = np.asarray(predict(straight(CurrentCoupling.at(coupling=1e-3)), drive)) - 25 * value
    np.testing.assert_allclose(change, np.where(phase < 0.5, 0.24, -0.24), rtol=0, atol=1e-6)


# --- where fits start


def seen(effect, *, noise=0.02, rates=(10.0, 20.0, 40.0), periods=4):
    """A device with the effect, and what the same without it leaves."""
    drives = triangle(rates, amplitude=3.0, bias=3.0, samples=1000 * periods, periods=periods)
    rows = to_batch(Recording.of(drives, [d.value for d in drives]), lead=True)
    base, full = (
        np.asarray(_respond(ECDL(paper_device().operator, e), rows.device()))
        for e in ((), (effect,))
    )
    inside = rows.sample >= 0
    rng = np.random.default_rng(5)
    return ResidualSummary(
        time=rows.time[inside],
        drive=rows.u[inside],
        response=base[inside],
        residual=(full - base)[inside] + noise * rng.normal(size=inside.sum()),
        run=np.nonzero(inside)[0],
        rates=tuple(rates),
        u_pp=(3.0,) * len(rates),
        step_s=min(d.step_s for d in drives),
        noise=noise,
        span=float(np.ptp(base[inside])),
    )


def test_a_pickup_is_found_among_the_trials():
    for hertz in (50.0, 87.3, 231.0):
        pickup = Pickup.at(amplitude=0.05, hertz=hertz, phase=1.0)
        evidence = seen(pickup)
        found = [float(p.hertz) for p in Pickup.initial_guesses(evidence)]
        assert min(abs(f - hertz) for f in found) <= 0.25 / evidence.duration_s
        size = [
            float(p.amplitude) for p in Pickup.initial_guesses(evidence) if abs(p.hertz - hertz) < 1
        ]
        assert size[0] == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("hertz", [60.3, 115.34, 190.7])
def test_a_pickup_is_found_that_slower_readings_show_at_another_frequency(hertz):
    """Runs of 210, 412 and 267 readings a second: of the first 95 Hz and 115 Hz are the same."""
    rng = np.random.default_rng(8)
    clocks = [
        start + np.arange(240) / rate
        for start, rate in ((1.42, 210.4), (3.117, 412.13), (5.93, 210.4), (8.01, 266.5))
    ]
    time = np.concatenate(clocks)
    tone = 0.3 * np.sin(2 * np.pi * hertz * time + 0.7)
    evidence = ResidualSummary(
        time=time,
        drive=np.zeros(time.size),
        response=np.zeros(time.size),
        residual=tone + 0.1 * rng.normal(size=time.size),
        run=np.repeat(np.arange(4), 240),
        rates=(3.5, 6.9, 3.5, 3.5),
        u_pp=(3.0,) * 4,
        step_s=1 / 412.13,
        noise=0.1,
        span=1.0,
    )
    found = [float(p.hertz) for p in Pickup.initial_guesses(evidence)]
    assert min(abs(f - hertz) for f in found) <= 0.25 / evidence.duration_s


def test_what_repeats_with_every_scan_is_no_pickup():
    """At one scan rate a multiple of it; with a second rate beside, a tone of its own."""
    evidence = seen(Pickup.at(amplitude=0.05, hertz=50.0, phase=1.0))
    slip = 0.1 / evidence.duration_s
    for rates, told in (((10.0,), False), ((10.0, 17.0), True)):
        guesses = Pickup.initial_guesses(dataclasses.replace(evidence, rates=rates))
        assert any(abs(float(p.hertz) - 50.0) < slip for p in guesses) == told


@pytest.mark.parametrize(("lasts", "some"), [(0.004, False), (0.1, True)])
def test_a_tone_of_less_than_a_cycle_is_no_pickup(lasts, some):
    """Of 4 ms a bend looks like half a cycle of the mains; 0.1 s hold five."""
    time = np.linspace(0.0, lasts, 400)
    tone = np.sin(2 * np.pi * 0.55 / lasts * time) + 0.3 * np.sin(2 * np.pi * 4.3 / lasts * time)
    summary = ResidualSummary(
        time=time, drive=np.zeros(400), response=np.zeros(400), residual=tone,
        run=np.zeros(400, int), rates=(0.0,), u_pp=(3.0,), step_s=lasts / 399, noise=0.01, span=1.0,
    )  # fmt: skip
    found = [float(p.hertz) for p in Pickup.initial_guesses(summary)]
    assert found and min(found) >= 1.0 / summary.recorded_s
    assert any(abs(f - 4.3 / lasts) < 0.5 / lasts for f in found)  # a true tone stays
    assert any(f in (50.0, 60.0, 100.0, 120.0, 150.0, 180.0) for f in found) == some


@pytest.mark.parametrize("spacing", [1.7, 6.5, 21.0])
def test_an_etalon_is_found_among_the_trials(spacing):
    evidence = seen(Etalon.at(amplitude=0.1, phase=2.0, spacing=spacing))
    cycles = [evidence.span / float(e.spacing) for e in Etalon.initial_guesses(evidence)]
    assert min(abs(c - evidence.span / spacing) for c in cycles) <= 1 / 3
    phases = [float(e.phase) for e in Etalon.initial_guesses(evidence)][:4]
    assert phases == pytest.approx([0, np.pi / 2, np.pi, 3 * np.pi / 2])


@pytest.mark.parametrize("size", [2.0, -0.6])
@pytest.mark.parametrize("width", [0.0, 7.0])
def test_a_hop_is_found_among_the_trials(size, width):
    evidence = seen(ModeHop.at(size=size, threshold=70.0, width=width))
    near = [
        h for h in ModeHop.initial_guesses(evidence)
        if abs(h.threshold - 70.0) < 0.5 and abs(h.width - width) < 0.7
    ]  # fmt: skip
    assert near and float(near[0].size) == pytest.approx(size, rel=0.2)


@pytest.mark.parametrize("size", [2.0, -0.6])
def test_a_hop_is_found_among_many_smaller_steps(size):
    """Of a base that misfits, such as where its plays turn; the hop lasts a few samples."""
    top = float(seen(ModeHop.at()).response.max()) - 0.3
    evidence = seen(ModeHop.at(size=size, threshold=top, width=0.1))
    steps = np.cumsum(np.random.default_rng(2).choice([0.2, -0.2], 60))
    at = np.linspace(0, evidence.residual.size - 1, 62).astype(int)[1:-1]
    evidence = dataclasses.replace(evidence, residual=evidence.residual.copy())
    for place, step in zip(at, np.diff(steps, prepend=0.0), strict=True):
        evidence.residual[place:] += step
    near = [
        h for h in ModeHop.initial_guesses(evidence)
        if abs(h.threshold - top) < 0.3 and h.width < 0.3
        and float(h.size) == pytest.approx(size, rel=0.2)
    ]  # fmt: skip
    assert near


def test_a_hop_at_the_very_top_is_found_where_the_base_is_off():
    """The model's response may never reach the threshold that the data show."""
    top = float(seen(ModeHop.at()).response.max()) - 0.3
    evidence = seen(ModeHop.at(size=2.0, threshold=top, width=0.1))
    off = np.full_like(evidence.residual, 1.0)
    evidence = dataclasses.replace(
        evidence, response=evidence.response - off, residual=evidence.residual + off
    )
    found = ModeHop.initial_guesses(evidence)
    assert any(abs(h.threshold - (top - 1.0)) < 0.3 and h.size > 1.6 for h in found)


@pytest.mark.parametrize("hertz", [350.0, 900.0])
def test_a_resonance_is_found_among_the_trials(hertz):
    evidence = seen(Resonance.at(hertz=hertz, damping=0.03, share=1.0))
    found = [float(r.hertz) for r in Resonance.initial_guesses(evidence)]
    assert min(abs(f / hertz - 1) for f in found) < 0.1
    assert min(abs(f / hertz - 1) for f in found[:4]) < 0.1  # by the data, not by the coarse grid


def test_sizes_of_drifts_and_coupling_come_from_the_residual():
    drift = Drift.initial_guesses(seen(Drift.at(amplitude=1.0, tau=0.7)))
    straightest = max(drift, key=lambda d: float(d.tau))
    assert 0.5 < float(straightest.amplitude / straightest.tau) < 1.4
    rate = float(GainDrift.initial_guesses(seen(GainDrift.at(rate=0.05)))[0].rate)
    assert rate == pytest.approx(0.05, rel=0.2)
    found = CurrentCoupling.initial_guesses(seen(CurrentCoupling.at(coupling=-3e-4)))
    assert float(found[0].coupling) == pytest.approx(-3e-4, rel=0.05)
    assert float(found[1].coupling) == pytest.approx(3e-4, rel=0.05)
