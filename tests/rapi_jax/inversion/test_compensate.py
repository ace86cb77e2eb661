"""Ideal scans, compensation of the paper's device, and every drive that must be refused."""

import dataclasses
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import (
    ECDL,
    RAPI,
    DataError,
    DriveLimits,
    Identified,
    LimitError,
    ModelError,
    NotInvertible,
    Target,
    compensate,
    linear_scan,
    predict,
)
from rapi_jax.effects import (
    AbstractDriveEffect,
    AbstractInvertible,
    AbstractOpticalEffect,
    AmplifierLowpass,
    AmplitudeLaw,
    Creep,
    CurrentCoupling,
    Delay,
    Quantisation,
    RateLaw,
    Resonance,
    Saturation,
    SlewLimit,
)
from rapi_jax.effects import Etalon as ModelEtalon
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.inversion._anderson import AndersonMixing

LIMITS = DriveLimits(0.0, 7.5, 2000.0)


@pytest.fixture(scope="module")
def identified():
    return Identified.of(paper_recording(samples=400)[0])


def test_a_target_in_another_unit_is_refused(identified):
    seen = dataclasses.replace(identified, response_unit="um")
    (target,) = linear_scan(20.0, span=60.0, samples=512)
    with pytest.raises(ModelError, match=r"in GHz, but the model answers in um.*unit='um'"):
        compensate(paper_device(), target, identified=seen)


@pytest.mark.parametrize(("rise", "corner"), [(0.5, 0.02), (0.5, 0.0), (0.9, 0.05), (0.3, 0.1)])
def test_linear_scan_is_straight_between_its_corners(rise, corner):
    (scan,) = linear_scan(25.0, span=60.0, rise=rise, corner=corner, samples=5000)
    assert scan.span == pytest.approx(60.0, rel=1e-12) and scan.value[0] == 0.0
    cycles = np.arange(5000) / 5000 + corner * (rise - 0.5)
    slope = np.diff(scan.value, append=scan.value[:1]) * 5000
    edges = 1 / 5000
    up = (cycles > corner / 2) & (cycles + edges < rise - corner / 2)
    down = (cycles > rise + corner / 2) & (cycles + edges < 1.0 - corner / 2)
    for part, sign in ((up, 1.0), (down, -1.0)):
        assert np.ptp(slope[part]) < 1e-8 * np.abs(slope[part]).mean()
        assert np.sign(slope[part].mean()) == sign
    assert -slope[down].mean() / slope[up].mean() == pytest.approx(rise / (1 - rise), rel=1e-9)
    if corner:  # no step of the slope is larger than the parabola's
        most = 60.0 / (rise * (1 - rise)) / corner / 5000
        assert np.abs(np.diff(slope, append=slope[:1])).max() < 1.2 * most


