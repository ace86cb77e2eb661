"""`rapi fit --intervals`, and the band that `rapi compensate` makes of what it wrote."""

import hashlib
import json

import pytest

from fitting.cli import app
from fitting.commands.run import run
from rapi_jax.examples import paper_recording
from rapi_jax.io import write_recording

FIT = ("--plays", 3, "--each", "none", "--starts", 2, "--no-plots")


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("intervals") / "recording.nc"
    write_recording(paper_recording(samples=240)[0], path)
    return path


def test_a_loss_without_likelihood_is_a_usage_error(recording, tmp_path, capsys):
    options = ("-o", tmp_path, "--loss", "huber", "--intervals", "profile")
    assert rapi("fit", recording, *options) == 2
    assert "--loss squares" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("method", ["profile", "posterior"])
def test_intervals_are_written_and_shown(recording, tmp_path, capsys, method):
    code = rapi("fit", recording, "-o", tmp_path / "fit", *FIT, "--intervals", method)
    shown = capsys.readouterr()
    table = json.loads((tmp_path / "fit" / "model.json").read_text())
    assert code in (0, 4) and "95 % interval" in shown.out
    found = table["intervals"]
    assert found["method"] == method and found["level"] == 0.95
    if "refused" in found:
        assert code == 4 and "no intervals" in shown.err
        return
    ends = found["parameters"]["lam"]
    value, stderr = (table["parameters"]["lam"][key] for key in ("value", "stderr"))
    assert ends["low"] < value < ends["high"]
    assert ends["high"] - ends["low"] == pytest.approx(3.92 * stderr, rel=0.5)
    if method == "posterior":
        from fitting.uncertainty.posterior._convergence import import_arviz

        path = tmp_path / "fit" / "posterior.nc"
        assert table["files"]["posterior.nc"] == hashlib.sha256(path.read_bytes()).hexdigest()
        posterior = import_arviz().from_netcdf(str(path), engine="h5netcdf")
        assert posterior.posterior.sizes == {"chain": 4, "draw": 1000}
        assert posterior.attrs["data_sha256"] == table["data_sha256"]


@pytest.mark.slow
def test_the_certificate_says_how_straight_the_scan_may_be(recording, tmp_path):
    rapi("fit", recording, "-o", tmp_path / "fit", *FIT)
    options = ("--span", 60, "--frequency", 25, "--samples", 1024, "--untrusted", "--no-plots")
    assert rapi("compensate", tmp_path / "fit", "-o", tmp_path / "out", *options) == 0
    (drive,) = json.loads((tmp_path / "out" / "certificate.json").read_text())["drives"]
    band = drive["nonlinearity_band"]
    assert band["unit"] == "GHz"
    assert band["method"] == "laplace" and band["level"] == 0.95
    for side in ("up", "down"):
        assert 0.0 < band[side]["low"] < band[side]["median"] < band[side]["high"] < 1.0
    (tmp_path / "fit" / "model.json").unlink()
    assert rapi("compensate", tmp_path / "fit", "-o", tmp_path / "bare", *options) == 0
    (drive,) = json.loads((tmp_path / "bare" / "certificate.json").read_text())["drives"]
    assert drive["nonlinearity_band"] is None
