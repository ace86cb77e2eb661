"""The inverse of a measured piezo, tested on scans that were never identified; data by others."""

import numpy as np
import pytest

from fitting import fit, identify_inverse
from rapi_jax import ECDL, RAPI, Drive, predict
from rapi_jax.io import read_recording

# The authors' evaluation segments (1-based, both ends in), without and with their compensation.
SEGMENTS = {"without": (5052, 6051), "with": (11152, 12151)}
AUTHORS = 0.58  # um, target against response with their compensation


@pytest.fixture(scope="module")
def found(shared_data):
    folder = shared_data / "picma_1hz"
    recording = read_recording(folder)
    forward = fit(ECDL(RAPI.guess(recording)), recording, starts=1, hold_out=False, throw=False)
    inverse = identify_inverse(recording, forward, hold_out=False, throw=False)
    run = recording.runs[0]
    um_per_v = np.ptp(run.response) / run.drive.u_pp
    table = np.genfromtxt(folder / "compensated_test.csv", delimiter=",", names=True)
    return inverse, um_per_v, table


def test_the_inverse_fits_the_identification(found):
    inverse, _, _ = found
    assert (inverse.recording.drive_unit, inverse.recording.response_unit) == ("um", "V")
    assert inverse.verdict.trusted, inverse.verdict.reasons
    assert inverse.runs[0].rmse_fraction < 0.006


@pytest.mark.parametrize("segment", SEGMENTS)
@pytest.mark.slow
def test_the_drive_is_given_back_from_the_response(found, segment):
    """Growing small loops after shrinking ones, run over the file's whole history."""
    inverse, um_per_v, table = found
    response = Drive(table["time_s"], table["response"], 1.0, "other")
    given = np.asarray(predict(inverse.ecdl, response))
    first, last = SEGMENTS[segment]
    sent = table["drive"][first - 2 : last - 1]  # the response is one sample late
    error = given[first - 1 : last] - sent
    rmse = float(np.sqrt(np.mean(error**2)))
    print(
        f"{segment}: rmse {rmse:.4f} V, {100 * rmse / np.ptp(sent):.2f} % of {np.ptp(sent):.2f} V, "
        f"as {rmse * um_per_v:.3f} um; about the mean {error.std() * um_per_v:.3f} um"
    )
    assert rmse * um_per_v < AUTHORS
