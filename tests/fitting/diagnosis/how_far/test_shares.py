"""Shares of a pair and of runs: sums, symmetry and known cases."""

import numpy as np
import pytest
from edge_worlds import drives, record
from hypothesis import example, given
from hypothesis import strategies as st

from fitting.diagnosis.how_far._shares import effect_shares, run_shares
from fitting.diagnosis.noise._periods import period_blocks
from rapi_jax.internal import to_batch

COST = st.floats(0.0, 1e6)


@example(none=5e-324, a=0.0, b=0.0, both=0.0)
@example(none=1.175494351e-38, a=1.0, b=1.0, both=0.0)
@given(none=COST, a=COST, b=COST, both=COST)
def test_shares_of_a_pair_sum_to_one_whatever_the_order(none, a, b, both):
    cost = {"none": none, "creep": a, "drift": b, "creep+drift": both}
    found = effect_shares(["creep", "drift"], cost)
    if none <= both:
        assert found is None
        return
    assert found is not None and sum(found.values()) == pytest.approx(1.0)
    assert all(0.0 <= share <= 1.0 for share in found.values())
    assert effect_shares(["drift", "creep"], cost) == pytest.approx(found, abs=1e-9)


def test_what_either_explains_is_halved_and_what_one_alone_does_is_its_own():
    same = {"none": 10.0, "creep": 4.0, "drift": 4.0, "creep+drift": 4.0}
    assert effect_shares(["creep", "drift"], same) == {"creep": 0.5, "drift": 0.5}
    apart = {"none": 10.0, "creep": 3.0, "drift": 9.0, "creep+drift": 2.0}
    assert effect_shares(["creep", "drift"], apart) == {"creep": 0.875, "drift": 0.125}
    assert effect_shares(["creep"], apart) is None
    assert effect_shares(["creep", "etalon"], apart) is None


def test_runs_sum_to_all_that_falls_and_the_largest_is_first():
    recording = record(drives((10.0, 40.0), periods=2, samples=50))
    blocks = period_blocks(recording, to_batch(recording, lead=True))
    wave = np.tile([1.0, -1.0], (2, 25))
    without, named = [2.0 * wave, 3.0 * wave], [wave, wave]
    found = run_shares(recording, without, named, blocks, own_origin=False)
    assert [entry["run"] for entry in found] == [1, 0]
    assert [entry["share"] for entry in found] == pytest.approx([8 / 11, 3 / 11])
    assert (found[0]["before"], found[0]["after"], found[0]["excitation_hz"]) == (3.0, 1.0, 40.0)
    off = [e + 5.0 for e in without]  # the origin of a session says nothing
    assert run_shares(recording, off, named, blocks, own_origin=False) == found
    apart = [without[0] + 5.0, without[1] - 5.0]  # nor does each, where each run has its own
    assert run_shares(recording, apart, named, blocks, own_origin=True) == found