@pytest.mark.parametrize(
    "wrong", [{"span": 0.0}, {"span": np.nan}, {"rise": 1.0}, {"corner": 0.5}, {"samples": 4}]
)
def test_linear_scan_refuses_nonsense(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        linear_scan(10.0, **{"span": 60.0, **wrong})


@pytest.mark.parametrize("span", [10.0, 100.0, 1e3, 1e6])
def test_a_span_far_beyond_the_model_is_refused_with_what_it_reaches(span):
    """A core whose cubic falls soon after the range recorded: its range turns round far outside."""
    operator = RAPI(
        alpha=0.07, zeta=0.055, lam=5.5, eta=1.0, a=0.027, b=-0.09, d=(0.62, 0.02, -0.0147),
        d_0=0.35, plays=10,
    )  # fmt: skip
    device = ECDL(operator)
    seen = Identified(-5.5, 5.5, 1e3, (50.0,), (11.0,), response_unit="V")
    (target,) = linear_scan(50.0, span=span, unit="V")
    with pytest.raises(
        LimitError, match=r"a scan of [\d.e+]+ V .* by the model it reaches .* V, and"
    ):
        compensate(device, target, identified=seen, extrapolate=True)
    (target,) = linear_scan(50.0, span=4.0, unit="V")
    made = compensate(device, target, identified=seen, extrapolate=True)
    assert made.certificate.invertible


@pytest.mark.parametrize("frequency", [10.0, 40.0, 55.0])
@pytest.mark.parametrize(("span", "bias"), [(75.0, 3.0), (45.0, 3.3), (60.0, 2.7)])
def test_the_exact_inverse_makes_the_device_follow(frequency, span, bias):
    (target,) = linear_scan(frequency, span=span)
    got = compensate(paper_device(), target, limits=LIMITS, bias=bias)
    answer = np.asarray(predict(paper_device(), got.drive))
    assert np.abs(answer - answer.min() - target.value).max() < 1e-9 * span
    assert got.bias == pytest.approx(bias, abs=1e-9)
    assert got.drive.value.argmin() == 0 and got.certificate.invertible
    assert got.inverse == "exact" and got.drive.rate == frequency
    again = dataclasses.replace(  # two periods on: it repeats
        got.drive,
        time=np.arange(2 * got.drive.size) * got.drive.step_s,
        value=np.tile(got.drive.value, 2),
    )
    twice = np.asarray(predict(paper_device(), again))
    assert np.abs(twice[: target.value.size] - twice[target.value.size :]).max() < 1e-9


def test_a_sawtooth_is_followed():
    (target,) = linear_scan(20.0, span=60.0, rise=0.9, corner=0.03)
    got = compensate(paper_device(), target, limits=DriveLimits(0.0, 7.5, 1e4), bias=3.0)
    assert got.predicted is not None
    assert np.abs(got.predicted - target.value).max() < 1e-9


class Etalon(AbstractOpticalEffect, AbstractInvertible):
    """A ripple over optical frequency, undone by fixed-point steps."""

    name: ClassVar = "etalon"

    depth: float

    @classmethod
    def initial_guesses(cls, evidence):
        return []

    def __call__(self, t, signal):
        return signal + self.depth * jnp.sin(2 * jnp.pi * signal / 5.0)

    def inverse(self, t, signal):
        x = signal
        for _ in range(60):
            x = signal - self.depth * jnp.sin(2 * jnp.pi * x / 5.0)
        return x


class Divider(AbstractDriveEffect, AbstractInvertible):
    """An amplifier with a gain and an offset."""

    name: ClassVar = "divider"

    gain: float

    @classmethod
    def initial_guesses(cls, evidence):
        return []

    def __call__(self, t, signal):
        return self.gain * signal + 0.01

    def inverse(self, t, signal):
        return (signal - 0.01) / self.gain


class Lossy(AbstractOpticalEffect):
    """What cannot be undone."""

    name: ClassVar = "lossy"

    @classmethod
    def initial_guesses(cls, evidence):
        return []

    def __call__(self, t, signal):
        return jnp.round(signal)


def test_effects_are_undone_with_the_operator():
    device = ECDL(paper_device().operator, (Divider(1.02), Etalon(0.1)))
    (target,) = linear_scan(20.0, span=70.0)
    got = compensate(device, target, limits=LIMITS, bias=3.0)
    answer = np.asarray(predict(device, got.drive))
    assert np.abs(answer - answer.min() - target.value).max() < 1e-7
    assert 1.02 * got.bias + 0.01 == pytest.approx(3.0, abs=1e-6)


def test_an_effect_that_cannot_be_undone_is_named():
    (target,) = linear_scan(20.0, span=70.0)
    with pytest.raises(NotInvertible, match="lossy cannot be undone"):
        compensate(ECDL(paper_device().operator, (Lossy(),)), target, limits=LIMITS, bias=3.0)


WIDE = DriveLimits(-1.0, 8.5, 8000.0)
LAG, LATE = AmplifierLowpass(tau=1.1e-4), Delay(tau=1.3e-4)
RINGS = Resonance(hertz=900.0, damping=0.05, share=1.0)
LAWS = (
    RateLaw(exponent=1.6),
    AmplitudeLaw(threshold=0.2, gain=0.02, tilt=0.01, reference=4.0, centre=2.5),
    AmplitudeLaw(threshold=0.2, gain=0.02, tilt=0.01, pivot=40.0, reference=4.0, centre=2.5),
)
RIPPLE = ModelEtalon(amplitude=0.1, spacing=7.0, phase=1.0)


def followed(effects, target, limits=WIDE):
    """The response, two periods on, of the device with `effects` to the drive for it."""
    device = ECDL(paper_device().operator, effects)
    got = compensate(device, target, limits=limits, bias=3.0)
    again = dataclasses.replace(
        got.drive,
        time=np.arange(2 * got.drive.size) * got.drive.step_s,
        value=np.tile(got.drive.value, 2),
    )
    answer = np.asarray(predict(device, again))[got.drive.size - 1 : -1]
    answer = np.roll(answer, -1)
    off = (answer - np.mean(answer) - target.value + np.mean(target.value)) / target.span
    return got, np.sqrt(np.mean(off**2)), np.abs(off).max()


@pytest.mark.parametrize(
    "effects",
    [(SlewLimit(limit=400.0),), (Saturation(low=0.5, high=5.5),), LAWS, (*LAWS, RIPPLE)],
    ids=["slew", "saturation", "laws", "laws and etalon"],
)
def test_effects_without_a_memory_are_undone_to_rounding(effects):
    (target,) = linear_scan(20.0, span=70.0)
    assert followed(effects, target)[2] < 1e-9


@pytest.mark.parametrize(
    ("effects", "plain_misses"),
    [
        ((RINGS,), True),
        ((LAG, LATE, RIPPLE), True),
        ((*LAWS, LAG, LATE), True),
        ((CurrentCoupling(coupling=-3e-3),), True),
        ((LAG, LATE, CurrentCoupling(coupling=1e-3)), True),
        ((), False),
    ],
    ids=["ring", "lag-delay-etalon", "laws", "coupled", "all", "none"],
)
def test_effects_with_a_memory_are_undone_to_a_millionth(effects, plain_misses):
    """Unlike by the drive of the model without them."""
    (target,) = linear_scan(20.0, span=70.0)
    got, rms, most = followed(effects, target)
    assert rms < 1e-6
    assert most < 1e-5
    assert got.predicted is not None
    plain = compensate(ECDL(paper_device().operator), target, limits=WIDE, bias=3.0)
    answer = np.asarray(predict(ECDL(paper_device().operator, effects), plain.drive))
    off = answer - answer.mean() - target.value + target.value.mean()
    assert (np.sqrt(np.mean(off**2)) > 1e-4 * target.span) == plain_misses


def test_a_lag_and_a_resonance_need_longer_corners():
    """A parabola's end asks the mirror for a jump of force, and the amplifier for more."""
    (short,) = linear_scan(20.0, span=70.0)
    with pytest.raises(LimitError, match="smooth the corners more"):
        followed((LAG, RINGS), short)
    (target,) = linear_scan(20.0, span=60.0, corner=0.2)
    assert followed((LAG, RINGS), target, DriveLimits(-1.0, 8.5, 2e4))[1] < 1e-6


def test_creep_is_undone_as_it_is_long_after_the_start():
    (target,) = linear_scan(20.0, span=70.0)
    device = ECDL(paper_device().operator, (Creep(gain=0.02, history=1.0),))
    fresh = ECDL(device.operator, (Creep(gain=0.02, history=0.0),))
    drives = [compensate(d, target, limits=WIDE, bias=3.0).drive.value for d in (device, fresh)]
    np.testing.assert_array_equal(*drives)
    assert followed(device.effects, target)[1] < 1e-6


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (Quantisation(step=0.01), "quantisation cannot be undone"),
        (Saturation(high=4.0), r"saturation passes -inf to 4 V.*Scan less, or move"),
        (SlewLimit(limit=100.0), r"slew_limit passes at most 100 V/s.*Scan less, more slowly"),
        (ModelEtalon(amplitude=2.0, spacing=7.0), "turns the response back"),
        (AmplitudeLaw(tilt=-0.9, reference=4.0), "gain of -.*must be positive"),
    ],
)
def test_what_no_drive_can_undo_is_refused_with_a_cure(effect, message):
    (target,) = linear_scan(20.0, span=70.0)
    with pytest.raises(NotInvertible, match=message):
        compensate(ECDL(paper_device().operator, (effect,)), target, limits=WIDE, bias=3.0)


