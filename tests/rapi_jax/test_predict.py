"""`predict` of an operator alone: on its own nodes the same as on the grid that effects need."""

import subprocess
import sys

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import ECDL, Drive, predict, triangle
from rapi_jax._ecdl import _on_grid, _operator_alone
from rapi_jax.effects import Delay
from rapi_jax.examples import paper_device
from rapi_jax.sampling._operator_nodes import OperatorNodes

STEP = 1e-4  # s


def triangles(seed, periods):
    """Three triangles whose turning points lie between samples, begun anywhere."""
    rng = np.random.default_rng(seed)
    drives = triangle((10.0, 20.0, 33.0), amplitude=4.2, bias=3.0, samples=1711, periods=periods)
    for drive in drives:
        value = np.roll(drive.value, int(rng.integers(0, drive.size))) if seed else drive.value
        yield Drive(drive.time, value, drive.excitation_hz, drive.waveform, drive.start_s)


def walk(seed, rate=20.0):
    """A drive that does not repeat, of straight pieces that meet between samples."""
    rng = np.random.default_rng(seed)
    knots = np.r_[0.0, np.sort(rng.choice(np.arange(20.0, 980.0), 5, replace=False)), 999.0]
    knots[1:-1] += rng.uniform(-0.4, 0.4, 5)
    value = np.interp(np.arange(1000), knots, rng.uniform(0.8, 5.2, 7))
    return Drive(np.arange(1000) * STEP, value, rate)


def sines(seed):
    time = np.arange(1500) * STEP
    return Drive(time, 3.0 + np.sin(2 * np.pi * (37.3 + seed) * time), 37.3 + seed, "sine")


DRIVES = {f"walk {seed}": walk(seed) for seed in range(4)}
DRIVES |= {"walk without rate": walk(5, None), "sine": sines(0), "other sine": sines(2)}
DRIVES |= {
    f"triangle {seed} {periods} {k}": drive
    for seed in (0, 1)
    for periods in (1, 4)
    for k, drive in enumerate(triangles(seed, periods))
}


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("known", [False, True], ids=["Eq. 13", "initial"])
def test_an_operator_alone_answers_as_on_the_grid(name, known):
    device, drive = paper_device(), DRIVES[name]
    initial = jnp.linspace(0.0, 1.0, 10) if known else None
    expected = np.asarray(_on_grid(device, drive, initial))
    alone = _operator_alone(device.operator, drive, initial)
    assert alone is not None
    np.testing.assert_allclose(alone, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(alone, predict(device, drive, initial=initial))


@pytest.mark.parametrize("periods", [1, 3])
def test_one_period_is_enough_where_the_drive_repeats(periods):
    drive = triangle((10.0,), amplitude=4.5, bias=3.0, samples=900, periods=periods)[0]
    nodes = OperatorNodes.of(drive)
    assert nodes.size <= 900 / periods + 2
    marks = nodes.answer(nodes.u)  # a response that is the drive
    np.testing.assert_allclose(marks, drive.value, atol=1e-12)


def test_what_stretches_cannot_tell_is_left_to_the_grid():
    device, drive = paper_device(), walk(0)
    noisy = Drive(drive.time, drive.value + 0.1 * np.random.default_rng(0).normal(size=1000), 20.0)
    assert _operator_alone(device.operator, noisy, None) is None
    np.testing.assert_array_equal(predict(device, noisy), _on_grid(device, noisy, None))
    falls = ECDL(eqx.tree_at(lambda o: o.lam, device.operator, jnp.asarray(-0.2)))
    assert _operator_alone(falls.operator, drive, None) is None
    nodes = OperatorNodes.of(drive)
    law = {"u_pp": jnp.asarray(np.ptp(nodes.u)), "u_min": jnp.asarray(nodes.u.min())}
    by_sample = falls.operator(jnp.asarray(nodes.u), jnp.asarray(drive.rate), **law)
    found, expected = predict(falls, drive), nodes.answer(np.asarray(by_sample))
    assert np.isfinite(expected).all()
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    behind = predict(ECDL(falls.operator, (Delay(tau=jnp.asarray(1e-4)),)), drive)
    assert np.isfinite(behind).all()


HOST_WITH_32_BITS = """
import jax
import numpy as np
from rapi_jax import ECDL, predict, triangle
from rapi_jax.effects import AmplifierLowpass
from rapi_jax.examples import paper_device
drives = triangle([10.0], amplitude=4.5, bias=3.0, samples=100, periods=3)
drives += triangle([10.0], amplitude=4.5, bias=3.0, samples=100)
for drive in drives:
    for effects in ((), (AmplifierLowpass.at(tau=1e-4),)):
        response = predict(ECDL(paper_device().operator, effects), drive)
        response += np.full(drive.size, 2.0**-40)
        assert type(response) is np.ndarray and response.dtype == np.float64
        assert (response != response.astype(np.float32)).any()
assert not jax.config.jax_enable_x64
print("done")
"""


@pytest.mark.process
def test_the_answer_is_an_array_of_the_callers_own_in_any_host():
    """In a host of 32 bits noise that is added to it would be cut, were it an array of JAX."""
    code = [sys.executable, "-W", "error", "-c", HOST_WITH_32_BITS]
    done = subprocess.run(code, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "done\n"
