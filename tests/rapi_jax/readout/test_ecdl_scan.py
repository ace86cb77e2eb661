"""A real scanned laser, read through the fringes of a low-finesse cavity."""

import numpy as np
import pytest
from scope_traces import FSR, NAMES, load, opening

from rapi_jax.readout import read_etalon


@pytest.mark.slow
def test_opening_of_the_real_loops(shared_data, capsys):
    raw, free = {}, {}
    for name in NAMES:
        drive, light, corners = load(shared_data / "ecdl_scan", name)
        readout = read_etalon(light, drive, fsr_ghz=FSR)
        lag, stderr = readout.latency(drive)
        noise = np.std(np.diff(light)) / np.sqrt(2) / (np.ptp(light) / 2)
        raw[name] = opening(drive, readout.frequency, corners)
        free[name] = opening(drive, readout.frequency, corners, lag)
        with capsys.disabled():
            print(
                f"\ntrace {name}: {np.ptp(drive.value):.1f} V, {np.ptp(readout.frequency):.2f} GHz,"
                f" opening {raw[name]:.2%} as recorded, {free[name]:.2%} without the lag of "
                f"{1e3 * lag:.1f} +- {1e3 * stderr:.1f} ms; residual {readout.fringe_noise:.3f}, "
                f"noise {noise:.3f} of the visibility"
            )
        assert 2.0 < np.ptp(readout.frequency) / FSR / (np.ptp(drive.value) / 3) < 3.2
        assert readout.fringe_noise < 0.1
        assert 0 < lag < 5e-3
    small = [free[name] for name in ("5", "6", "9")]  # 10 to 12 V
    assert 0.04 < np.mean(small) < 0.06
    assert max(small) < raw["10"]  # larger scans open further
