"""What a prompt shows of a recording, a drive, a scan or a model: one line, without arrays."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rapi_jax import (
    ECDL,
    Drive,
    DriveLimits,
    Recording,
    Run,
    compensate,
    linear_scan,
    step_and_hold,
    triangle,
)
from rapi_jax.effects import Delay
from rapi_jax.examples import paper_device, paper_recording

MODEL = ECDL(paper_device().operator, (Delay.at(tau=2e-5),))
LINE = (
    "<ECDL: RAPI of 10 plays, alpha=0.2811, zeta=0.006713, lam=1.6, eta=1, a=0.6317, b=0.1, "
    "d=[18.79, -1.079, 0.01004], d_0=0, origin=0; Delay(tau=2e-05)>"
)


def test_drives_and_runs():
    (drive,) = triangle(20.0, amplitude=4.5, bias=3.0, samples=1500, periods=3)
    said = "triangle, 3 periods at 20 Hz, swing 4.5 about 3"
    assert repr(drive) == f"<Drive: {said}, 1500 samples>"
    (steps,) = step_and_hold([1.0, 4.0], hold_s=0.5, rise_s=0.01, step_s=1e-2)
    assert repr(steps) == "<Drive: step, not periodic, 1 s, swing 3 about 2.5, 101 samples>"
    rest = Drive(drive.time, np.ones(1500), 20.0, "triangle")
    assert "swing 0 about 1" in repr(rest)
    response = 18.0 * drive.value
    assert repr(Run(drive, response)) == f"<Run 'run00': {said}, span 81, 1500 samples>"
    assert repr(Run(drive, np.where(drive.time < 1e-3, np.nan, response))).endswith("10 masked>")
    assert "no reading" in repr(Run(drive, np.full(1500, np.nan)))


@pytest.mark.parametrize(
    ("rates", "said"),
    [
        ([20.0], "1 run at 20 Hz"),
        ([10.0, 20.0, 40.0], "3 runs at 10, 20, 40 Hz"),
        (np.arange(1.0, 8.0).tolist(), "7 runs at 1, 2, ..., 7 Hz"),
    ],
)
def test_recordings(rates, said):
    drives = triangle(rates, amplitude=4.5, bias=3.0, samples=100)
    recording = Recording.of(drives, [d.value for d in drives], response_unit="um")
    assert repr(recording) == f"<Recording: {said}, swing 4.5 V, response in um>"


def test_scans_and_their_drives():
    (target,) = linear_scan(20.0, span=0.06, samples=64)
    assert repr(target) == "<Target: 60 MHz at 20 Hz, 64 samples>"
    (target,) = linear_scan(20.0, span=60.0, samples=64)
    limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    made = compensate(paper_device(), target, bias=3.0, limits=limits)
    assert repr(made) == (
        "<Compensation: 60 GHz at 20 Hz, drive 1.146 to 4.854 V, exact inverse, certified>"
    )
    assert len({made, made.drive, target}) == 3  # hashed by identity, as before


def test_a_model_shows_its_values():
    assert repr(MODEL) == str(MODEL) == LINE
    each = eqx.tree_at(lambda e: e.operator.lam, MODEL, jnp.linspace(1.0, 2.0, 10))
    assert "lam=[1, 1.111, ..., 2], eta" in repr(each)


def test_trees_without_numbers_are_shown_by_equinox():
    said = []
    jax.jit(lambda ecdl: said.append(repr(ecdl)) or 0)(MODEL)
    assert said[0].startswith("ECDL(\n") and "alpha=f64[]" in said[0]
    assert repr(eqx.filter_eval_shape(lambda e: e, MODEL)).startswith("ECDL(\n")
    assert "alpha=None" in repr(eqx.filter(MODEL, lambda leaf: False))
    assert "alpha=f64[]" in eqx.tree_pformat({"model": MODEL})


def test_a_recording_of_examples():
    assert repr(paper_recording(samples=100)[0]) == (
        "<Recording: 4 runs at 10, 20, 30, 40 Hz, swing 4.5 V, response in GHz>"
    )
