"""GeneralRAPI as a model to identify, to judge and to compensate with."""

import json

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting import fit
from fitting.cli import app
from fitting.commands.run import run
from fitting.identification._options import default_free
from fitting.identification.problem._problem import Problem
from rapi_jax import ECDL, RAPI, GeneralRAPI, Identified, Recording, parameters, predict
from rapi_jax._waveform import triangle
from rapi_jax.examples import paper_device, paper_drives, paper_recording
from rapi_jax.io import read_drive, write_model

DEVICE = GeneralRAPI(
    alpha=0.3, zeta=(0.006, 0.003), lam=1.4, eta=1.0, a=0.9, b=(0.1, 0.2), bow=0.03, u_0=3.0,
    d=(18.8, -1.1, 0.01), plays=6,
)  # fmt: skip


def recorded(operator, drives, noise=0.0):
    rng = np.random.default_rng(0)
    truth = [np.asarray(predict(ECDL(operator), d)) for d in drives]
    return Recording.of(drives, [y + noise * rng.standard_normal(y.size) for y in truth])


def test_noise_free_data_are_recovered_from_a_straight_start():
    """Every parameter, from the paper's device made general: no bow, no parting, one decay."""
    recording = recorded(DEVICE, paper_drives(samples=800))
    plain = RAPI(
        alpha=0.25, zeta=0.005, lam=1.3, eta=1.0, a=0.8, b=0.1, d=(18.0, -1.0, 0.0), plays=6
    )
    start = ECDL(GeneralRAPI.of(plain, u_0=3.0))
    got = fit(start, recording, hold_out=False, throw=False)
    assert got.rmse < 1e-6
    assert got["u_0"].held and got["u_0"].value == 3.0
    for part in parameters(DEVICE):
        values = np.asarray(getattr(DEVICE, part.name)).ravel()
        for name, value in zip(part.names(), values, strict=True):
            assert got[name].value == pytest.approx(float(value), rel=1e-4, abs=1e-4), name
    straight = fit(ECDL(plain), recording, hold_out=False, throw=False)
    assert straight.rmse > 1e-2  # the freedom is needed


def test_a_weight_and_a_shape_a_play_are_started_alike():
    """A guess from the data has one weight; the model given has one a play."""
    each = eqx.tree_at(
        lambda o: (o.a, o.lam), DEVICE, (jnp.linspace(0.6, 1.2, 6), jnp.linspace(1.2, 1.6, 6))
    )
    recording = recorded(each, paper_drives(samples=400), noise=0.02)
    got = fit(ECDL(each), recording, hold_out=False, throw=False, starts=2)
    assert got.rmse < 0.021
    assert {"given", "guess 1"} <= {s.origin.removesuffix(" tilted") for s in got.starts}


@pytest.mark.parametrize(
    "rates, amplitudes, origin, change, held",
    [
        ((10.0, 40.0), (4.0,), "session", {}, {"u_0"}),
        ((10.0, 40.0), (4.0,), "run", {}, {"u_0", "eta"}),
        ((10.0,), (4.0,), "session", {}, {"u_0", "eta", "alpha"}),
        ((10.0,), (4.0, 2.0), "session", {}, {"u_0"}),
        ((10.0,), (4.0,), "session", {"alpha": (0.2, 0.3)}, {"u_0", "eta", "zeta"}),
        ((10.0,), (4.0,), "session", {"eta": (1.0, 0.9)}, {"u_0", "alpha", "zeta"}),
        ((10.0,), (4.0,), "session", {"a": (1.0, 0.9)}, {"u_0", "eta", "alpha", "b"}),
    ],
)
def test_what_the_data_cannot_tell_is_held(rates, amplitudes, origin, change, held):
    fields = {p.name: getattr(DEVICE, p.name) for p in parameters(DEVICE)}
    ecdl = ECDL(GeneralRAPI(**(fields | change), plays=2))
    drives = [
        d for u_pp in amplitudes for d in triangle(rates, amplitude=u_pp, bias=3.0, samples=100)
    ]
    runs = Recording.of(drives, [np.zeros(100)] * len(drives), response_origin=origin)
    problem = Problem.of(ecdl, runs, default_free(ecdl, runs))
    names = [p.name for p in problem.vector.parts for _ in range(p.size)]
    found = {n for n, free in zip(names, problem.free, strict=True) if not free}
    assert found == held | {"origin", "rho"}  # which a fit frees only where it is told to


