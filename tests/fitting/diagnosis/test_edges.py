"""`diagnose` where a recording is odd: no crash, no effect named with confidence that is not there.

Each answer is checked as `test_contract.check` checks any. Figures are in `tests/README.md`.
"""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from diagnosis_contract import check
from edge_worlds import NOISE, PERIODS, RATES, drives, off, record, wandering

from fitting.diagnosis import diagnose
from fitting.diagnosis._data_checks import check_candidates
from rapi_jax import ECDL, PI, DataError, Drive, Recording
from rapi_jax.effects import AmplifierLowpass, Creep, Etalon
from rapi_jax.examples import paper_device

KINDS = (AmplifierLowpass, Etalon)  # before and behind the operator; each class is compiled
TRUTH = Etalon(amplitude=0.3, spacing=20.0, phase=0.4)


def verdict(recording: Recording, ecdl: ECDL | None = None, candidates=KINDS) -> dict:
    return check(diagnose(ecdl, recording, candidates=candidates, scan=False))


def assert_none(out: dict, noise: float = NOISE) -> None:
    """Named as noise, of the right size: 15 % is four standard errors with 200 readings."""
    assert out["verdict"]["name"] == "none", out["verdict"]
    assert not out["gap"]["significant"]
    assert out["gap"]["total"] == pytest.approx(noise, rel=0.15)


@pytest.fixture(scope="module")
def good() -> Recording:
    return record(drives())


