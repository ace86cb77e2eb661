"""From drive to recording through fringes: Table 1's uncompensated half, latency, repeatability."""

import numpy as np
import pytest

from hardware import SimulatedBench
from rapi_jax import Recording
from rapi_jax._metrics import linearity
from rapi_jax.examples import paper_drives
from rapi_jax.readout import read_fringes

UP = (0.435, 0.400, 0.391, 0.400)  # GHz, Table 1
DOWN = (3.28, 3.24, 3.12, 3.03)
LATENCIES = (1e-4, 1e-3)  # s


@pytest.fixture(scope="module")
def paper():
    """The paper's four triangles, measured one after the other, and what they were."""
    bench = SimulatedBench.like_paper(seed=0)
    drives = paper_drives()
    truth = [bench.truth(drive) for drive in drives]
    return drives, bench.measure(drives), truth


def test_a_measurement_is_a_recording(paper):
    drives, recording, _ = paper
    assert isinstance(recording, Recording)
    assert recording.response_origin == "run"
    assert recording.response_unit == "GHz"
    assert recording.provenance["bench"] == "simulated"
    starts = [run.drive.start_s for run in recording.runs]
    assert starts[0] > 0
    assert np.all(np.diff(starts) > [1.0 / d.rate for d in drives[:-1]])
    for drive, run in zip(drives, recording.runs, strict=True):
        np.testing.assert_array_equal(run.drive.value, drive.value)
        assert run.valid.all()


@pytest.mark.parametrize("i", range(4))
def test_table_1_without_compensation(paper, i):
    """All eight rms values within 2 %, from fringes alone."""
    up, down = linearity(paper[1].runs[i]).rms_ghz
    assert abs(up / UP[i] - 1) < 0.02
    assert abs(down / DOWN[i] - 1) < 0.02


@pytest.mark.parametrize("i", range(4))
def test_readings_are_right_to_a_code_of_the_generator(paper, i):
    """One code of 14 bits over 4.5 V is 4 to 8 MHz of the laser's frequency."""
    error = paper[1].runs[i].response - paper[2][i]
    error -= error.mean()
    assert error.std() < 3e-3
    assert np.abs(error).max() < 10e-3


@pytest.mark.parametrize("latency", LATENCIES)
def test_latency_is_recovered(latency):
    """Within three standard errors: the reading has not hidden it."""
    bench = SimulatedBench.like_paper(seed=1, latency_s=latency)
    drive = paper_drives()[3]
    found, stderr = read_fringes(bench.fringes(drive), drive).latency(drive)
    assert abs(found - latency) < 3 * stderr
    assert stderr < 1e-6