def test_one_rate_and_amplitude_leave_nothing_unidentifiable():
    recording = recorded(DEVICE, paper_drives(samples=2000)[:1], noise=0.002)
    start = ECDL(GeneralRAPI.of(RAPI.guess(recording, plays=6), u_0=3.0))
    got = fit(start, recording, hold_out=False, throw=False)
    assert got.verdict.unidentifiable == ()


def test_a_crossed_band_that_bends_is_noted_with_its_ends():
    """Crossed between the roots of 0.2 (u - 3)^2 - 0.05 = 0 only: inside, not at the ends."""
    crossed = GeneralRAPI(
        alpha=0.0, zeta=(-1e-3, 0.0), lam=1.0, eta=4.0, a=0.9, b=(0.0, 0.0), bow=0.2, u_0=3.0,
        d=(18.8, -1.1, 0.01), plays=2,
    )  # fmt: skip
    recording = recorded(crossed, triangle((10.0, 20.0), amplitude=3.0, bias=3.0, samples=200))
    got = fit(
        ECDL(crossed), recording, free=lambda e: e.operator.d, guess=False, starts=1,
        hold_out=False, throw=False,
    )  # fmt: skip
    (note,) = [n for n in got.verdict.notes if "without hysteresis" in n]  # once for both runs
    assert "play 1 from 2.29 to 3.71 V" in note and "nothing needs to be done" in note


def test_compensate_from_a_saved_model(tmp_path, capsys):
    device = ECDL(
        eqx.tree_at(lambda o: o.bow, GeneralRAPI.of(paper_device().operator), jnp.asarray(0.01))
    )
    recording, _ = paper_recording(samples=400)
    folder = tmp_path / "model"
    folder.mkdir()
    about = {
        "response_unit": "GHz",
        "drive_unit": "V",
        "trusted": True,
        "identified": Identified.of(recording).to_dict(),
        "data_sha256": recording.sha256(),
    }
    write_model(folder / "model.rapi", device, **about)
    output = tmp_path / "out"
    options = ("--span", "70", "--frequency", "10", "40", "--no-plots", "--json")
    assert run(app, ["compensate", str(folder), *options, "-o", str(output)]) == 0
    report = json.loads(capsys.readouterr().out)
    for rate, entry in zip(("10", "40"), report["drives"], strict=True):
        assert entry["certificate"]["invertible"] and entry["inverse"] == "exact"
        drive = read_drive(output / f"drive_{rate}Hz.csv")
        answer = np.asarray(predict(device, drive))
        middle = slice(int(0.05 * drive.size), int(0.45 * drive.size))
        line = np.polyfit(drive.time[middle], answer[middle], 1)
        assert np.abs(answer[middle] - np.polyval(line, drive.time[middle])).max() < 1e-7


def test_compensate_refuses_a_bound_that_turns_over(tmp_path, capsys):
    device = eqx.tree_at(
        lambda o: (o.bow, o.u_0),
        GeneralRAPI.of(paper_device().operator),
        (jnp.asarray(-0.6), jnp.asarray(3.0)),
    )
    recording, _ = paper_recording(samples=400)
    about = {"response_unit": "GHz", "drive_unit": "V", "trusted": True}
    identified = Identified.of(recording).to_dict()
    folder = tmp_path / "model"
    folder.mkdir()
    write_model(
        folder / "model.rapi", ECDL(device), **about, identified=identified,
        data_sha256=recording.sha256(),
    )  # fmt: skip
    options = ("--span", "70", "--frequency", "20", "-o", str(tmp_path / "out"))
    assert run(app, ["compensate", str(folder), *options]) == 3
    error = capsys.readouterr().err
    assert "turns over" in error and error.count("\n") == 1
