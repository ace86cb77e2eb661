"""A small bank without effects, and diagnoses that take no time."""

import dataclasses
import shutil
from types import SimpleNamespace

import pytest

from fitting.blind.prediction import _predict, _predictions
from fitting.blind.protocol._folder import BankFolder
from fitting.blind.protocol._make import make_bank
from rapi_jax import triangle
from rapi_jax.examples import paper_device

COUNT = 3


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """A bank of nulls."""
    folder = BankFolder(tmp_path_factory.mktemp("bank") / "nulls")
    make_bank(folder, "nulls", count=COUNT)
    return folder


@pytest.fixture
def nulls(made_once, tmp_path):
    """A copy of it, to be changed."""
    shutil.copytree(made_once.root, tmp_path / "nulls")
    return BankFolder(tmp_path / "nulls")


@pytest.fixture
def at_once(monkeypatch):
    """Diagnoses in this process that say the same of every recording; the list of their names."""
    names = []
    (drive,) = triangle(100.0, amplitude=1.0, bias=3.0, samples=320, periods=4)

    def diagnosed(recording, candidates, scan):
        content = {
            "verdict": {"name": "creep", "effects": ["creep"], "set": ["creep", "drift"]},
            "next_scan": {
                "waveform": "triangle", "excitation_hz": 100.0, "amplitude": 1.0, "bias": 3.0,
            },
            "maps": "not for a prediction",
        }  # fmt: skip
        return SimpleNamespace(
            to_dict=lambda: content, recording=recording, model=paper_device(), base=paper_device(),
            verdict=SimpleNamespace(name="creep"), next_drive=drive if scan else None,
        )  # fmt: skip

    def predicted(jobs, answers, workers, *, compiled):
        for job in jobs:
            _predict.predict_one(dataclasses.replace(job, baselines=False))
            names.append(job.name)
            yield job.name

    monkeypatch.setattr(_predict, "_diagnose", diagnosed)
    monkeypatch.setattr(_predictions, "predict_in_workers", predicted)
    return names


@pytest.fixture
def scoring(monkeypatch):
    """A stand-in for the scores: what it was given, and one failure."""
    import sys

    seen = {}

    def score(entries, *, draw, follow, progress):
        seen.update(entries=entries, draw=draw, follow=follow)
        return {"n": len(entries), "failures": [{"name": "world-1", "set": ["a", "b"]}]}

    monkeypatch.setitem(sys.modules, "fitting.blind.scoring._scores", SimpleNamespace(score=score))
    markdown = SimpleNamespace(markdown=lambda scores: f"{scores['n']} worlds\n")
    monkeypatch.setitem(sys.modules, "fitting.blind.scoring.tables._table", markdown)
    return seen
