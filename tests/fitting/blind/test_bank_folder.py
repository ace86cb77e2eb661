"""Banks on disk: what they hold, going on where the making stopped, and what is refused."""

import dataclasses
import hashlib
import json
import re
import shutil
import stat
import tomllib

import numpy as np
import pytest

from fitting.blind.protocol._answers import read_answer, read_spec
from fitting.blind.protocol._exchange import to_recording, write_verified
from fitting.blind.protocol._folder import BankFolder
from fitting.blind.protocol._make import make_bank
from fitting.blind.protocol._tiers import TIERS, bank_entries
from fitting.blind.simulator.effects._kinds import LISTED
from rapi_jax import DataError
from rapi_jax.io import OutputError, read_recording


def contents(folder):
    return {
        p.relative_to(folder.root).as_posix(): p.read_bytes()
        for p in folder.root.rglob("*")
        if p.is_file()
    }


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_every_number_of_a_world_comes_back(made_once):
    name, withheld = made_once.entries[0]
    value, _ = read_answer(made_once, name)
    world = read_spec(value).draw()
    recording = read_recording(made_once.recordings / name)
    assert (world.name, withheld) == (name, None)
    assert (recording.response_unit, recording.drive_unit) == ("GHz", "V")
    for run, there in zip(world.runs, recording.runs, strict=True):
        np.testing.assert_array_equal(there.drive.time, run.time_s)
        np.testing.assert_array_equal(there.drive.value, run.drive)
        np.testing.assert_array_equal(there.response, run.response)
        assert there.drive.excitation_hz == run.excitation_hz
        assert (there.drive.waveform, there.drive.start_s) == (run.waveform, run.start_s)


def test_a_bank_says_what_it_holds_and_hides_what_it_withholds(made_once):
    about = json.loads(made_once.bank.read_text())
    names = [entry["name"] for entry in about["recordings"]]
    assert (about["schema"], about["tier"], about["count"]) == ("rapi.blind/1", "nulls", 3)
    assert sorted(about["commitments"]) == sorted(names)
    assert about["seed_sha256"] == hashlib.sha256(b"3").hexdigest()
    secret = made_once.secret.read_bytes()
    assert about["secret_sha256"] == hashlib.sha256(secret).hexdigest() and len(secret) == 32
    assert (mode(made_once.answers), mode(made_once.secret)) == (0o700, 0o600)
    assert {p.name for p in made_once.root.iterdir()} == {"bank.json", "answers", "recordings"}


def test_a_recording_tells_nothing_of_its_answer(tmp_path):
    folder = BankFolder(tmp_path / "bank")
    make_bank(folder, "withheld", count=1)
    ((name, withheld),) = folder.entries
    value, _ = read_answer(folder, name)
    assert value["truth"] == [withheld] and value["kind"] == "listed" and 3.9 < value["size"] < 21
    manifest = tomllib.loads((folder.recordings / name / "manifest.toml").read_text())
    assert set(manifest) == {"schema", "response_unit", "drive_unit", "response_origin",
                             "response_lag_s", "run"}  # fmt: skip
    known = {"file", "excitation_hz", "waveform", "start_s", "samples"}
    assert {key for run in manifest["run"] for key in run} == known
    files = [p.name for p in (folder.recordings / name).iterdir()]
    assert all(re.fullmatch(r"run\d\d\.csv|manifest\.toml", file) for file in files)


@pytest.mark.parametrize("tier", TIERS)
def test_tiers_hold_distinct_worlds_and_the_same_ones_each_time(tier):
    drawn = bank_entries(tier, 5, 60)
    assert drawn == bank_entries(tier, 5, 60) != bank_entries(tier, 6, 60)
    assert len({entry.name for entry in drawn}) == len(drawn) == 60
    if tier == "nulls":
        assert {(e.spec.kind, e.spec.effect, e.spec.sigma) for e in drawn} == {("null", "", 0.0)}
        assert sum(e.spec.base_misfit for e in drawn) == 30
    if tier == "withheld":
        named = [entry.withheld for entry in drawn]
        assert named == [entry.spec.effect for entry in drawn]
        assert all(named.count(effect) == 4 for effect in LISTED)
        assert all(4 <= entry.spec.sigma <= 20 for entry in drawn)
    else:
        assert {entry.withheld for entry in drawn} == {None}