def test_sharp_corners_behind_a_lag_are_refused_with_a_cure():
    (target,) = linear_scan(20.0, span=70.0, corner=0.0, samples=1024)
    with pytest.raises(NotInvertible, match="Round its corners more, or give the target more"):
        compensate(ECDL(paper_device().operator, (LAG,)), target, limits=WIDE, bias=3.0)


def test_sharp_corners_are_followed_late():
    """A delay asks for corners between samples; they stay sharp."""
    (target,) = linear_scan(20.0, span=70.0, corner=0.0)
    got, rms, most = followed((LATE,), target)
    assert rms < 1e-6
    assert got.drive.value.argmin() > got.drive.size - 30


def test_mixing_solves_a_linear_problem_in_as_many_rounds_as_it_has_directions():
    rng = np.random.default_rng(2)
    matrix, wanted = 0.6 * rng.normal(size=(5, 5)), rng.normal(size=5)
    mixing, place = AndersonMixing(), np.zeros(5)
    for _ in range(7):
        place = mixing.next(place, wanted + matrix @ place)
    np.testing.assert_allclose(place, np.linalg.solve(np.eye(5) - matrix, wanted), rtol=1e-7)


def test_a_model_that_is_not_monotone_gives_no_drive_and_says_where():
    operator = RAPI(
        alpha=0.3, zeta=0.0, lam=1.2, eta=1.0, a=0.5, b=0.0, d=(30.0, -4.0, 0.0), plays=5
    )
    (target,) = linear_scan(20.0, span=20.0)
    with pytest.raises(NotInvertible, match=r"does not rise with it from 3\.\d+ to"):
        compensate(ECDL(operator), target, limits=LIMITS, bias=3.2)


