"""`rapi blind`: what it writes, exit codes, one-line errors; sealed banks are used once."""

import hashlib
import json
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from fitting.blind.prediction import _follow_up as _follow
from fitting.blind.prediction import _predict, _predictions
from fitting.blind.protocol import _make, _sealed
from fitting.blind.protocol._answers import read_answer, read_spec
from fitting.blind.protocol._folder import BankFolder
from fitting.blind.protocol._frozen import tree_sha256
from fitting.blind.protocol._tiers import bank_entries
from fitting.blind.scoring import _score_bank
from fitting.cli import app
from fitting.commands.run import run

ROOT = Path(__file__).resolve().parents[3]
ONE = ("--follow", 1)  # one device measured once more is enough here


@pytest.fixture
def rapi(capfd):
    """`rapi blind` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, ["blind", *map(str, arguments)])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


def assert_one_line(said: tuple[int, str, str], code: int, *words: str) -> None:
    """The exit code, nothing on standard output, one line with all words and no traceback."""
    assert said[:2] == (code, "")
    text = said[2]
    assert text.endswith("\n") and text.count("\n") == 1, text
    assert text[:-1].isprintable() and "Traceback" not in text and "internal error" not in text
    assert [word for word in words if word not in text] == [], text


def test_make(rapi, tmp_path):
    code, out, err = rapi("make", tmp_path / "bank", "--tier", "nulls", "--count", 1, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((tmp_path / "bank" / "bank.json").read_text())
    code, out, err = rapi("make", tmp_path / "bank", "--tier", "nulls", "--count", 1)
    assert (code, err) == (0, "") and "1 recording of tier nulls" in out.replace("\n", " ")
    said = rapi("make", tmp_path / "bank", "--tier", "nulls", "--count", 2)
    assert_one_line(said, 3, str(tmp_path / "bank"), "another")


def test_make_of_effects_that_were_unseen_once(rapi, tmp_path):
    code, out, _ = rapi("make", tmp_path / "bank", "--tier", "seen", "--count", 1, "--json")
    assert code == 0 and json.loads(out)["tier"] == "seen"
    _, out, _ = rapi("make", "--help")
    assert "once unseen, for development" in " ".join(out.replace("│", " ").split())


@pytest.mark.parametrize(
    "arguments",
    [
        ("make",),
        ("make", "BANK", "--tier", "shut"),
        ("make", "BANK", "--count", "0"),
        ("make", "BANK", "--seed", "-1"),
        ("predict", "BANK", "--workers", "0"),
        ("predict", "BANK", "--limit", "0"),
        ("score",),
        ("reveal", "BANK"),
    ],
)
def test_usage(rapi, arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert_one_line(rapi(*arguments), 2, "usage", "--help")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["predict", "score"])
def test_no_bank(rapi, command, tmp_path):
    assert_one_line(rapi(command, tmp_path), 3, str(tmp_path), "no bank.json", "rapi blind make")


def test_where_nothing_can_be_written(rapi, tmp_path):
    (tmp_path / "file").write_text("")
    said = rapi("make", tmp_path / "file" / "bank", "--tier", "nulls", "--count", 1)
    assert_one_line(said, 3, "file")
    assert_one_line(rapi("commit", tmp_path / "file"), 3, "not a folder")


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from fitting.commands.run import run; from fitting.cli import app;"
        "run(app, ['blind', '--help']); run(app, ['blind', 'score', '--help']);"
        "print([m for m in ('jax', 'numpy', 'rapi_jax', 'fitting.blind') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip().endswith("[]") and "BANK" in done.stdout, done.stderr


def test_predict_goes_on(rapi, nulls, at_once):
    names = [name for name, _ in nulls.entries]
    code, out, err = rapi("predict", nulls.root, "--limit", 2, "--json")
    assert (code, err) == (0, "") and at_once == names[:2]
    assert json.loads(out) == {
        "schema": "rapi.blind-progress/1", "predictions": 2, "kept": 0, "new": 2, "raised": 0,
    }  # fmt: skip
    first = nulls.predictions / f"{names[0]}.json"
    written = first.stat().st_mtime_ns
    code, out, err = rapi("predict", nulls.root)
    assert (code, err) == (0, "") and at_once == names and "1 of them new" in out
    assert first.stat().st_mtime_ns == written
    said = json.loads(first.read_text())
    assert said["diagnosis"]["verdict"]["name"] == "creep" and "maps" not in said["diagnosis"]
    assert set(said["files"]) == {"model.rapi", "base.rapi", "next_drive.csv"}
    assert said["refused"] == []


@pytest.mark.parametrize("what", ["foreign", "edited", "model", "of other code", "cut short"])
def test_predictions_that_are_not_ours_are_refused(rapi, nulls, at_once, what):
    name = nulls.entries[0][0]
    assert rapi("predict", nulls.root, "--limit", 1)[0] == 0
    path = nulls.predictions / f"{name}.json"
    said = json.loads(path.read_text())
    if what == "foreign":
        (nulls.predictions / "thesis.tex").write_text("mine")
    elif what == "edited":
        path.write_text(json.dumps(said | {"name": "world-1"}))
    elif what == "model":
        (nulls.predictions / name / "model.rapi").write_bytes(b"other")
    elif what == "of other code":
        path.write_text(json.dumps(said | {"tree_sha256": "0" * 64}))
    else:
        path.write_bytes(path.read_bytes()[:100])
    assert_one_line(rapi("predict", nulls.root), 3, str(nulls.predictions))
    assert at_once == [name]


def test_a_diagnosis_that_raises_is_a_prediction(rapi, nulls, at_once, monkeypatch):
    def raises(recording, candidates, scan):
        raise ZeroDivisionError("in\nhere")

    monkeypatch.setattr(_predict, "_diagnose", raises)
    code, out, _ = rapi("predict", nulls.root, "--json")
    assert code == 0 and json.loads(out)["raised"] == 3
    said = json.loads((nulls.predictions / f"{nulls.entries[0][0]}.json").read_text())
    assert said["error"] == "ZeroDivisionError: in here" and "diagnosis" not in said


def test_an_interrupt_leaves_whole_predictions(rapi, nulls, at_once, monkeypatch):
    ours = _predictions.predict_in_workers

    def stopped(jobs, answers, workers, *, compiled):
        for done, name in enumerate(ours(jobs, answers, workers, compiled=compiled)):
            if done == 1:
                raise KeyboardInterrupt
            yield name

    monkeypatch.setattr(_predictions, "predict_in_workers", stopped)
    assert_one_line(rapi("predict", nulls.root), 130, "interrupted")
    monkeypatch.setattr(_predictions, "predict_in_workers", ours)
    code, out, _ = rapi("predict", nulls.root, "--json")
    assert code == 0 and json.loads(out)["kept"] == 2


def test_score_reveals_what_was_closed(rapi, nulls, at_once, scoring):
    names = [name for name, _ in nulls.entries]
    code, out, err = rapi("score", nulls.root, *ONE)
    assert (code, err) == (0, "") and out.startswith("3 worlds\n")
    assert at_once == [*names, names[0], names[0]]  # and two second sessions
    closed = json.loads(nulls.closed.read_text())
    assert (closed["schema"], sorted(closed["sha256"])) == (
        "rapi.blind-predictions/1",
        sorted(names),
    )
    for name in names:
        content = (nulls.predictions / f"{name}.json").read_bytes()
        assert closed["sha256"][name] == hashlib.sha256(content).hexdigest()
    for (value, said, folder), name in zip(scoring["entries"], names, strict=True):
        assert value["name"] == said["name"] == folder.name == name
        assert scoring["draw"](value).name == name and (folder / "model.rapi").exists()
    ((value, first, advised, random),) = scoring["follow"]
    assert value["name"] == first["name"] == advised["name"] == random["name"] == names[0]
    hashes = {said["recording_sha256"] for said in (first, advised, random)}
    assert len(hashes) == 3
    scores = json.loads((nulls.root / "scores.json").read_text())
    assert scores["secret"] == nulls.secret.read_bytes().hex() and scores["n"] == 3
    assert (nulls.root / "scores.md").read_text() == "3 worlds\n"
    assert (nulls.root / "failures.csv").read_text() == "name,set\nworld-1,a b\n"
    assert_one_line(rapi("predict", nulls.root), 3, "closed")
    before = nulls.closed.read_bytes(), nulls.scores.read_bytes()
    code, out, err = rapi("score", nulls.root, *ONE, "--json")
    assert (code, err) == (0, "") and json.loads(out) == scores
    assert (nulls.closed.read_bytes(), nulls.scores.read_bytes()) == before
    assert len(at_once) == 5


@pytest.mark.parametrize("what", ["answer", "salt", "prediction", "recording"])
def test_nothing_is_scored_after_a_change(rapi, nulls, at_once, scoring, what):
    name = nulls.entries[1][0]
    if what == "recording":  # before it is diagnosed; answers are not looked at until the reveal
        path = nulls.recordings / name / "manifest.toml"
        path.write_text(path.read_text().replace('waveform = "triangle"', 'waveform = "other"'))
    else:
        assert rapi("score", nulls.root, *ONE)[0] == 0
        nulls.scores.unlink()
        scoring.clear()
        path = {
            "answer": nulls.answers / f"{name}.json",
            "salt": nulls.answers / f"{name}.salt",
            "prediction": nulls.predictions / f"{name}.json",
        }[what]
        content = bytearray(path.read_bytes())
        content[-3] ^= 1
        path.write_bytes(bytes(content))
    assert_one_line(rapi("score", nulls.root, *ONE), 3, name)
    assert scoring == {} and not nulls.scores.exists()


def test_the_answers_are_out_of_reach_meanwhile(rapi, nulls, at_once, scoring, monkeypatch):
    """Nothing of them is read before the predictions are closed."""
    read = []

    def watched(folder, name):
        read.append(folder.closed.exists())
        return read_answer(folder, name)

    for module in (_make, _follow):
        monkeypatch.setattr(module, "read_answer", watched)
    revealed = _score_bank.reveal
    monkeypatch.setattr(
        _score_bank,
        "reveal",
        lambda folder: read.append(folder.closed.exists()) or revealed(folder),
    )
    assert rapi("score", nulls.root, *ONE)[0] == 0
    assert read and all(read)


def test_sealed(rapi, tmp_path, at_once, scoring, monkeypatch):
    bank = tmp_path / "bank"
    folder = BankFolder(bank)
    said = rapi("make", bank, "--tier", "sealed", "--count", 2)
    assert_one_line(said, 3, "rapi blind commit")
    assert not bank.exists()

    code, out, err = rapi("commit", bank)
    secret = folder.secret.read_bytes()
    assert (code, err, out.strip()) == (0, "", hashlib.sha256(secret).hexdigest())
    assert json.loads(folder.commitment.read_text())["secret_sha256"] == out.strip()
    assert len(secret) == 32 and stat.S_IMODE(folder.secret.stat().st_mode) == 0o600
    assert stat.S_IMODE(folder.answers.stat().st_mode) == 0o700
    assert_one_line(rapi("commit", bank), 3, str(bank), "committed")
    assert folder.secret.read_bytes() == secret
    assert_one_line(rapi("make", bank, "--tier", "sealed", "--seed", 1), 3, "--seed")
    assert_one_line(rapi("make", bank, "--tier", "nulls"), 3, "sealed")

    # The worlds are those that the frozen tree and the secret give, and no others.
    assert rapi("make", bank, "--tier", "sealed", "--count", 2)[0] == 0
    tree = tree_sha256()
    seed = int(hashlib.sha256(bytes.fromhex(tree) + secret).hexdigest(), 16)
    folder = BankFolder(bank)
    specs = [read_spec(read_answer(folder, name)[0]) for name, _ in folder.entries]
    assert specs == [entry.spec for entry in bank_entries("sealed", seed, 2)]
    assert folder.manifest["tree_sha256"] == tree
    assert folder.manifest["secret_sha256"] == hashlib.sha256(secret).hexdigest()

    # Other code is refused before predictions are closed, and may reveal after.
    with monkeypatch.context() as other:
        for module in (_sealed, _predictions, _score_bank, _follow, _make):
            other.setattr(module, "tree_sha256", lambda: "f" * 64)
        for command in ("predict", "score"):
            assert_one_line(rapi(command, bank), 3, tree[:12], "f" * 12)
        assert at_once == []
    assert rapi("score", bank, *ONE)[0] == 0
    scored = json.loads(folder.scores.read_text())
    assert scored["secret"] == secret.hex()
    count = len(at_once)
    with monkeypatch.context() as other:
        for module in (_sealed, _predictions, _score_bank, _follow, _make):
            other.setattr(module, "tree_sha256", lambda: "f" * 64)
        assert rapi("score", bank, *ONE)[0] == 0
        assert_one_line(rapi("predict", bank), 3, "used once")
    assert json.loads(folder.scores.read_text()) == scored and len(at_once) == count


@pytest.mark.parametrize("what", ["secret", "commitment", "worlds"])
def test_a_sealed_bank_of_chosen_worlds_is_not_scored(
    rapi, tmp_path, at_once, scoring, what, monkeypatch
):
    bank = tmp_path / "bank"
    folder = BankFolder(bank)
    assert rapi("commit", bank)[0] == 0
    if what == "worlds":  # as if another secret had been tried
        monkeypatch.setattr(_make, "sealed_seed", lambda tree, secret: 12345)
    assert rapi("make", bank, "--tier", "sealed", "--count", 1)[0] == 0
    if what == "secret":
        folder.secret.write_bytes(bytes(32))
    elif what == "commitment":
        folder.commitment.write_text(json.dumps({"secret_sha256": "0" * 64}))
    assert_one_line(rapi("score", bank, *ONE), 3)
    assert scoring == {} and not folder.scores.exists()