def test_going_on_gives_the_same_bytes(made_once, tmp_path):
    folder = BankFolder(tmp_path / "bank")
    folder.answers.mkdir(parents=True)
    shutil.copy(made_once.secret, folder.secret)

    def stop(done, total, name):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_bank(folder, "nulls", count=3, progress=stop)
    assert not folder.bank.exists() and len(list(folder.recordings.iterdir())) == 2
    there = {path: path.stat().st_mtime_ns for path in folder.recordings.rglob("*.csv")}
    last = max(folder.answers.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)
    last.unlink()  # as if stopped between a recording and its answer
    make_bank(folder, "nulls", count=3)
    assert contents(folder) == contents(made_once)
    assert all(path.stat().st_mtime_ns == then for path, then in there.items())
    before = contents(folder)
    assert make_bank(folder, "nulls", count=3) == made_once.manifest
    assert contents(folder) == before


def change(path):
    content = bytearray(path.read_bytes())
    at = content.index(b"1") if b"1" in content else 0
    content[at] = ord("2") if b"1" in content else content[at] ^ 1
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("end", [".json", ".salt"])
def test_a_changed_answer_is_refused(nulls, end):
    nulls.bank.unlink()
    change(nulls.answers / f"{nulls_name(nulls)}{end}")
    with pytest.raises(DataError, match=nulls_name(nulls)):
        make_bank(nulls, "nulls", count=3)


def nulls_name(folder):
    return sorted(path.name for path in folder.recordings.iterdir())[0]


def test_a_changed_recording_is_refused(nulls):
    path = nulls.recordings / nulls_name(nulls) / "run00.csv"
    text = path.read_text().split("\n")
    text[5] = ",".join([*text[5].split(",")[:2], "0.125"])
    path.write_text("\n".join(text))
    with pytest.raises(DataError, match="were changed|was changed|one of them"):
        make_bank(nulls, "nulls", count=3)
    (nulls.answers / f"{nulls_name(nulls)}.json").unlink()  # the recording alone
    with pytest.raises(DataError, match="another recording than its device's"):
        make_bank(nulls, "nulls", count=3)


def test_changed_commitments_are_refused(nulls):
    about = json.loads(nulls.bank.read_text())
    about["commitments"][nulls_name(nulls)] = "0" * 64
    nulls.bank.write_text(json.dumps(about))
    with pytest.raises(DataError, match="commitments"):
        make_bank(BankFolder(nulls.root), "nulls", count=3)


@pytest.mark.parametrize("place", [".", "recordings", "answers"])
def test_a_foreign_file_is_refused(nulls, place):
    (nulls.root / place / "thesis.tex").write_text("mine")
    before = contents(nulls)
    with pytest.raises(OutputError, match=r"thesis\.tex"):
        make_bank(nulls, "nulls", count=3)
    assert contents(nulls) == before


@pytest.mark.parametrize(
    ("tier", "options"),
    [("nulls", {"count": 2}), ("nulls", {"seed": 9}), ("open", {}), ("withheld", {})],
)
def test_a_bank_of_another_kind_is_refused(nulls, tier, options):
    before = contents(nulls)
    with pytest.raises(OutputError, match="another"):
        make_bank(nulls, tier, **{"count": 3, **options})
    assert contents(nulls) == before


def test_where_no_folder_can_be(tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "bank"):
        with pytest.raises(OutputError, match="file"):
            make_bank(BankFolder(place), "nulls", count=1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "no bank.json"),
        ("{", "not valid JSON"),
        ("[1]", "no JSON object"),
        ('{"schema": "rapi.blind/9"}', "rapi.blind/9"),
        ('{"schema": "rapi.blind/1", "count": 1}', "do not agree"),
    ],
)
def test_a_damaged_bank_json(tmp_path, text, words):
    if text is not None:
        (tmp_path / "bank.json").write_text(text)
    with pytest.raises(DataError, match=re.escape(words)) as caught:
        BankFolder(tmp_path).manifest  # noqa: B018
    assert str(tmp_path) in str(caught.value) and "\n" not in str(caught.value)


def test_steps_have_no_rate(tmp_path, made_once):
    value, _ = read_answer(made_once, made_once.entries[0][0])
    run = read_spec(value).draw().runs[0]
    recording = to_recording([dataclasses.replace(run, waveform="step")])
    write_verified(recording, tmp_path / "step")
    assert read_recording(tmp_path / "step").runs[0].drive.excitation_hz is None
