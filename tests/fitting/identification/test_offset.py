"""No result of a fit depends on an offset of drive or response."""

import dataclasses
import hashlib
import io
import json

import equinox as eqx
import numpy as np
import pytest

from fitting import fit, identify
from fitting.identification.problem._problem import Problem
from rapi_jax import (
    ECDL,
    PI,
    RAPI,
    GeneralRAPI,
    Identified,
    Recording,
    compensate,
    linear_scan,
    parameters,
    predict,
)
from rapi_jax.examples import paper_recording
from rapi_jax.io import read_model, write_model

OFFSETS = [(65.0, 65.0), (1000.0, 1000.0), (0.0, 65.0), (0.0, 1000.0), (65.0, 0.0), (-1000.0, 0.0)]
SHARED = ("alpha", "zeta", "lam", "eta", "a", "b", "d_1", "d_2", "d_3")


def offset(recording, drive, response):
    """`recording` with this much added to every drive and response."""
    runs = [
        dataclasses.replace(
            run,
            drive=dataclasses.replace(run.drive, value=run.drive.value + drive),
            response=run.response + response,
        )
        for run in recording.runs
    ]
    return dataclasses.replace(recording, runs=tuple(runs))


@pytest.fixture(scope="module")
def recording():
    return paper_recording(samples=1000, periods=1, seed=3)[0]


@pytest.fixture(scope="module")
def fitted(recording):
    return fit(ECDL(RAPI.guess(recording)), recording)


def compare(found, reference, drive, response, names=SHARED):
    """All that may not depend on the offsets, to 1e-6."""
    assert found.verdict == reference.verdict
    assert found.rmse == pytest.approx(reference.rmse, rel=1e-6)
    assert found.rmse_held_out == pytest.approx(reference.rmse_held_out, rel=1e-6)
    for name in names:
        assert found[name].value == pytest.approx(reference[name].value, rel=1e-6), name
        assert found[name].stderr == pytest.approx(reference[name].stderr, rel=1e-6), name
    assert found["origin"].value - reference["origin"].value == pytest.approx(drive, abs=1e-9)
    assert found["d_0"].value - response == pytest.approx(reference["d_0"].value, abs=1e-6)
    for one, other in zip(found.predicted, reference.predicted, strict=True):
        np.testing.assert_allclose(one - response, other, rtol=0, atol=1e-6 * np.ptp(other))


@pytest.mark.parametrize(("drive", "response"), OFFSETS)
def test_fit_does_not_depend_on_offsets(recording, fitted, drive, response):
    assert fitted.verdict.trusted and fitted["origin"].value == 0.0
    moved = offset(recording, drive, response)
    compare(fit(ECDL(RAPI.guess(moved)), moved), fitted, drive, response)


@pytest.mark.parametrize(("drive", "response"), [(2.0, 0.0), (-5.0, 3.0), (1000.0, 1000.0)])
def test_identify_does_not_depend_on_offsets(recording, drive, response):
    options = {"each": (), "hold_out": ("last third",)}
    reference = identify(recording, **options)
    assert reference.verdict.trusted and reference["origin"].held
    compare(identify(offset(recording, drive, response), **options), reference, drive, response)


def test_a_device_whose_own_zero_is_near_keeps_it():
    device = ECDL(RAPI(alpha=0.28, zeta=6.7e-3, lam=1.6, eta=1.0, a=0.63, b=0.1, d=(18.8, -1.08)))
    drives = [
        dataclasses.replace(drive, value=(drive.value - 3.0) * 0.7 + 2.0)
        for drive in paper_recording(samples=1000)[0].drives
    ]
    rng = np.random.default_rng(0)
    responses = [
        np.asarray(predict(device, d)) + 0.02 * rng.standard_normal(d.size) for d in drives
    ]
    found = identify(Recording.of(drives, responses), order=2, each=(), hold_out=False)
    assert found["origin"].value == 0.0
    assert abs(found["lam"].value - 1.6) < 4 * found["lam"].stderr < 0.1


