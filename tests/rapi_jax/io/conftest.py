"""A recording to write and break, a process that has ended, and where measured data may be."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._run import Run

DATA = Path(__file__).resolve().parents[3].parent / "shared" / "data"


def make_recording(seed: int = 0, samples: int = 400) -> Recording:
    """Two runs of different length and kind, with uncommon values of every field."""
    noise = np.random.default_rng(seed)
    time = np.arange(samples) * 1e-3
    drive = 3.0 + np.sin(2 * np.pi * 10.0 * time) + 1e-3 * noise.standard_normal(samples)
    response = 12.0 * drive + 0.1 * noise.standard_normal(samples)
    half = samples // 2
    return Recording(
        (
            Run(Drive(time, drive, 10.0, "sine", 1.5), response, "run01"),
            Run(Drive(time[:half], drive[:half]), response[:half], "run00"),
        ),
        response_origin="run",
        response_lag_s=1e-5,
        provenance={"operator": "\u00e9 '''\n\x7f\x00 <b>", "k.l": "1", "": "empty key"},
    )


@pytest.fixture
def recording() -> Recording:
    """The recording of `make_recording`."""
    return make_recording()


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of measured data, where there is one beside the repository."""
    if not DATA.is_dir():
        pytest.skip("measured data are not beside this repository (../shared/data)")
    return DATA


@pytest.fixture(scope="session")
def ended() -> int:
    """The number of a process that has ended."""
    done = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True
    )
    return int(done.stdout)
