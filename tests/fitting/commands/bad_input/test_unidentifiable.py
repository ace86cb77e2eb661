"""Parameters that data cannot fix are named, and have no standard error."""

import json

import numpy as np
import pytest
from bad_input import FAST, constant, data, first_run
from command_output import assert_model

from fitting import UntrustedFit, fit
from rapi_jax import ECDL, RAPI
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording


def test_redundant_parameters_are_named(tmp_path):
    """One run fixes r (1 + eta) and b r, not their factors: all that take part are named."""
    recording = first_run()
    options = {"free": lambda e: e.operator, "starts": 2, "hold_out": False}
    with pytest.raises(UntrustedFit, match="unidentifiable") as caught:
        fit(ECDL(RAPI.guess(recording)), recording, **options)
    verdict = caught.value.result.verdict
    assert {"alpha", "zeta", "eta"} <= set(verdict.unidentifiable)
    assert not {"d_1", "d_2", "lam"} & set(verdict.unidentifiable)
    saved = caught.value.result.to_dict()
    assert saved["parameters"]["eta"]["stderr"] is None
    json.dumps(saved, allow_nan=False)


def test_dead_parameters_are_named():
    """Without a scan rate, nothing depends on `zeta`."""
    one = first_run().runs[0]
    drive = Drive(one.drive.time, one.drive.value)
    recording = Recording.of([drive], [one.response])
    options = {"starts": 2, "hold_out": False, "history": False, "throw": False}
    got = fit(ECDL(RAPI.guess(recording)), recording, free=lambda e: e.operator, **options)
    assert "zeta" in got.verdict.unidentifiable and not np.isfinite(got["zeta"].stderr)
    assert got.to_dict()["parameters"]["zeta"]["stderr"] is None


def test_constant_drive_has_no_standard_errors(rapi, tmp_path):
    data(constant(1, 3.0))(tmp_path / "r")
    code, out, _ = rapi("fit", tmp_path / "r", "-o", tmp_path / "o", "--json", *FAST)
    model = assert_model(tmp_path / "o", out)
    assert code == 4
    for name in model["verdict"]["unidentifiable"]:
        assert model["parameters"][name]["stderr"] is None
    assert {"lam", "a", "d_1"} <= set(model["verdict"]["unidentifiable"])
