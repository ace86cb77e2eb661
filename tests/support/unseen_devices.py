"""Devices with effects that no open bank held, and what these do; `world` is of the third set."""

import functools

import numpy as np

from fitting.blind.simulator._scan import Scan
from fitting.blind.simulator._signal_path import RunState
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device

TRIANGLE = Scan(40.0, 4.2, 3.0, "triangle", 3, 400, start_s=5.0)


@functools.cache
def world(name: str, kind: str = "form", seed: int = 5) -> SimulatedDevice:
    return draw_device(seed, kind, f"{name}/3" if kind == "form" else name, 6.0)


def parameters(w: SimulatedDevice) -> dict:
    return w.parameters[w.truth[0]]


def difference(w: SimulatedDevice) -> list[np.ndarray]:
    return [a - b for a, b in zip(w.noise_free, w.without, strict=True)]


def clock(w: SimulatedDevice) -> list[np.ndarray]:
    return [run.start_s + run.time_s for run in w.runs]


def driven(w: SimulatedDevice, scan: Scan) -> np.ndarray:
    (moment,) = w.signal_path.path([scan])
    count = scan.periods * scan.samples
    return moment.drive[:: w.signal_path.oversample][-count:]


def change(w: SimulatedDevice, scan: Scan) -> np.ndarray:
    return w.simulate([scan])[0] - w.simulate_without_effects([scan])[0]


def acts(w: SimulatedDevice, on: str, x: np.ndarray, t: np.ndarray, scan: Scan = TRIANGLE):
    """What a law makes of any signal on any clock."""
    now = RunState(scan, 0, t, t[1] - t[0], x, x, x, x, w.signal_path.rest, None, 0.0, {})
    law = getattr(w.signal_path.effects[0], on)
    assert law is not None
    return law(x, now)


def on_waves(found: np.ndarray, *turns: np.ndarray) -> list[float]:
    """Amplitudes of sines that make up a signal wholly."""
    waves = np.column_stack([wave(turn) for turn in turns for wave in (np.cos, np.sin)])
    c, *_ = np.linalg.lstsq(waves, found, rcond=None)
    np.testing.assert_allclose(found, waves @ c, atol=1e-7 * np.max(np.abs(found)))
    return np.hypot(c[::2], c[1::2]).tolist()