def masked(recording: Recording) -> Recording:
    """Every fiftieth reading and a stretch of twenty."""
    rng, runs = np.random.default_rng(1), []
    for run in recording.runs:
        y = run.response.copy()
        y[rng.choice(y.size, y.size // 50, replace=False)] = np.nan
        y[40:60] = np.nan
        runs.append(y)
    return Recording.of(recording.drives, runs)


NOISE_ONLY = {
    "masked readings": lambda: masked(record(drives())),
    "any phase": lambda: record(drives(phase=0.37, periods=PERIODS + 1)),
    "no common clock": lambda: record(drives(clock=False)),
    "one rate": lambda: record(drives((20.0,), amplitudes=(2.0, 3.0))),
    "one rate and amplitude": lambda: record(drives((20.0,))),
    "two periods": lambda: record(drives(periods=2)),
    "16 samples a period": lambda: record(drives(samples=16)),
    "40 000 samples a period": lambda: record(drives(samples=40_000, periods=2)),
    "a latency that is known": lambda: dataclasses.replace(record(drives()), response_lag_s=1e-9),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", NOISE_ONLY)
def test_what_is_noise_is_called_noise(name):
    assert_none(verdict(NOISE_ONLY[name]()))


@pytest.mark.slow
def test_periods_between_samples():
    """Read by straight lines, noise loses sqrt(2/3) of itself on average; the verdict stays."""
    out = verdict(record(drives(samples=200.37, periods=3.4)))
    assert_none(out, NOISE * np.sqrt(2 / 3))


@pytest.mark.slow
def test_runs_with_their_own_origin(good):
    """A step of 5 GHz from run to run, said and not said.

    Not said it shows where a rate comes back at another amplitude: between two runs of two rates it
    could be a hysteresis that depends on the rate. Plays beyond the model's could make six such
    steps; origins of the runs' own are likelier by far, and are a fault of the recording.
    """
    moved = [run.response + 5.0 * k for k, run in enumerate(good.runs)]
    assert_none(verdict(Recording.of(good.drives, moved, response_origin="run")))
    several = record(drives((10.0, 20.0, 40.0), amplitudes=(2.0, 3.0)))
    moved = [run.response + 5.0 * k for k, run in enumerate(several.runs)]
    out = verdict(Recording.of(several.drives, moved))
    assert out["gap"]["significant"] and not out["verdict"]["judged"]
    assert 'response_origin = "run"' in out["verdict"]["sentence"]
    assert "25 GHz apart" in out["verdict"]["sentence"]


def test_a_displacement_recording_says_its_own_unit():
    out = verdict(record(drives(), TRUTH, scale=0.1, response_unit="um"))
    assert (out["unit"], out["verdict"]["name"]) == ("um", "etalon")
    (found,) = [h for h in out["hypotheses"] if h["name"] == "etalon"]
    assert found["parameters"]["amplitude"]["unit"] == "um"
    assert found["parameters"]["amplitude"]["value"] == pytest.approx(0.03, rel=0.1)


def test_one_period_says_so_and_takes_no_noise_for_an_effect():
    out = verdict(record(drives(periods=1)))
    assert out["gap"]["noise_floor"] is None
    assert any("lower bound" in note and "three periods" in note for note in out["notes"])
    assert out["verdict"]["name"] == "none"
    assert not out["gap"]["significant"]


@pytest.mark.slow
def test_one_period_still_shows_what_is_large():
    """An etalon of ten times the noise is found; less sure than with periods that repeat."""
    out = verdict(record(drives(periods=1), TRUTH))
    assert out["verdict"]["name"] == "etalon"
    assert out["gap"]["noise_floor"] is None and out["gap"]["significant"]


def test_one_rate_and_one_amplitude_are_noted():
    out = verdict(record(drives((20.0,))), candidates=())
    (note,) = (note for note in out["notes"] if note.startswith("One scan rate"))
    assert "resonance near a multiple of the scan rate" in note
    assert any(note.startswith("One swing") for note in out["notes"])
    assert out["recording"]["rates_hz"] == [20.0]


@pytest.mark.slow
def test_readings_that_are_noise_name_no_effect():
    """The model explains nothing, which is said first; it is not to be trusted."""
    rng = np.random.default_rng(3)
    runs = drives()
    out = verdict(Recording.of(runs, [20.0 * rng.standard_normal(d.size) for d in runs]))
    assert out["verdict"]["effects"] == []
    assert [fault["kind"] for fault in out["faults"]] == ["nothing explained"]
    assert not out["verdict"]["judged"] and out["verdict"]["probability"] == 0.5
    assert "wiring" in out["notes"][0]


def test_a_clock_in_ms_is_refused(good):
    """Hardly a sample a period at the rate that is stated."""
    slow = [dataclasses.replace(d, time=1e3 * d.time) for d in good.drives]
    with pytest.raises(DataError, match="samples a period at .* Hz.*clock in ms"):
        diagnose(None, Recording.of(slow, [run.response for run in good.runs]))


def test_readings_that_rest_are_refused(good):
    rest = Recording.of(good.drives, [np.full(d.size, 5.0) for d in good.drives])
    with pytest.raises(DataError, match="readings of all runs rest.*cable"):
        diagnose(None, rest)


@pytest.mark.slow
def test_one_reading_that_rests_is_said(good):
    """No effect of these explains a sensor that came off in one run."""
    out = verdict(Recording.of(good.drives, [good.runs[0].response, np.full(600, 5.0)]))
    assert [(f["kind"], f["run"]) for f in out["faults"]] == [("no reading", "run01")]
    assert out["verdict"]["name"] == "unlisted" and "cable" in out["notes"][0]


@pytest.mark.slow
def test_a_drive_that_rests(good):
    still = [dataclasses.replace(d, value=np.full(d.size, 3.0)) for d in good.drives]
    responses = [run.response for run in good.runs]
    with pytest.raises(DataError, match="drive of all runs rests"):
        diagnose(None, Recording.of(still, responses))
    out = verdict(Recording.of([good.drives[0], still[1]], responses))
    assert [(f["kind"], f["run"]) for f in out["faults"]] == [("no drive", "run01")]
    assert out["verdict"]["effects"] == []


def test_too_few_samples_are_refused():
    with pytest.raises(DataError, match="8 usable samples .* cannot fix 9 parameters"):
        diagnose(None, record(drives((10.0,), samples=8, periods=1)))


def test_no_complete_period_is_refused():
    with pytest.raises(DataError, match="no complete period"):
        diagnose(None, record(drives(periods=0.6)))


def test_readings_without_any_noise_have_no_gap():
    """What a refit leaves of simulated readings, rounding included, is no effect."""
    out = verdict(record(drives(), noise=0.0))
    assert out["verdict"]["name"] == "none" and not out["gap"]["significant"]
    assert out["gap"]["total"] < 1e-4  # of a span of 40 GHz


def test_an_effect_without_any_noise_is_found():
    out = verdict(record(drives(), TRUTH, noise=0.0))
    assert out["verdict"]["name"] == "etalon"


@pytest.mark.slow
def test_a_drive_that_does_not_repeat():
    out = verdict(record([wandering(), wandering()]))
    assert out["gap"]["noise_floor"] is None
    assert out["verdict"]["name"] == "none"


@pytest.mark.slow
@pytest.mark.parametrize("growth", [0.0, 0.5])  # of the swing a second
def test_a_rate_that_need_not_repeat(growth):
    """Where it does all the same, its periods show the noise."""
    t = np.arange(600) / 2000.0
    u = 3.0 + 1.2 * (1.0 + growth * t) * np.sin(2 * np.pi * 10 * t)
    runs = [Drive(t, u, excitation_hz=10.0, waveform="other", start_s=s) for s in (0.0, 1.0)]
    out = verdict(record(runs))
    assert out["verdict"]["name"] == "none"
    if growth:
        assert out["gap"]["noise_floor"] is None
    else:
        assert out["gap"]["noise_floor"] == pytest.approx(NOISE, rel=0.1)


def test_a_model_whose_parameters_are_off_lacks_no_effect(good):
    """All of the gap is the parameters': nothing structural is left beside the noise."""
    out = verdict(good, ECDL(off(0.03)))
    assert out["verdict"]["name"] == "none"
    gap = out["gap"]
    assert gap["parametric"] > 20 * NOISE
    assert gap["structural"] < 0.5 * NOISE
    assert gap["noise_floor"] == pytest.approx(NOISE, rel=0.1)
    # What repeats and what does not are those of the model that was brought, as the total is.
    parts = gap["locked"] ** 2 + gap["not_locked"] ** 2 + gap["noise_floor"] ** 2
    assert parts == pytest.approx(gap["total"] ** 2, rel=0.01)


def test_a_model_that_is_right_has_no_gap(good):
    out = verdict(good, paper_device())
    assert_none(out)
    assert out["gap"]["parametric"] < 0.3 * NOISE


@pytest.mark.slow
def test_a_model_that_holds_the_effect_lacks_none():
    """It is not proposed again, and stays in the model."""
    ecdl = ECDL(paper_device().operator, (TRUTH,))
    report = diagnose(ecdl, record(drives(), TRUTH), candidates=KINDS, scan=False)
    out = check(report)
    assert_none(out)
    assert all("etalon" not in h["effects"] for h in out["hypotheses"])
    assert [type(effect) for effect in report.model.effects] == [Etalon]
    assert out["model"]["effects"] == ["Etalon"]


@pytest.mark.slow
def test_a_model_of_another_operator():
    """A symmetric operator cannot be this device: no effect is named for what it lacks."""
    ecdl = ECDL(PI(r=(0.2, 0.5, 1.0), p=(1.0, 1.0, 1.0), d=(18.0, -1.0, 0.01)))
    out = verdict(record(drives()), ecdl, candidates=(Etalon,))
    assert out["verdict"]["effects"] == []
    assert out["gap"]["parametric"] > 1.0 and out["model"]["operator"] == "PI"


@pytest.mark.slow
@pytest.mark.parametrize("candidates", [(), (Etalon,), (Etalon, Etalon), [Creep]])
def test_few_candidates(candidates, good):
    out = verdict(good, candidates=candidates)
    assert out["verdict"]["name"] == "none"
    allowed = {"none", "unlisted"} | {cls.name for cls in candidates}
    assert {h["name"] for h in out["hypotheses"]} <= allowed


def test_nothing_to_choose_from_names_nothing():
    out = verdict(record(drives(), TRUTH), candidates=())
    assert (out["verdict"]["name"], out["verdict"]["set"]) == ("unlisted", ["unlisted"])


@pytest.mark.slow
def test_progress_is_told_and_a_fault_in_it_is_not_hidden(good):
    said = []
    diagnose(None, good, candidates=(Etalon,), scan=False, progress=said.append)
    assert said[0] == "base model" and "etalon" in said

    def broken(line: str) -> None:
        raise RuntimeError(line)

    with pytest.raises(RuntimeError, match="base model"):
        diagnose(None, good, candidates=(Etalon,), progress=broken)


def test_the_recording_is_left_as_it_was(good):
    before = good.sha256()
    verdict(good, candidates=(Etalon,))
    assert good.sha256() == before and set(good.rates) == set(RATES)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((paper_device().operator, 0), "`ecdl`.*RAPI.*Wrap"),
        ((None, "folder"), "`recording`.*str.*read_recording"),
    ],
)
def test_arguments_of_another_class_are_refused(arguments, words, good):
    ecdl, recording = arguments
    with pytest.raises(TypeError, match=words):
        diagnose(ecdl, good if recording == 0 else recording)


@pytest.mark.parametrize(
    ("candidates", "words"),
    [
        (("creep",), "`candidates`.*'creep'"),
        ((Etalon(),), "`candidates`.*classes"),
        ((int,), "`candidates`"),
    ],
)
def test_candidates_that_are_no_effects_are_refused(candidates, words):
    with pytest.raises(TypeError, match=words):
        check_candidates(candidates)


HOST = """
import jax
import numpy as np
from fitting.diagnosis import diagnose
from rapi_jax import ECDL, Recording, predict, triangle
from rapi_jax.examples import paper_device
from rapi_jax.effects import Etalon
assert not jax.config.jax_enable_x64
drives = triangle((10.0, 40.0), amplitude=3.0, bias=3.0, samples=600, periods=3)
rng = np.random.default_rng(0)
clean = [np.asarray(predict(paper_device(), d)) for d in drives]
responses = [y + 0.02 * rng.standard_normal(600) for y in clean]
report = diagnose(None, Recording.of(drives, responses), candidates=(Etalon,))
assert report.verdict.name == "none", report
assert not jax.config.jax_enable_x64
try:
    diagnose(paper_device().operator, report.recording)
except TypeError as error:
    print(error)
"""


@pytest.mark.process
def test_a_host_of_32_bits_gets_the_same_and_keeps_its_setting():
    """As a user has it: 32 bits, no checks of annotations, warnings shown as errors."""
    command = [sys.executable, "-W", "error::RuntimeWarning", "-c", HOST]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    assert "Argument `ecdl`" in done.stdout
