"""Model files that were changed by others, with a checksum that is right again."""

import hashlib
import io
import json

import equinox as eqx
import numpy as np
import pytest

from rapi_jax import ECDL, DataError
from rapi_jax.effects import Saturation
from rapi_jax.examples import paper_device
from rapi_jax.io import read_model, write_model


@pytest.fixture
def path(tmp_path):
    write_model(tmp_path / "model.rapi", paper_device(), response_unit="GHz")
    return tmp_path / "model.rapi"


def sign(path, body):
    path.write_bytes(body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n")


def body_of(path):
    return path.read_bytes().rstrip(b"\n").rpartition(b"\n")[0]


@pytest.mark.fault(name="one byte of a model file changed", promise="refused: its checksum")
@pytest.mark.parametrize("at", [10, 300, -70, -10])
def test_one_byte_changed_does_not_match_the_checksum(path, at):
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)
    with pytest.raises(DataError, match="its checksum does not match"):
        read_model(path)


@pytest.mark.fault(name="a parameter of a model file that is not finite", promise="refused by name")
@pytest.mark.parametrize("name", ["alpha", "lam", "d"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_parameter_that_is_not_finite_is_refused_by_name(path, name, value):
    ecdl = paper_device()
    wrong = np.full_like(np.asarray(getattr(ecdl.operator, name)), value)
    ecdl = eqx.tree_at(lambda e: getattr(e.operator, name), ecdl, wrong)
    leaves = io.BytesIO()
    eqx.tree_serialise_leaves(leaves, ecdl)
    sign(path, body_of(path).partition(b"\n")[0] + b"\n" + leaves.getvalue())
    with pytest.raises(DataError, match=f"`{name}(_1)?` of RAPI is not finite"):
        read_model(path)


def test_a_parameter_is_infinite_only_where_it_is_by_default(path):
    """A saturation on one side alone."""
    write_model(path, ECDL(paper_device().operator, (Saturation(high=4.0),)))
    effect = read_model(path)[0].effects[0]
    assert isinstance(effect, Saturation)
    assert np.isneginf(np.asarray(effect.low)) and float(effect.high) == 4.0


@pytest.mark.fault(name="a header of a model file that is another's", promise="refused in one line")
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": "rapi.model-file/9"}, "this reads rapi.model-file/1"),
        ({"operator": {"class": "os.system", "plays": 1, "shapes": {}}}, "is not known"),
        ({"operator": {"class": "RAPI", "plays": 1, "shapes": {"d": [2000000]}}}, "a million"),
        ({"about": []}, "`about` must be an object"),
        ({"effects": None}, "not a model this version reads"),
    ],
)
def test_a_header_that_is_not_ours_is_refused(path, change, words):
    line, _, leaves = body_of(path).partition(b"\n")
    sign(path, json.dumps(json.loads(line) | change).encode() + b"\n" + leaves)
    with pytest.raises(DataError, match=words) as caught:
        read_model(path)
    assert str(caught.value).isprintable()
