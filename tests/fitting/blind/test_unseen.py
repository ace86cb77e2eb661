"""Second and third sets of forms and unlisted effects: where they are drawn, and what they are.

Cases are numbered and tests named by the listed effect, so that a list of tests says no more.
"""

import dataclasses
import functools
import hashlib
import json
from collections import Counter

import numpy as np
import pytest

from fitting.blind.protocol._answers import answer_bytes, answer_record, read_spec
from fitting.blind.protocol._tiers import SEEDS, TIERS, bank_entries
from fitting.blind.simulator._bank import bank
from fitting.blind.simulator._scan import draw_scans
from fitting.blind.simulator._simulated_device import SimulatedDevice, draw_device
from fitting.blind.simulator.effects._kinds import EDITIONS, LISTED, makers, names_of
from fitting.blind.simulator.effects._recipe import Setting

KINDS = ("form", "unlisted")
NEW = [(kind, name) for n in (2, 3) for kind in KINDS for name in names_of(kind, edition=n)]


@functools.cache
def world(kind: str, name: str, seed: int = 5, sigma: float = 6.0) -> SimulatedDevice:
    return draw_device(seed, kind, name, sigma)


def parts(w: SimulatedDevice) -> list[np.ndarray]:
    return [a - b for a, b in zip(w.noise_free, w.without, strict=True)]


def test_a_bank_without_them_is_the_one_it_always_was():
    # The digests are older than two fields, for neither of which such a bank ever asks.
    specs = [[dataclasses.asdict(s) for s in bank(seed, 200)] for seed in (1, 2)]
    assert not any(s.pop(new) for of in specs for s in of for new in ("any_session", "hysteresis"))
    digests = [hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest() for of in specs]
    assert digests == [
        "50d84f8fa47bb7b2b5640de1ed9c23b5c2de6186b18dfc64b8756016a1f8fb3c",
        "0cdeda92c5257152dbb9838c3ffc8cf74ef3edad6a1c98ad558e4d859d05f887",
    ]


def edition(spec) -> int:
    (found,) = (n for n in EDITIONS if spec.effect in names_of(spec.kind, edition=n))
    return found


@pytest.mark.parametrize("count", [0, 1, 40, 200, 333])
def test_a_bank_with_unseen_ones_holds_half_of_the_forms_and_of_the_unlisted(count):
    specs, known = bank(7, count, unseen=3), bank(7, count)
    assert specs == bank(7, count, unseen=3) and len(specs) == count
    assert len({s.seed for s in specs}) == count
    assert Counter(s.kind for s in specs) == Counter(s.kind for s in known)
    for kind in KINDS:
        of = [edition(s) for s in specs if s.kind == kind]
        assert of.count(3) == len(of) // 2 and of.count(1) == len(of) - of.count(3)
    assert {edition(s) for s in known} <= {1}
    assert {edition(s) for s in specs if s.kind not in KINDS} <= {1}


@pytest.mark.parametrize(("options", "number"), [({"unseen": 3}, 3), ({"edition": 2}, 2)])
def test_they_come_in_turn_at_all_sizes_with_and_without_base_misfit(options, number):
    specs = [s for s in bank(7, 400, **options) if edition(s) == number]
    times = Counter((s.kind, s.effect) for s in specs)
    for kind in KINDS:
        of = [times[kind, name] for name in names_of(kind, edition=number)]
        assert min(of) >= 1 and max(of) - min(of) <= 1
    assert {s.base_misfit for s in specs} == {True, False}
    large = np.mean([s.sigma >= 4 for s in specs])
    assert 0.6 < large < 0.9


@pytest.mark.parametrize("tier", TIERS)
def test_each_tier_draws_its_own(tier):
    of = {n: {e.spec.kind for e in drawn} for n, drawn in by_edition(tier).items()}
    assert of.get(3, set()) == (set(KINDS) if tier == "sealed" else set())
    assert of.get(2, set()) == (set(KINDS) if tier == "seen" else set())
    assert not of[1] & set(KINDS) if tier == "seen" else 1 in of


def by_edition(tier: str) -> dict[int, list]:
    entries = bank_entries(tier, 5, 60)
    return {n: some for n in EDITIONS if (some := [e for e in entries if edition(e.spec) == n])}


def test_the_tier_of_those_once_unseen_holds_all_kinds_and_its_answers_draw_the_same_devices():
    entries = bank_entries("seen", SEEDS["seen"], 200)
    numbers = Counter(e.spec.kind for e in entries)
    assert numbers == Counter(e.spec.kind for e in bank_entries("open", SEEDS["open"], 200))
    assert len(set(SEEDS.values())) == len(SEEDS)
    spec = next(e.spec for e in entries if e.spec.kind == "form")
    device = spec.draw()
    assert device.truth == (spec.effect.removesuffix("/2"),)
    again = read_spec(json.loads(answer_bytes(answer_record(spec, device, "0")))).draw()
    for a, b in zip(again.runs, device.runs, strict=True):
        np.testing.assert_array_equal(a.response, b.response)


def test_names_tell_them_apart_and_truths_are_the_listed_ones():
    for n, forms, unlisted in ((2, 10, 4), (3, 8, 8)):
        names = names_of("form", edition=n)
        assert len(names) >= forms and len(names_of("unlisted", edition=n)) >= unlisted
        assert all(name.split("/")[0] in LISTED and name[-2:] == f"/{n}" for name in names)
        for kind in ("null", "listed", "pair"):
            assert names_of(kind, edition=n) == []
    for kind in KINDS:
        every = [name for n in EDITIONS for name in names_of(kind, edition=n)]
        assert len(every) == len(set(every))
    with pytest.raises(ValueError, match="Argument `kind` must be one of"):
        names_of("other", edition=3)
    with pytest.raises(ValueError, match="Argument `edition` must be one of 1, 2, 3, but it is 4"):
        names_of("form", edition=4)


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
