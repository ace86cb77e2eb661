"""Commitments hold for the bytes that were committed to and for no others."""

import hashlib
import hmac
import json
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import fitting.diagnosis
import rapi_jax
from fitting.blind.prediction._predict import sha256_of
from fitting.blind.prediction._predictions import close_predictions, read_closed
from fitting.blind.protocol._answers import (
    answer_bytes,
    answer_salt,
    commitment,
    matches_commitment,
    reveal,
)
from fitting.blind.protocol._folder import BankFolder
from fitting.blind.protocol._frozen import sealed_seed, tree_sha256
from rapi_jax import DataError
from rapi_jax.io import OutputError

ANSWER = {"name": "world-7", "truth": ["creep"], "size": 4.25, "alone": [4.25], "seed": 7}
SECRET = bytes(range(32))


def test_a_commitment_is_sha_256_of_answer_and_salt():
    content, salt = answer_bytes(ANSWER), answer_salt(SECRET, "world-7")
    assert json.loads(content) == ANSWER
    assert content == answer_bytes(dict(reversed(ANSWER.items())))
    assert salt == hmac.new(SECRET, b"world-7", hashlib.sha256).digest()
    assert commitment(content, salt) == hashlib.sha256(content + salt).hexdigest()
    assert salt != answer_salt(SECRET, "world-8") and matches_commitment(
        commitment(content, salt), content, salt
    )


@given(st.data(), st.integers(1, 255))
def test_any_changed_byte_of_answer_or_salt_breaks_it(data, flip):
    content, salt = answer_bytes(ANSWER), answer_salt(SECRET, "world-7")
    both = bytearray(content + salt)
    both[data.draw(st.integers(0, len(both) - 1))] ^= flip
    changed = bytes(both)
    assert not matches_commitment(
        commitment(content, salt), changed[: len(content)], changed[len(content) :]
    )


@pytest.mark.parametrize("by", [-1, 1])
def test_bytes_cannot_move_between_answer_and_salt(by):
    content, salt = answer_bytes(ANSWER), answer_salt(SECRET, "world-7")
    both, cut = content + salt, len(content) + by
    assert not matches_commitment(commitment(content, salt), both[:cut], both[cut:])
    with pytest.raises(ValueError, match="salt"):
        commitment(both[:cut], both[cut:])


@pytest.fixture(scope="module")
def bank(made_once, tmp_path_factory):
    root = tmp_path_factory.mktemp("commitments") / "bank"
    shutil.copytree(made_once.root, root)
    return BankFolder(root)


@pytest.fixture(scope="module")
def closed(tmp_path_factory):
    """A prediction with a model beside it, closed."""
    root = tmp_path_factory.mktemp("closed")
    (root / "world-7").mkdir()
    model = root / "world-7" / "model.rapi"
    model.write_bytes(b"a model of some bytes")
    said = {"name": "world-7", "files": {"model.rapi": sha256_of(model)}, "verdict": "creep"}
    (root / "world-7.json").write_text(json.dumps(said))
    close_predictions(root / "predictions.json", {"world-7": root / "world-7.json"}, "tree")
    return root


@given(st.data(), st.integers(1, 255))
def test_any_changed_byte_on_disk_stops_the_reveal(bank, data, flip):
    assert [value["kind"] for value in reveal(bank)] == ["null"] * 3
    files = sorted(path for path in bank.answers.iterdir() if path.name != "secret")
    path = data.draw(st.sampled_from(files))
    refuses_changed(path, lambda: reveal(bank), data, flip)


@given(st.data(), st.integers(1, 255))
def test_any_changed_byte_of_a_prediction_or_model_is_seen(closed, data, flip):
    files = {"world-7": closed / "world-7.json"}
    assert read_closed(closed / "predictions.json", files)["world-7"]["verdict"] == "creep"
    path = data.draw(st.sampled_from([files["world-7"], closed / "world-7" / "model.rapi"]))
    refuses_changed(path, lambda: read_closed(closed / "predictions.json", files), data, flip)


