"""Model files that are damaged, foreign or missing, and data that a model is not for."""

import hashlib
import json
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import pytest
from bad_input import data, head, put
from command_output import assert_failure, assert_one_line

from rapi_jax.io import read_model, write_model

NAN = float("nan")


def flip(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


def signed(change: Callable[[dict], object]) -> Callable[[bytes], bytes]:
    """Change the header of a model file, and make its checksum right again."""

    def damage(content: bytes) -> bytes:
        line, _, rest = content.rstrip(b"\n").rpartition(b"\n")[0].partition(b"\n")
        header = json.loads(line)
        change(header)
        body = json.dumps(header).encode() + b"\n" + rest
        return body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n"

    return damage


MODELS = {
    "one bit flipped": (flip, ("checksum", "Copy it again")),
    "cut short": (lambda c: c[: len(c) // 2], ("checksum",)),
    "of no bytes": (lambda c: b"", ("not a model file",)),
    "text": (lambda c: b"not a model", ("not a model file",)),
    "a pickle": (lambda c: b"\x80\x04K\x01.", ("not a model file",)),
    "a later schema": (
        signed(lambda h: h.update(schema="rapi.model-file/9")),
        ("rapi.model-file/9",),
    ),
    "another operator": (
        signed(lambda h: h["operator"].update({"class": "Preisach"})),
        ("Preisach", "newer version"),
    ),
    "another effect": (
        signed(lambda h: h.update(effects=[{"class": "os", "shapes": {}}])),
        ("effect os",),
    ),
    "leaves that do not fit": (
        signed(lambda h: h["operator"]["shapes"].update(lam=[3])),
        ("not a model this version reads",),
    ),
    "leaves too large": (signed(lambda h: h["operator"]["shapes"].update(d=[10**9])), ("million",)),
    "no operator": (
        signed(lambda h: h.pop("operator")),
        ("not a model this version reads", "operator"),
    ),
}


@pytest.mark.fault(
    name="a model file that is damaged, hostile or of another version", promise="exit 3, one line"
)
@pytest.mark.parametrize("name", MODELS)
def test_model(name, rapi, fitted, tmp_path):
    damage, words = MODELS[name]
    path = tmp_path / "model.rapi"
    path.write_bytes(damage((fitted / "model.rapi").read_bytes()))
    for given in (path, tmp_path):
        code, out, err = rapi("predict", given, fitted / "recording", "-o", tmp_path / "o")
        assert (code, out) == (3, "") and not (tmp_path / "o").exists()
        assert_one_line(err, str(path), *words)


@pytest.mark.fault(name="NaN in a model file", promise="exit 3, one line")
@pytest.mark.parametrize("value", [NAN, float("inf")])
def test_a_parameter_that_is_not_finite_is_refused_when_the_model_is_read(
    value, rapi, fitted, tmp_path
):
    ecdl, about = read_model(fitted / "model.rapi")
    spoilt = eqx.tree_at(lambda e: e.operator.zeta, ecdl, jnp.asarray(value))
    write_model(tmp_path / "model.rapi", spoilt, **about)
    code, out, err = rapi("predict", tmp_path, fitted / "recording", "-o", tmp_path / "o")
    assert (code, out) == (3, "") and not (tmp_path / "o").exists()
    assert_one_line(err, "model.rapi", "parameter `zeta` of RAPI is not finite")


def test_no_model(rapi, fitted, tmp_path):
    for place in (tmp_path, tmp_path / "nowhere", fitted / "recording"):
        code, _, err = rapi("predict", place, fitted / "recording", "-o", tmp_path / "o")
        assert code == 3
        assert_one_line(err, "no such model", "`rapi fit` wrote")
        assert ("exchanged?" in err) == (place == fitted / "recording")


def test_model_and_recording_exchanged(rapi, fitted, tmp_path):
    code, _, err = rapi("check", fitted)
    assert code == 3
    assert_one_line(err, "holds a model, model.rapi", "exchanged?", "netCDF")


@pytest.mark.fault(name="a model of another unit than the recording", promise="exit 3, one line")
def test_model_of_another_unit(rapi, fitted, tmp_path):
    for key, unit in (("response_unit", "um"), ("drive_unit", "um")):
        data(head(**{key: unit}))(tmp_path / key)
        code, _, err = rapi("predict", fitted, tmp_path / key, "-o", tmp_path / "o")
        assert code == 3
        assert_one_line(err, f"{key} is", unit, "Use a model identified in the same unit")


def test_predict_refuses_bad_data_and_masks_on_request(rapi, fitted, tmp_path):
    data(put(1, 2, 57, NAN))(tmp_path / "r")
    arguments = ("predict", fitted, tmp_path / "r", "-o", tmp_path / "o", "--no-plots", "--json")
    code, out, err = rapi(*arguments)
    assert code == 3
    assert_failure(out, 3)
    assert_one_line(err, "run01.csv", "sample 57")
    code, out, err = rapi(*arguments, "--nan", "mask")
    report = json.loads(out)
    assert (code, err, report["schema"]) == (0, "", "rapi.prediction/1")
    assert report["runs"][1]["samples"] == 199 and report["runs"][1]["rmse_fraction"] < 1e-3