def test_out_of_the_identified_range_is_refused_unless_asked_for(identified):
    (fast,) = linear_scan(60.0, span=60.0)
    wide = {"limits": DriveLimits(-2.0, 9.0, 1e4)}
    with pytest.raises(ModelError, match="the scan rate is 60 Hz.*10 to 40"):
        compensate(paper_device(), fast, identified=identified, **wide)
    (large,) = linear_scan(20.0, span=95.0)
    with pytest.raises(ModelError, match="identified from 0.75 to 5.25"):
        compensate(paper_device(), large, identified=identified, **wide)
    got = compensate(paper_device(), large, identified=identified, extrapolate=True, **wide)
    assert got.notes and "identified from" in got.notes[0]


def test_limits_follow_from_what_was_identified(identified):
    (target,) = linear_scan(40.0, span=75.0)  # a little more than the 4.5 V of the identification
    got = compensate(paper_device(), target, identified=identified)
    assert got.bias == pytest.approx(3.0, abs=1e-3) and not got.notes
    (large,) = linear_scan(10.0, span=90.0)
    with pytest.raises(LimitError, match="needs more than"):
        compensate(paper_device(), large, identified=identified)


def test_neither_range_nor_limits_is_an_error():
    with pytest.raises(ValueError, match="Give `limits`"):
        compensate(paper_device(), linear_scan(10.0, span=60.0)[0])


def test_a_bias_outside_the_limits_is_refused():
    with pytest.raises(LimitError, match="bias of 9 V"):
        compensate(paper_device(), linear_scan(10.0, span=60.0)[0], limits=LIMITS, bias=9.0)


def test_a_slope_over_the_limit_is_refused_with_its_sample():
    slow = DriveLimits(0.0, 7.5, 300.0)
    (target,) = linear_scan(40.0, span=75.0)
    with pytest.raises(LimitError, match=r"after sample \d+ is 7\d\d\.\d+ V/s.*300 V/s"):
        compensate(paper_device(), target, limits=slow, bias=3.0)


def test_refusals_are_in_the_unit_of_the_drive(identified):
    """A drive may be the command of a servo in um; limits of a file are in the same unit."""
    servo = dataclasses.replace(identified, drive_unit="um")
    (target,) = linear_scan(10.0, span=60.0)
    with pytest.raises(LimitError, match="bias of 9 um .* limits, .* um"):
        compensate(paper_device(), target, identified=servo, bias=9.0)
    slow = DriveLimits(0.0, 7.5, 30.0)
    with pytest.raises(LimitError, match=r"\d um/s, but `slew_v_per_s` is 30 um/s"):
        compensate(paper_device(), target, identified=servo, limits=slow)
    (large,) = linear_scan(10.0, span=90.0)
    with pytest.raises(LimitError, match=r"more than [\d.]+ um peak to peak"):
        compensate(paper_device(), large, identified=servo)


def test_targets_are_checked():
    time = np.arange(100) / 1000.0
    value = 1.0 - np.abs(1.0 - np.arange(100) / 50.0)
    assert Target(time, value, 10.0).span == pytest.approx(1.0)
    turned = Target.of(np.roll(value, 31) + 7.0, 10.0)
    assert np.allclose(turned.value, value)
    for bad in (
        {"time": time * 1.01},
        {"value": value[::-1]},
        {"value": 0.0 * value},
        {"value": value[:50]},
        {"excitation_hz": 0.0},
        {"value": np.where(value > 0.5, np.nan, value)},
    ):
        with pytest.raises(DataError):
            Target(**{"time": time, "value": value, "excitation_hz": 10.0, **bad})


@pytest.mark.parametrize("span", [120.0, 25000.0])
def test_a_span_beyond_what_was_recorded_is_refused_as_such(identified, span):
    """With an effect of the response, too, where the scan's place is looked for first."""
    (target,) = linear_scan(10.0, span=span, samples=256)
    laser = ECDL(paper_device().operator, (Etalon.at(depth=0.01),))
    message = (
        rf"a scan of {span:g} GHz centred on 3 V .* the recordings, 0.75 to 5.25 V, span 7.* GHz"
    )
    with pytest.raises(LimitError, match=message):
        compensate(laser, target, identified=identified)
