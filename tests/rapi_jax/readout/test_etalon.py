"""A low-finesse cavity's fringes of a known scan."""

import numpy as np
import pytest

from rapi_jax import DataError, Drive
from rapi_jax.readout import read_etalon


def made(lag=2e-3, noise=0.01, seed=0, samples=4000):
    t = np.arange(samples) * (2.4 / samples)
    volts = np.interp(t, [0, 0.12, 2.1, 2.4], [4.0, 9.5, -2.5, 9.0])
    drive = np.interp(t - lag, t, volts)
    up = np.searchsorted([0.12 + lag, 2.1 + lag], t) != 1
    bow = (drive + 2.5) * (9.5 - drive) / 36.0
    nu = 0.25 * drive + np.where(up, -0.1, 0.1) * bow
    airy = 1 / (1 + 1.5 * np.sin(np.pi * nu / 0.322 + 0.4) ** 2)
    light = airy + noise * np.random.default_rng(seed).standard_normal(t.size)
    return Drive(t, volts), light, nu


def test_known_scan():
    drive, light, nu = made()
    readout = read_etalon(light, drive, fsr_ghz=0.322)
    error = readout.frequency - nu
    error -= np.median(error)
    assert np.std(error) < 0.006  # of a span of 3 GHz
    lag, stderr = readout.latency(drive)
    assert abs(lag - 2e-3) < max(4 * stderr, 5e-4)


def test_nothing_to_read():
    drive, light, _ = made()
    with pytest.raises(DataError, match="one finite value"):
        read_etalon(light[:-1], drive, fsr_ghz=0.322)
