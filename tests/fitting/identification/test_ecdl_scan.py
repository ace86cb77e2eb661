"""Four real scans of one laser, read from fringes and fitted together."""

import numpy as np
import pytest
from scope_traces import FSR, NAMES, load

from fitting import fit
from rapi_jax import ECDL, RAPI, Drive, Recording
from rapi_jax.readout import read_etalon


@pytest.mark.slow
def test_four_traces_together(shared_data, capsys):
    drives, answers, noise = [], [], []
    for name in NAMES:
        drive, light, _ = load(shared_data / "ecdl_scan", name)
        readout = read_etalon(light, drive, fsr_ghz=FSR)
        thin = slice(None, None, 8)
        drives.append(Drive(drive.time[thin], drive.value[thin]))
        answers.append(readout.frequency[thin])
        noise.append(readout.fringe_noise * FSR / (2 * np.pi))
    recording = Recording.of(drives, answers, response_origin="run", response_lag_s=2e-3)
    got = fit(ECDL(RAPI.guess(recording)), recording, starts=2, hold_out=False, throw=False)
    for name, run, fringe in zip(NAMES, got.runs, noise, strict=True):
        with capsys.disabled():
            print(
                f"\ntrace {name}: residual {1e3 * run.rmse:.1f} MHz, {run.rmse_fraction:.2%} of "
                f"the span; fringe noise {1e3 * fringe:.1f} MHz"
            )
        assert np.isfinite(run.rmse)
        assert run.rmse_fraction < 0.03
