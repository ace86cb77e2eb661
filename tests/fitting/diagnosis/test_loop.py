"""The loop closed: diagnose, add the effects, compensate again, and the scan is straighter."""

import numpy as np
import pytest
from worlds import answers, drives

from fitting import diagnose, fit
from rapi_jax import (
    ECDL,
    RAPI,
    DriveLimits,
    Recording,
    Run,
    compensate,
    linear_scan,
    linearity,
    predict,
)
from rapi_jax.effects import Creep, Resonance
from rapi_jax.examples import paper_device

pytestmark = pytest.mark.slow

LIMITS = DriveLimits(0.0, 7.5, 2e4)
HIDDEN = (
    Creep.at(gain=0.03, history=1.0),
    Resonance.at(hertz=700.0, damping=0.12, share=1.0),
)


def crooked(device, drive) -> float:
    """Rms nonlinearity of a scan on the device, worse branch, response unit."""
    return max(linearity(Run(drive, np.asarray(predict(device, drive)))).rms_ghz)


def test_the_scan_is_straighter_by_the_factor_predicted():
    session = drives(periods=3, samples=512)
    rng = np.random.default_rng(3)
    clean = answers(session, HIDDEN)
    recording = Recording.of(session, [y + 0.005 * rng.standard_normal(y.size) for y in clean])
    plain = fit(ECDL(RAPI.guess(recording)), recording, hold_out=False, throw=False).ecdl
    report = diagnose(plain, recording, scan=False)
    assert report.verdict.name == "creep+resonance"
    device = ECDL(paper_device().operator, HIDDEN)
    (target,) = linear_scan(20.0, span=40.0, corner=0.04)
    first = compensate(plain, target, limits=LIMITS, bias=3.0)
    second = compensate(report.model, target, limits=LIMITS, bias=3.0)
    factor = crooked(device, first.drive) / crooked(device, second.drive)
    promised = report.content["shrinkage"]["straighter"]
    print(factor, promised, crooked(device, first.drive), crooked(device, second.drive))
    assert factor > 5.0
    foreseen = report.content["shrinkage"]["nonlinearity"]
    assert foreseen["excitation_hz"] == 20.0
    assert foreseen["before"] == pytest.approx(crooked(device, first.drive), rel=0.5)
    assert foreseen["after"]["low"] <= crooked(device, second.drive) <= foreseen["after"]["high"]
    assert promised["low"] <= factor and (promised["high"] is None or factor <= promised["high"])
