"""Effects that no open bank holds: where they are drawn, and what they are.

Cases are numbered and tests named by the listed effect, so that a list of tests says no more.
"""

import dataclasses
import functools
import hashlib
import json
from collections import Counter

import numpy as np
import pytest

from fitting.blind.protocol._tiers import TIERS, bank_entries
from fitting.blind.simulator._bank import bank
from fitting.blind.simulator._scan import draw_scans
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device
from fitting.blind.simulator.effects._kinds import LISTED, makers, names_of
from fitting.blind.simulator.effects._recipe import Setting

NEW = [(kind, name) for kind in ("form", "unlisted") for name in names_of(kind, unseen=True)]


@functools.cache
def world(kind: str, name: str, seed: int = 5, sigma: float = 6.0) -> SimulatedDevice:
    return draw_device(seed, kind, name, sigma)


def parts(w: SimulatedDevice) -> list[np.ndarray]:
    return [a - b for a, b in zip(w.noise_free, w.without, strict=True)]


def test_a_bank_without_them_is_the_one_it_always_was():
    # The digests are older than `any_session`, which such a bank never asks for.
    specs = [[dataclasses.asdict(s) for s in bank(seed, 200)] for seed in (1, 2)]
    assert not any(s.pop("any_session") for of in specs for s in of)
    digests = [hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest() for of in specs]
    assert digests == [
        "50d84f8fa47bb7b2b5640de1ed9c23b5c2de6186b18dfc64b8756016a1f8fb3c",
        "0cdeda92c5257152dbb9838c3ffc8cf74ef3edad6a1c98ad558e4d859d05f887",
    ]


def unseen(spec) -> bool:
    return spec.effect in names_of(spec.kind, unseen=True)


@pytest.mark.parametrize("count", [0, 1, 40, 200, 333])
def test_a_bank_with_them_holds_half_of_the_forms_and_a_third_of_the_unlisted(count):
    specs, known = bank(7, count, unseen=True), bank(7, count)
    assert specs == bank(7, count, unseen=True) and len(specs) == count
    assert len({s.seed for s in specs}) == count
    assert Counter(s.kind for s in specs) == Counter(s.kind for s in known)
    for kind, divisor in (("form", 2), ("unlisted", 3)):
        of = [s for s in specs if s.kind == kind]
        assert sum(unseen(s) for s in of) == len(of) // divisor
        assert {s.effect for s in of} <= {*names_of(kind), *names_of(kind, unseen=True)}
    assert not any(unseen(s) for s in known)
    assert not any(unseen(s) for s in specs if s.kind not in ("form", "unlisted"))


def test_they_come_in_turn_at_all_sizes_with_and_without_base_misfit():
    specs = [s for s in bank(7, 400, unseen=True) if unseen(s)]
    times = Counter((s.kind, s.effect) for s in specs)
    for kind in ("form", "unlisted"):
        of = [times[kind, name] for name in names_of(kind, unseen=True)]
        assert min(of) >= 1 and max(of) - min(of) <= 1
    assert {s.base_misfit for s in specs} == {True, False}
    large = np.mean([s.sigma >= 4 for s in specs])
    assert 0.6 < large < 0.9


@pytest.mark.parametrize("tier", TIERS)
def test_only_the_sealed_tier_draws_them(tier):
    assert any(unseen(e.spec) for e in bank_entries(tier, 5, 60)) == (tier == "sealed")


def test_names_tell_them_apart_and_truths_are_the_listed_ones():
    assert len(names_of("form", unseen=True)) >= 10 and len(names_of("unlisted", unseen=True)) >= 4
    for kind in ("form", "unlisted"):
        assert not set(names_of(kind)) & set(names_of(kind, unseen=True))
    assert all(n.split("/")[0] in LISTED and n[-2:] == "/2" for n in names_of("form", unseen=True))
    assert names_of("listed", unseen=True) == names_of("null", unseen=True) == []
    with pytest.raises(ValueError, match="Argument `kind` must be one of"):
        names_of("other", unseen=True)


@pytest.mark.parametrize("case", range(len(NEW)))
def test_they_have_the_size_asked_for_and_show(case):
    kind, name = NEW[case]
    for seed in (21, 22):
        w = world(kind, name, seed)
        assert w.truth == (f"unlisted:{name}" if kind == "unlisted" else name.split("/")[0],)
        assert w.size == pytest.approx(6.0, rel=0.1)
        assert all(np.isfinite(nu).all() for nu in w.noise_free)
        raw = np.sqrt(np.mean(np.concatenate(parts(w)) ** 2))
        assert raw * (1 + 1e-6) >= w.size * w.noise.rms


@pytest.mark.parametrize("case", range(len(NEW)))
def test_without_strength_they_are_nothing(case):
    kind, name = NEW[case]
    w = world(kind, name, 21)
    scans = tuple(run.scan for run in w.runs)
    setting = Setting(scans, w.without, w.signal_path.rest, w.noise.rms)
    recipe = makers(kind, name)[0](np.random.default_rng(3), setting)
    # A hop's thresholds, and time constants, have no zero of their own.
    effect = recipe.build(1e-12)
    found = dataclasses.replace(w.signal_path, effects=(effect,)).simulate(scans)
    for a, b in zip(found, w.without, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


@pytest.mark.parametrize("case", range(len(NEW)))
def test_they_answer_again_as_recorded_and_go_on_after_the_session(case):
    w = world(*NEW[case], 22)
    scans = [run.scan for run in w.runs]
    for found, kept in zip(w.simulate(scans), w.noise_free, strict=True):
        np.testing.assert_array_equal(found, kept)
    later = draw_scans(np.random.default_rng(1))[0]
    later = dataclasses.replace(later, start_s=w.runs[-1].start_s + 40.0)
    difference = w.simulate([*scans, later])[-1] - w.simulate_without_effects([*scans, later])[-1]
    assert np.isfinite(difference).all()
    assert np.max(np.abs(difference)) < 300 * w.size * w.noise.rms
