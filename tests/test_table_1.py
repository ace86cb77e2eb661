"""Table 1 on the simulated bench, everything read from fringes: two inverses beat the paper's."""

import numpy as np
import pytest

from fitting import identify, identify_inverse
from hardware import SimulatedBench
from rapi_jax import Identified, compensate, linear_scan, linearity
from rapi_jax.examples import paper_drives

pytestmark = pytest.mark.slow

RATES = (10.0, 20.0, 30.0, 40.0)
UP = (63.7, 75.8, 61.9, 33.8)  # MHz, the paper's with compensation
DOWN = (271.0, 243.0, 179.0, 154.0)


@pytest.fixture(scope="module")
def bench():
    return SimulatedBench.like_paper(seed=4)


@pytest.fixture(scope="module")
def training(bench):
    return bench.measure(paper_drives())


@pytest.fixture(scope="module")
def forward(training):
    return identify(training)


def straight(bench, ecdl, training, rate, span=75.0, bias=3.0):
    (target,) = linear_scan(rate, span=span)
    made = compensate(
        ecdl,
        target,
        identified=Identified.of(training),
        limits=bench.limits,
        bias=bias,
        extrapolate=True,
    )
    return linearity(bench.measure(made.drive).runs[0])


def test_the_exact_inverse_beats_every_cell(bench, training, forward):
    scans = [straight(bench, forward.ecdl, training, rate) for rate in RATES]
    for scan, up, down in zip(scans, UP, DOWN, strict=True):
        assert 1e3 * scan.up.rms_ghz < up and 1e3 * scan.down.rms_ghz < down
        for branch in (scan.up, scan.down):  # the best iterative predistortion of a DFB laser
            assert branch.one_minus_r2() <= 3.3e-7 and branch.one_minus_r2(54.5) <= 3.3e-7


def test_the_papers_inverse_beats_the_papers_down_cells_and_worst_up_cell(bench, training, forward):
    inverse = identify_inverse(training, forward)
    scans = [straight(bench, inverse.ecdl, training, rate) for rate in RATES]
    assert (np.array([1e3 * s.down.rms_ghz for s in scans]) < DOWN).all()
    assert max(1e3 * s.up.rms_ghz for s in scans) < max(UP)


@pytest.mark.parametrize(
    ("rate", "span", "bias"), [(15.0, 75.0, 3.0), (55.0, 75.0, 3.0), (25.0, 45.0, 3.3)]
)
def test_the_exact_inverse_where_it_was_never_identified(
    bench, training, forward, rate, span, bias
):
    scan = straight(bench, forward.ecdl, training, rate, span, bias)
    assert max(scan.up.one_minus_r2(), scan.down.one_minus_r2()) <= 3.3e-7
