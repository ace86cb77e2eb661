"""The withheld-effect check from end to end: made, diagnosed blindfolded, closed, revealed, scored.

One run of the commands, which several tests read. What is expected of a bank this small is wide.
"""

import json
import math
import shutil

import pytest

from fitting.blind.protocol._answers import matches_commitment
from fitting.blind.protocol._folder import BankFolder
from fitting.cli import app
from fitting.commands.run import run

SEED = 11
SMALL, LARGE = ("nulls", 3), ("open", 10)  # tier and number of devices


# What is said of a share of the devices.
only_large = pytest.mark.parametrize(
    "bank", [pytest.param(LARGE, marks=pytest.mark.bank)], indirect=True
)


def rapi(*arguments):
    return run(app, ["blind", *map(str, arguments)])


@pytest.fixture(scope="module", params=[SMALL, pytest.param(LARGE, marks=pytest.mark.bank)])
def bank(request, tmp_path_factory):
    """A bank that was made and scored."""
    root = tmp_path_factory.mktemp("check") / "bank"
    tier, count = request.param
    assert rapi("make", root, "--tier", tier, "--count", count, "--seed", SEED) == 0
    assert rapi("predict", root, "--no-baselines") == 0
    assert rapi("score", root, "--follow", count // 10) == 0
    return BankFolder(root)


@pytest.fixture(scope="module")
def pairs(bank):
    """Answer and prediction of each device."""
    return [
        tuple(
            json.loads((place / f"{name}.json").read_text())
            for place in (bank.answers, bank.predictions)
        )
        for name, _ in bank.entries
    ]


def right(answer):
    """What a diagnosis should say."""
    names = "+".join(sorted(answer["truth"])) or "none"
    return "unlisted" if names.startswith("unlisted:") else names


def verdict(prediction):
    return prediction["diagnosis"]["verdict"]


def test_every_recording_has_a_prediction(pairs):
    assert [prediction.get("error") for _, prediction in pairs] == [None] * len(pairs)
    for answer, prediction in pairs:
        assert prediction["name"] == answer["name"]
        assert prediction["recording_sha256"] == answer["recording_sha256"]
        probabilities = [h["probability"] for h in prediction["diagnosis"]["hypotheses"]]
        assert math.isclose(sum(probabilities), 1.0, abs_tol=1e-3)


def test_no_diagnosis_reached_for_an_answer(pairs):
    assert [prediction["refused"] for _, prediction in pairs] == [[]] * len(pairs)


@only_large
def test_the_answers_say_nothing_to_a_diagnosis(bank, pairs, tmp_path):
    """With no answers there at all a diagnosis says the same."""
    other = BankFolder(tmp_path / "bank")
    other.answers.mkdir(parents=True)
    shutil.copy(bank.bank, other.bank)
    shutil.copytree(bank.recordings, other.recordings)
    assert rapi("predict", other.root, "--limit", 1, "--no-baselines") == 0
    name = bank.entries[0][0]
    again = json.loads((other.predictions / f"{name}.json").read_text())
    first = pairs[0][1]
    assert verdict(again)["name"] == verdict(first)["name"]
    assert verdict(again)["set"] == verdict(first)["set"]
    assert math.isclose(verdict(again)["probability"], verdict(first)["probability"], rel_tol=1e-6)


def test_commitments_hold(bank, pairs):
    for answer, _ in pairs:
        name = answer["name"]
        content = (bank.answers / f"{name}.json").read_bytes()
        salt = (bank.answers / f"{name}.salt").read_bytes()
        assert matches_commitment(bank.manifest["commitments"][name], content, salt)


@only_large
def test_large_effects_are_seen_and_most_named(pairs):
    large = [(a, p) for a, p in pairs if a["size"] >= 4]
    seen = [verdict(p)["name"] != "none" for _, p in large]
    named = [right(a) in verdict(p)["set"] for a, p in large]
    assert len(large) >= len(pairs) / 3
    assert sum(seen) >= 0.9 * len(large) and sum(named) >= 0.7 * len(large)


def test_most_nulls_are_left_alone(pairs):
    nulls = [verdict(p)["name"] for a, p in pairs if not a["truth"]]
    assert len(nulls) >= len(pairs) / 6
    assert nulls.count("none") >= len(nulls) - 1


def test_the_scores_are_written(bank):
    scores = json.loads(bank.scores.read_text())
    assert scores["schema"] == "rapi.blind-scores/1" and scores["bank"]["count"] == len(
        bank.entries
    )
    assert scores["secret"] == bank.secret.read_bytes().hex()
    assert "|" in (bank.root / "scores.md").read_text()
    assert (bank.root / "failures.csv").read_text().startswith("name")
