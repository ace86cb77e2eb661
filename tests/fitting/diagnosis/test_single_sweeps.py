"""What a single sweep and drives without their period are told: no effect is named on them."""

import dataclasses

import numpy as np
import pytest
from diagnosis_contract import check
from edge_worlds import record

from fitting.diagnosis import diagnose
from fitting.diagnosis._data_checks import SINGLE_SWEEP, find_inconsistencies
from rapi_jax import Drive, Recording, triangle
from rapi_jax.effects import Etalon
from rapi_jax.examples import paper_device

TIME = np.arange(400) / 2000.0
SWEEP = Drive(TIME, 1.5 + 3.0 * TIME / TIME[-1])
LOOP = Drive(TIME, 4.5 - 3.0 * np.abs(2.0 * TIME / TIME[-1] - 1.0))


@pytest.mark.parametrize("drive", [SWEEP, LOOP])
def test_a_single_sweep_is_the_reason_and_no_effect_is_named(drive):
    recording = record([drive], Etalon(amplitude=0.3, spacing=20.0, phase=0.4))
    out = check(diagnose(None, recording, candidates=(Etalon,), scan=False))
    assert out["verdict"]["effects"] == []
    assert "A single sweep does not fix a model: record three periods" in out["verdict"]["sentence"]
    assert [fault["kind"] for fault in out["faults"]] == [SINGLE_SWEEP]
    assert not any(note.startswith("single sweep: single sweep") for note in out["notes"])


def kinds(recording: Recording) -> list[str]:
    return [fault.kind for fault in find_inconsistencies(recording, paper_device().operator)]


def test_faults_of_the_drive_come_before_effects():
    runs = triangle((10.0, 20.0), amplitude=3.0, bias=3.0, samples=600, periods=3)
    good = record(list(runs))
    assert kinds(good) == []
    wrong = [dataclasses.replace(d, excitation_hz=1.3 * d.rate) for d in runs]
    said = Recording.of(wrong, [run.response for run in good.runs])
    assert kinds(said) == ["wrong period", "wrong period"]


def test_a_start_from_rest_is_told_from_creep_by_later_periods_only():
    (one,) = triangle(10.0, amplitude=3.0, bias=3.0, samples=300, periods=1)
    time = np.arange(301) / 3000.0
    closed = dataclasses.replace(one, time=time, value=np.r_[one.value, one.value[0]])
    alone = record([closed])
    rest = alone.runs[0].response + 4.0 * np.exp(-time / 0.02)
    assert kinds(Recording.of([closed], [rest])) == ["unsettled start"]
    (three,) = triangle(10.0, amplitude=3.0, bias=3.0, samples=900, periods=3)
    settled = record([three]).runs[0].response
    later = settled + 4.0 * np.exp(-three.time / 0.02)
    assert kinds(Recording.of([three], [later])) == []
