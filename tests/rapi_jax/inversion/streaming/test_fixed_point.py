"""The inverse in integers: bit by bit against Python's, what overflows, what a bit is worth."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from streaming_models import Loose, monotone

from rapi_jax import FixedPointCompensator, StreamingCompensator, word_length_errors
from rapi_jax.examples import paper_device


def scan(samples=300, span=60.0, start=25.0):
    x = np.arange(samples) / samples
    return start + span * (1.0 - np.abs(1.0 - 2.0 * x))


@pytest.fixture(scope="module")
def paper():
    return StreamingCompensator.for_scan(paper_device(), 20.0, scan(), within=(0.0, 7.0))


class Integers:
    """The same numbers as Python's integers, which have no length; notes the longest."""

    def __init__(self, fixed):
        for name in ("r", "p", "lam", "offset", "d", "start"):
            setattr(self, name, [int(x) for x in getattr(fixed, name)])
        self.bow, self.low, self.high = int(fixed.bow), int(fixed.low), int(fixed.high)
        self.slope, self.weight, self.drive, self.guard = (int(x) for x in fixed.shifts)
        self.state, self.longest = self.start, 0

    def shifted(self, product, by):
        self.longest = max(self.longest, (abs(product) + 2 ** (by - 1)).bit_length() + 1)
        return (product + 2 ** (by - 1)) // 2**by

    def clamped(self, x):
        tilt = self.shifted(self.bow * x, self.drive)
        out = []
        for r, lam, offset, before in zip(self.r, self.lam, self.offset, self.state, strict=True):
            upper = self.shifted((lam + tilt) * x, self.slope) + offset
            out.append(max(x - r, min(upper, before)))
        return out

    def respond(self, x):
        value = self.d[-1]
        for c in self.d[-2::-1]:
            value = self.shifted(value * x, self.drive) + c
        products = [p * v for p, v in zip(self.p, self.clamped(x), strict=True)]
        return value + sum(self.shifted(product, self.weight) for product in products)

    def step(self, target):
        """The highest drive whose response does not exceed the target, or the one above it."""
        target, x = target * 2**self.guard, self.low
        for bit in range((self.high - self.low).bit_length() - 1, -1, -1):
            if x + 2**bit <= self.high and self.respond(x + 2**bit) <= target:
                x += 2**bit
        above = min(x + 1, self.high)
        if self.respond(above) - target < target - self.respond(x):
            x = above
        self.state = self.clamped(x)
        return x


def targets_of(compensator, rng, count=60):
    """Ramps, steps, and what is out of reach."""
    top = compensator.frozen.respond(compensator.high, compensator.frozen.rest(compensator.low))[0]
    low = compensator.frozen.respond(compensator.low, compensator.frozen.rest(compensator.low))[0]
    ramp = np.interp(np.arange(count), np.arange(0, count, 10), rng.random(count // 10))
    share = np.concatenate([ramp, rng.uniform(-0.1, 1.1, count), [-9.0, 9.0]])
    return float(low) + share * float(top - low)


def check_bits(compensator, targets, bits):
    fixed = FixedPointCompensator.of(compensator, bits=bits)
    words = [int(x) for x in fixed.encode(targets)]
    state, drive = jax.lax.scan(
        lambda state, y: fixed.step(state, y), fixed.initial(), jnp.asarray(words)
    )
    plain = Integers(fixed)
    assert [plain.step(word) for word in words] == [int(x) for x in drive]
    assert plain.state == [int(x) for x in state]
    assert plain.longest <= int(fixed.widest) <= 64
    point = 2 ** (bits - 1)
    assert all(-point <= x < point for x in (*plain.state, *words, *map(int, drive)))
    assert int(fixed.iterations) == (int(fixed.high) - int(fixed.low)).bit_length() <= bits


@pytest.mark.parametrize("bits", [8, 16, 24, 32])
def test_every_bit_is_that_of_plain_integers(paper, bits):
    check_bits(
        paper, np.concatenate([scan(60), targets_of(paper, np.random.default_rng(bits))]), bits
    )


def test_every_bit_with_bent_crossed_and_negative_plays():
    rng = np.random.default_rng(11)
    models = monotone(rng, 12, weights=(0.2, 0.5), crossed=True, bent=True)
    assert any(float(m.p.min()) < 0 for m, _, _ in models)
    for operator, low, high in models:
        compensator = StreamingCompensator.of(operator, 10.0, within=(low, high))
        check_bits(compensator, targets_of(compensator, rng), int(rng.integers(10, 27)))


def test_error_halves_with_every_bit(paper):
    errors = word_length_errors(paper, scan(), bits=range(12, 31, 2))
    for name in ("drive", "response"):
        size = np.log2([getattr(e, name) for e in errors])
        bits = np.array([e.bits for e in errors])
        assert np.polyfit(bits, size, 1)[0] == pytest.approx(-1.0, abs=0.07)
        assert (np.diff(size) < -1.0).all()
    steps = np.array([e.drive * 2.0 ** (e.bits - 1) / 8.0 for e in errors])  # full scale 8 V
    assert steps.max() < 6.0
    assert errors[4].bits == 20 and errors[4].response < 1e-3
    assert (np.diff([e.iterations for e in errors]) == 2).all()


def test_word_lengths_that_do_not_do_are_refused(paper):
    for bits in (7, 33):
        with pytest.raises(ValueError, match="must lie between 8 and 32"):
            FixedPointCompensator.of(paper, bits=bits)
    # A parabola far from its origin: terms a thousand times their difference.
    one = jnp.ones(1)
    steep = Loose(
        0.1 * one, one, one, one, jnp.zeros(()), jnp.zeros(()),
        jnp.asarray([-100.0, 1.0]), jnp.zeros(()), 1,
    )  # fmt: skip
    compensator = StreamingCompensator.of(steep, 10.0, within=(51.0, 56.0))
    assert int(FixedPointCompensator.of(compensator, bits=24).widest) < 64
    with pytest.raises(ValueError, match="an intermediate would need .* bits, not 64"):
        FixedPointCompensator.of(compensator, bits=32)


def test_targets_and_drives_saturate_at_defined_ends(paper):
    fixed = FixedPointCompensator.of(paper, bits=16)
    words = fixed.encode(np.array([-1e9, -np.inf, 1e9, np.inf]))
    assert [int(x) for x in words] == [-(2**15), -(2**15), 2**15 - 1, 2**15 - 1]
    drive = np.asarray(fixed.run(np.array([-1e9, 1e9, -1e9]))[1])
    low, high, step = float(paper.low), float(paper.high), float(fixed.step_drive)
    assert low <= drive[0] < low + step and high - step < drive[1] <= high
    assert drive[2] == drive[0]
    with pytest.raises(ValueError, match="holds NaN"):
        fixed.encode(np.array([1.0, np.nan]))


def test_a_stream_in_parts_and_whatever_the_host_says(paper):
    y = scan()
    fixed = FixedPointCompensator.of(paper, bits=20)
    state, whole = fixed.run(y)
    with jax.enable_x64(False):
        fixed = FixedPointCompensator.of(paper, bits=20)
        middle, first = fixed.run(y[:150])
        last, second = fixed.run(y[150:], middle)
        assert last.dtype == np.int64 and first.dtype == np.float64
    assert np.array_equal(np.concatenate([first, second]), whole)
    assert np.array_equal(last, state)
