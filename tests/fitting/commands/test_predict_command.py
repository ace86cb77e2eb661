"""`rapi predict` of a drive without a response; drives open in xarray."""

import json

import numpy as np
import pytest
import xarray as xr

from fitting.cli import app
from fitting.commands.run import run
from rapi_jax import ECDL, Recording, predict, triangle
from rapi_jax.examples import paper_device
from rapi_jax.io import read_recording, write_drive, write_model, write_recording

ABOUT = {
    "response_unit": "GHz", "drive_unit": "V", "response_origin": "session",
    "response_lag_s": 0.0, "trusted": True,
}  # fmt: skip


def test_a_drive_alone(tmp_path, capsys):
    device = paper_device()
    (drive,) = triangle([20.0], amplitude=4.0, bias=3.0, samples=400)
    write_drive(drive, tmp_path / "drive.csv")
    write_model(tmp_path / "model.rapi", device, **ABOUT)
    arguments = ["predict", str(tmp_path / "model.rapi"), str(tmp_path / "drive.csv")]
    assert run(app, [*arguments, "-o", str(tmp_path / "out"), "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["runs"]
    assert row["rmse"] is None and row["excitation_hz"] == pytest.approx(20.0)
    table = np.genfromtxt(tmp_path / "out" / "drive.csv", delimiter=",", names=True)
    assert np.isnan(table["response"]).all()
    expected = np.asarray(predict(ECDL(device.operator), drive))
    np.testing.assert_allclose(table["predicted"], expected, atol=1e-9)
    assert (tmp_path / "out" / "predictions.png").is_file()
    assert run(app, [*arguments, "-o", str(tmp_path / "out"), "--no-plots"]) == 0
    text = capsys.readouterr().out
    assert "nothing was measured" in text and "span (GHz)" in text and "rmse" not in text
    assert f"{np.ptp(expected):.4g}" in text


def test_one_run_as_netcdf_opens_in_xarray_and_is_read_as_before(tmp_path):
    (drive,) = triangle([20.0], amplitude=4.0, bias=3.0, samples=400)
    one = Recording.of([drive], [drive.value * 18.0])
    write_recording(one, tmp_path / "drive.nc")
    with xr.open_dataset(tmp_path / "drive.nc", engine="h5netcdf") as seen:
        np.testing.assert_array_equal(seen.drive, drive.value)
        assert seen.response.attrs["units"] == "GHz" and seen.time_s.attrs["units"] == "s"
    assert read_recording(tmp_path / "drive.nc").sha256() == one.sha256()
