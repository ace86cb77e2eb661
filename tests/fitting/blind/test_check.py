"""The withheld-effect check from end to end: made, diagnosed blindfolded, closed, revealed, scored.

One run of the commands, in one test, so that one process makes it. What is expected of a bank this
small is wide.
"""

import json
import math
import shutil

import pytest

from fitting.blind.protocol._answers import matches_commitment
from fitting.blind.protocol._folder import BankFolder
from fitting.cli import app
from fitting.commands.run import run


def rapi(*arguments):
    return run(app, ["blind", *map(str, arguments)])


def scored_bank(root, tier, count, seed):
    """A bank that was made and scored."""
    assert rapi("make", root, "--tier", tier, "--count", count, "--seed", seed) == 0
    assert rapi("predict", root, "--no-baselines") == 0
    assert rapi("score", root, "--follow", 1) == 0
    return BankFolder(root)


def answers_and_predictions(bank):
    """Of each device."""
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


def every_recording_has_a_prediction(pairs):
    assert [prediction.get("error") for _, prediction in pairs] == [None] * len(pairs)
    for answer, prediction in pairs:
        assert prediction["name"] == answer["name"]
        assert prediction["recording_sha256"] == answer["recording_sha256"]
        probabilities = [h["probability"] for h in prediction["diagnosis"]["hypotheses"]]
        assert math.isclose(sum(probabilities), 1.0, abs_tol=1e-3)


def no_diagnosis_reached_for_an_answer(pairs):
    assert [prediction["refused"] for _, prediction in pairs] == [[]] * len(pairs)


def commitments_hold(bank, pairs):
    for answer, _ in pairs:
        name = answer["name"]
        content = (bank.answers / f"{name}.json").read_bytes()
        salt = (bank.answers / f"{name}.salt").read_bytes()
        assert matches_commitment(bank.manifest["commitments"][name], content, salt)


def nulls_are_left_alone(pairs):
    said = [verdict(p)["name"] for a, p in pairs if not a["truth"]]
    assert len(said) >= len(pairs) / 6
    assert set(said) == {"none"}


def the_scores_are_written(bank):
    scores = json.loads(bank.scores.read_text())
    assert scores["schema"] == "rapi.blind-scores/1"
    assert scores["bank"]["count"] == len(bank.entries)
    assert scores["secret"] == bank.secret.read_bytes().hex()
    assert "|" in (bank.root / "scores.md").read_text()
    assert (bank.root / "failures.csv").read_text().startswith("name")


def effects_of_two_sigma_are_seen_and_most_named(pairs):
    """In any session: also of one amplitude, where an effect of amplitude has no size."""
    large = [(a, p) for a, p in pairs if a["truth"] and min(a["size"], *a["alone"]) >= 2]
    seen = [verdict(p)["name"] != "none" for _, p in large]
    named = [right(a) in verdict(p)["set"] for a, p in large]
    assert len(large) >= len(pairs) / 3
    assert sum(seen) >= 0.9 * len(large) and sum(named) >= 0.7 * len(large)


def the_same_is_said_without_answers(bank, first, other):
    other.answers.mkdir(parents=True)
    shutil.copy(bank.bank, other.bank)
    shutil.copytree(bank.recordings, other.recordings)
    assert rapi("predict", other.root, "--limit", 1, "--no-baselines") == 0
    again = json.loads((other.predictions / f"{bank.entries[0][0]}.json").read_text())
    assert verdict(again)["name"] == verdict(first)["name"]
    assert verdict(again)["set"] == verdict(first)["set"]
    assert math.isclose(verdict(again)["probability"], verdict(first)["probability"], rel_tol=1e-6)


# Two without an effect, of which one has base misfit; and a device of each kind.
@pytest.mark.bank
@pytest.mark.parametrize(("tier", "count", "seed"), [("nulls", 2, 3), ("sessions", 6, 16)])
def test_a_bank_from_end_to_end(tier, count, seed, tmp_path):
    bank = scored_bank(tmp_path / "bank", tier, count, seed)
    pairs = answers_and_predictions(bank)
    every_recording_has_a_prediction(pairs)
    no_diagnosis_reached_for_an_answer(pairs)
    commitments_hold(bank, pairs)
    nulls_are_left_alone(pairs)
    if tier != "nulls":
        effects_of_two_sigma_are_seen_and_most_named(pairs)
    the_scores_are_written(bank)
    the_same_is_said_without_answers(bank, pairs[0][1], BankFolder(tmp_path / "without"))
