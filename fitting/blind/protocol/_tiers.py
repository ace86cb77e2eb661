"""Tiers of banks: which devices each holds, and which effect is withheld from the candidates."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.blind.simulator._bank import LARGE, Spec, bank
from fitting.blind.simulator._other_actuators import FAMILIES
from fitting.blind.simulator.effects._kinds import LISTED, SIGMA

SEEDS = {
    "open": 1,
    "calibration": 2,
    "nulls": 3,
    "withheld": 4,
    "sessions": 5,
    "seen": 6,
    "hysteresis": 7,
}
TIERS = (*SEEDS, "sealed")
LAWS = ("amplitude_law", "rate_law")  # of the paper's thresholds, which others do not have
FIRST, SEEN, UNSEEN = 1, 2, 3  # editions of forms and unlisted effects


@dataclass(frozen=True)
class BankEntry:
    """A device to be simulated, and the effect that is taken from its diagnosis' candidates."""

    spec: Spec
    withheld: str | None

    @property
    def name(self) -> str:
        """As its device's."""
        return f"world-{self.spec.seed}"


def bank_entries(tier: str, seed: int, count: int) -> list[BankEntry]:
    """The devices of a tier, in an order that tells nothing.

    `open`, `calibration` and `sealed` hold all kinds; `nulls` no effect, every other one with base
    misfit; `withheld` each listed effect in turn at 4 to 20 times the noise; `hysteresis` actuators
    of families that are none of the model's, in turn, every other one with a listed effect of 4 to
    20 times the noise that is not itself a law of thresholds. `sessions` holds all
    kinds in sessions of many designs, see `draw_session`. `seen` holds all kinds, with the second
    set of forms and unlisted effects, once unseen, in place of the first: for development. Half of
    the sealed bank's forms and unlisted effects are of the third set, which no other tier holds, so
    that what was developed and calibrated on the others is examined on what nobody has looked at;
    every other one of its devices, and of those of `nulls`, is recorded in a session of any design.
    """
    if tier not in TIERS:
        raise ValueError(f"Argument `tier` must be one of {', '.join(TIERS)}, but it is {tier!r}.")
    if count < 1:
        raise ValueError(f"Argument `count` must be 1 or more, but it is {count}.")
    if tier == "nulls":
        return [BankEntry(spec, None) for spec in _null_specs(seed, count)]
    if tier == "withheld":
        return [BankEntry(spec, spec.effect) for spec in _withheld_specs(seed, count)]
    if tier == "hysteresis":
        return [BankEntry(spec, None) for spec in _hysteresis_specs(seed, count)]
    edition = SEEN if tier == "seen" else FIRST
    drawn = bank(seed, count, edition=edition, unseen=UNSEEN if tier == "sealed" else None)
    if tier == "sessions":
        drawn = [replace(spec, any_session=True) for spec in drawn]
    if tier == "sealed":  # in the order of the list, which is drawn, so apart from kind and misfit
        drawn = [replace(spec, any_session=k % 2 == 1) for k, spec in enumerate(drawn)]
    return [BankEntry(spec, None) for spec in drawn]


def _null_specs(seed: int, count: int) -> list[Spec]:
    rng = np.random.default_rng([seed, 2])
    seeds = _distinct_seeds(rng, seed, count)
    misfit = rng.permutation(np.arange(count) % 2 == 0).tolist()
    return [
        Spec(device, "null", "", 0.0, bends, any_session=k % 2 == 1)
        for k, (device, bends) in enumerate(zip(seeds, misfit, strict=True))
    ]


def _withheld_specs(seed: int, count: int) -> list[Spec]:
    rng = np.random.default_rng([seed, 3])
    names = rng.permutation(sorted(LISTED)).tolist()
    specs = []
    for k, device in enumerate(_distinct_seeds(rng, seed, count)):
        turn, place = divmod(k, len(names))
        sigma = float(np.exp(rng.uniform(*np.log((LARGE, SIGMA[1])))))
        misfit = (place + turn) % 2 == 0
        specs.append(Spec(device, "listed", names[place], round(sigma, 3), misfit))
    return [specs[k] for k in rng.permutation(count).tolist()]


def _hysteresis_specs(seed: int, count: int) -> list[Spec]:
    rng = np.random.default_rng([seed, 4])
    names = rng.permutation([name for name in sorted(LISTED) if name not in LAWS]).tolist()
    families = sorted(FAMILIES)
    specs = []
    for k, device in enumerate(_distinct_seeds(rng, seed, count)):
        family = families[k // 2 % len(families)]
        sigma = float(np.exp(rng.uniform(*np.log((LARGE, SIGMA[1])))))
        effect = names[k // 2 % len(names)] if k % 2 else ""
        kind, sigma = ("listed", round(sigma, 3)) if effect else ("null", 0.0)
        specs.append(Spec(device, kind, effect, sigma, False, hysteresis=family))
    return [specs[k] for k in rng.permutation(count).tolist()]


def _distinct_seeds(rng: np.random.Generator, seed: int, count: int) -> list[int]:
    """Distinct seeds of devices."""
    drawn = np.random.SeedSequence([seed, 1]).generate_state(2 * count + 8, np.uint32)
    return rng.permutation(np.unique(drawn))[:count].tolist()