def refuses_changed(path, read, data, flip):
    whole = path.read_bytes()
    at = data.draw(st.integers(0, len(whole) - 1))
    try:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ flip]) + whole[at + 1 :])
        with pytest.raises(DataError, match=r"world-|model\.rapi"):
            read()
    finally:
        path.write_bytes(whole)


def test_predictions_are_closed_once(closed):
    before = (closed / "predictions.json").read_bytes()
    with pytest.raises(OutputError, match="closed once"):
        close_predictions(closed / "predictions.json", {"world-7": closed / "world-7.json"}, "tree")
    assert (closed / "predictions.json").read_bytes() == before


def test_a_prediction_that_is_gone_or_was_not_closed_is_seen(closed, tmp_path):
    shutil.copytree(closed, tmp_path / "copy")
    path = tmp_path / "copy" / "predictions.json"
    first = {"world-7": tmp_path / "copy" / "world-7.json"}
    with pytest.raises(DataError, match="recordings"):
        read_closed(path, first | {"world-8": first["world-7"]})
    first["world-7"].unlink()
    with pytest.raises(DataError, match=r"world-7\.json"):
        read_closed(path, first)


@pytest.fixture
def packages(tmp_path):
    """Two packages with a file that is no code."""
    for name, file, text in (
        ("one", "__init__.py", "a = 1\n"),
        ("one", "deep/b.py", "b = 2\n"),
        ("two", "c.py", ""),
        ("two", "table.toml", "no code"),
    ):
        path = tmp_path / name / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return [tmp_path / "one", tmp_path / "two"]


def test_the_trees_hash_is_of_names_and_contents(packages):
    """Against the definition, written out."""
    said = b"15 one/__init__.py 6\na = 1\n"
    said += b"13 one/deep/b.py 6\nb = 2\n" + b"8 two/c.py 0\n"
    assert tree_sha256(packages) == hashlib.sha256(said).hexdigest()


@pytest.mark.parametrize("change", ["byte", "added", "gone", "renamed", "moved"])
def test_the_trees_hash_changes_with_the_code(packages, change):
    before, path = tree_sha256(packages), packages[0] / "deep" / "b.py"
    if change == "byte":
        path.write_text("b = 3\n")
    elif change == "added":
        (packages[1] / "d.py").write_text("")
    elif change == "gone":
        (packages[1] / "c.py").unlink()
    elif change == "renamed":
        path.rename(path.with_name("c.py"))
    else:
        (packages[0] / "__init__.py").write_text("a = 1\nb = 2\n")
        path.write_text("")
    assert tree_sha256(packages) != before


def test_the_trees_hash_is_of_nothing_else(packages):
    before = tree_sha256(packages)
    (packages[1] / "table.toml").write_text("other")
    (packages[0].parent / "README.md").write_text("read me")
    (packages[0] / "note.ipynb").write_text("{}")
    assert tree_sha256(reversed(packages)) == before


def test_the_code_that_is_frozen_holds_model_and_diagnosis():
    files = (rapi_jax.__file__, fitting.diagnosis.__file__)
    model, diagnosis = (Path(file).resolve().parent for file in files)
    assert tree_sha256() == tree_sha256([model, diagnosis.parent])


@given(st.binary(min_size=32, max_size=32), st.binary(min_size=32, max_size=32), st.data())
def test_a_sealed_seed_changes_with_any_byte(tree, secret, data):
    both = bytearray(tree + secret)
    assert sealed_seed(tree.hex(), secret) == int(hashlib.sha256(both).hexdigest(), 16)
    both[data.draw(st.integers(0, 63))] ^= data.draw(st.integers(1, 255))
    other = sealed_seed(bytes(both[:32]).hex(), bytes(both[32:]))
    assert other != sealed_seed(tree.hex(), secret)