def test_a_general_operator_does_not_depend_on_offsets(recording):
    moved = offset(recording, 65.0, 0.0)
    free = [p.name for p in parameters(GeneralRAPI.guess(recording)) if not p.held]
    options = {"free": lambda e: tuple(getattr(e.operator, n) for n in free if n != "bow")}
    one, other = (
        fit(ECDL(GeneralRAPI.guess(r)), r, starts=1, hold_out=False, throw=False, **options)
        for r in (recording, moved)
    )
    assert other["u_0"].value == pytest.approx(one["u_0"].value, abs=1e-9)
    assert other["origin"].value == pytest.approx(65.0)
    assert other.rmse == pytest.approx(one.rmse, rel=1e-6)
    for name in ("alpha", "zeta_1", "lam", "eta", "a", "b_1", "d_1"):
        assert other[name].value == pytest.approx(one[name].value, rel=1e-6), name


def test_a_classical_operator_counts_from_the_origin_it_is_given(recording):
    fields = {"r": [0.2, 0.6], "p": [1.0, 1.0], "d": (15.0, 0.0, 0.0)}
    moved = offset(recording, 1000.0, 0.0)
    one = fit(ECDL(PI(**fields)), recording, starts=1, hold_out=False, throw=False)
    other = fit(ECDL(PI(**fields, origin=1000.0)), moved, starts=1, hold_out=False, throw=False)
    assert not other.verdict.unidentifiable
    for name in ("r_1", "r_2", "p_1", "p_2", "d_1", "d_2", "d_3"):
        assert other[name].value == pytest.approx(one[name].value, rel=1e-6), name


def test_the_inverse_of_a_classical_operator_gives_the_drive_with_its_origin(recording):
    forward = PI(r=[0.2, 0.6], p=[1.0, 2.0], d=(15.0,), d_0=3.0, origin=1000.0)
    drive = offset(recording, 1000.0, 0.0).drives[0]
    response = np.asarray(predict(ECDL(forward), drive))
    back = predict(ECDL(forward.inverse()), dataclasses.replace(drive, value=response))
    np.testing.assert_allclose(np.asarray(back), drive.value, rtol=0, atol=1e-9)


def test_a_drive_is_asked_for_with_its_offset(recording, fitted, tmp_path):
    moved = offset(recording, 1000.0, 0.0)
    far = fit(ECDL(RAPI.guess(moved)), moved)
    write_model(tmp_path / "far.rapi", far.ecdl)
    reread, _ = read_model(tmp_path / "far.rapi")
    target = linear_scan(20.0, span=55.0)[0]
    near = compensate(fitted.ecdl, target, identified=Identified.of(recording), bias=3.0)
    other = compensate(reread, target, identified=Identified.of(moved), bias=1003.0)
    np.testing.assert_allclose(
        other.drive.value - 1000.0, near.drive.value, rtol=0, atol=1e-6 * near.drive.u_pp
    )


def test_the_whole_operator_is_freed_without_its_origin(recording):
    start = ECDL(RAPI.guess(recording))
    for free, moves in (
        (lambda e: e.operator, False),
        (lambda e: e, False),
        (lambda e: (e.operator.d, e.operator.origin), True),
        (lambda e: e.operator.origin, True),
    ):
        problem = Problem.of(start, recording, free)
        assert problem.free[problem.vector.names.index("origin")] == moves
        assert problem.free[problem.vector.names.index("lam")] != moves


def test_a_model_file_from_before_there_was_an_origin_counts_from_zero(fitted, tmp_path):
    path = tmp_path / "model.rapi"
    write_model(path, fitted.ecdl)
    body, _, _ = path.read_bytes().rstrip(b"\n").rpartition(b"\n")
    line, _, leaves = body.partition(b"\n")
    header = json.loads(line)
    assert header["operator"]["shapes"].pop("origin") == []
    one = io.BytesIO()
    np.save(one, np.zeros(()))
    old = json.dumps(header).encode() + b"\n" + leaves[: -len(one.getvalue())]
    path.write_bytes(old + b"\n" + hashlib.sha256(old).hexdigest().encode() + b"\n")
    reread, _ = read_model(path)
    assert eqx.tree_equal(reread, fitted.ecdl)
