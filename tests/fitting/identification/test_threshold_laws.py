"""FixedRAPI and MixedRAPI as models to identify, and the note where another law fits better."""

import json

import numpy as np
import pytest
from threshold_devices import record, session

from fitting import identify
from fitting.cli import app
from fitting.commands.run import run
from fitting.report.fit._table import describe_model
from rapi_jax import RAPI, FixedRAPI, MixedRAPI, Recording, triangle
from rapi_jax.examples import paper_device
from rapi_jax.io import read_drive, read_model, write_recording

SHAPE = dict(zeta=2e-3, lam=1.2, eta=1.1, a=0.7, b=0.2, d=(15.0, -0.4, 0.02), plays=10)
FIXED = FixedRAPI(rho=0.9, **SHAPE)
MIXED = MixedRAPI(alpha=0.15, rho=0.5, **SHAPE)
PAPER = paper_device().operator
TWO = session(rates=(10.0, 40.0))
THREE = session(rates=(10.0, 40.0), amplitudes=(1.5, 3.0, 4.5))


@pytest.mark.parametrize("device, drives", [(FIXED, TWO), (MIXED, THREE)])
def test_thresholds_are_recovered_from_noisy_runs(device, drives):
    got = identify(record(device, drives=drives), operator=type(device), each=(), throw=False)
    assert got.verdict.trusted and got.rmse == pytest.approx(0.02, rel=0.05)
    assert not any("describe these runs better" in note for note in got.verdict.notes)
    for name in ("alpha", "rho", "zeta", "lam"):
        if hasattr(device, name):
            true, found = float(getattr(device, name)), got[name]
            assert abs(found.value - true) < 4.0 * found.stderr, name
            assert found.stderr < 0.05 * true, name


def noted(device, drives, operator):
    got = identify(
        record(device, drives=drives), operator=operator, each=(), hold_out=False, throw=False
    )
    assert type(got.ecdl.operator) is operator  # nothing is switched
    return [note for note in got.verdict.notes if "describe these runs better" in note]


@pytest.mark.parametrize(
    "device, drives, operator, law, better",
    [
        (FIXED, TWO, RAPI, "thresholds fixed in V", "FixedRAPI"),
        pytest.param(
            *(MIXED, THREE, RAPI, "thresholds that grow slower than the swing", "MixedRAPI"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(PAPER, TWO, FixedRAPI, "thresholds that grow with the swing", "RAPI"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_law_that_fits_better_is_noted(device, drives, operator, law, better):
    (note,) = noted(device, drives, operator)
    assert note.startswith(law) and note.endswith(
        f"rapi fit RECORDING -o result --operator {better}"
    )


@pytest.mark.slow
def test_nothing_is_noted_of_one_amplitude_or_of_noise():
    assert noted(FIXED, session(rates=(10.0, 40.0), amplitudes=(4.0,)), RAPI) == []
    assert noted(PAPER, TWO, RAPI) == []


def test_the_command_line_fits_and_compensates_it(tmp_path, capsys):
    write_recording(record(FIXED, drives=TWO), data := tmp_path / "data.nc")
    model = tmp_path / "model"
    options = ("--operator", "FixedRAPI", "--each", "none", "--no-plots")
    assert run(app, ["fit", str(data), "-o", str(model), *options]) == 0
    table = json.loads((model / "model.json").read_text())
    assert table["operator"] == "FixedRAPI"
    assert type(read_model(model / "model.rapi")[0].operator) is FixedRAPI
    scan = ("--span", "30", "--frequency", "10", "--no-plots")
    out = tmp_path / "drives"
    capsys.readouterr()
    assert run(app, ["compensate", str(model), *scan, "--json", "-o", str(out)]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["drives"]
    assert entry["certificate"]["invertible"] and entry["inverse"] == "exact"
    assert read_drive(out / "drive_10Hz.csv").size > 100


def test_a_law_that_predicts_a_swing_left_out_is_noted_where_it_fits_no_better():
    """Six plays of thresholds in volts, whose weights no RA-PI has: each `lam` by itself fits them.

    Thresholds fixed in volts then leave not clearly less, and a fit of both swings predicts neither
    from the other.
    """
    drives, responses = [], []
    rng = np.random.default_rng(2)
    for swing in (40.0, 80.0):
        for drive in triangle([5.0, 20.0], amplitude=swing, bias=swing / 2, samples=450, periods=3):
            twice = np.concatenate([drive.value, drive.value])
            volts = sum(
                weight * classical_play(twice, half)[drive.size :]
                for half, weight in zip(HALF_WIDTHS, WEIGHTS, strict=True)
            )
            clean = 0.06 * drive.value + 2e-4 * drive.value**2 + volts
            drives.append(drive)
            responses.append(clean + 0.002 * rng.standard_normal(drive.size))
    recording = Recording.of(drives, responses, response_unit="um")
    got = identify(recording, each=("lam",), starts=2, hold_out=("swing", "run"), throw=False)
    assert not got.swings_joined
    (note,) = [n for n in got.verdict.notes if "predict a swing that was left out better" in n]
    assert note.endswith("rapi fit RECORDING -o result --operator FixedRAPI")
    assert "none between: one did not predict the other" in describe_model(got)


HALF_WIDTHS, WEIGHTS = (1.0, 2.5, 5.0, 9.0, 15.0, 24.0), (0.01, 0.012, 0.01, 0.008, 0.006, 0.004)


def classical_play(drive: np.ndarray, half: float) -> np.ndarray:
    """The play operator of classical Prandtl-Ishlinskii models, from rest at its first bound."""
    out, state = [], drive[0] - half
    for u in drive:
        state = min(max(state, u - half), u + half)
        out.append(state)
    return np.array(out)
