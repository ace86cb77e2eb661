"""Banks: specifications of many devices, in a stratified mix of kinds, effects and sizes."""

from dataclasses import dataclass

import numpy as np

from ._simulated_device import SimulatedDevice, draw_device
from .effects._kinds import MIX, SIGMA, names_of

LARGE = 4.0  # multiples of the noise; what a diagnosis is expected to name


@dataclass(frozen=True)
class Spec:
    """A device that has not been simulated yet."""

    seed: int
    kind: str
    effect: str  # "" for a null
    sigma: float  # 0 for a null
    base_misfit: bool
    any_session: bool = False  # see `draw_device`
    hysteresis: str = ""  # likewise

    def draw(self) -> SimulatedDevice:
        """The device."""
        sigma = self.sigma if self.kind != "null" else None
        return draw_device(
            self.seed,
            self.kind,
            self.effect,
            sigma,
            base_misfit=self.base_misfit,
            any_session=self.any_session,
            hysteresis=self.hysteresis,
        )


UNSEEN = {"form": 2, "unlisted": 2}
"""One in how many devices of a kind has an unseen effect, where a bank has any; rounded down."""


def bank(seed: int, count: int = 200, *, edition: int = 1, unseen: int | None = None) -> list[Spec]:
    """`count` devices in an order that tells nothing.

    Kinds in the parts of `_kinds.MIX`; within a kind all effects in turn, with and without base
    misfit in turn, three of four at 4 to 20 sigma and one at 0.5 to 4 (pairs all at 4 to 20). Of
    200, 44 are nulls, 60 single listed effects (each of fifteen four times, thrice large), 24
    other forms, 26 pairs and 46 unlisted.

    `edition`: of the other forms and of the unlisted effects, see `_kinds.EDITIONS`. `unseen`: an
    edition from which half of either kind's devices have theirs instead, by the same rules; the
    spec's `effect` tells.
    """
    rng = np.random.default_rng([seed, 1])
    seeds = np.unique(np.random.SeedSequence(seed).generate_state(2 * count + 8, np.uint32))
    free = rng.permutation(seeds)[:count].tolist()
    specs = []
    for kind, number in _numbers(count).items():
        various = kind in UNSEEN
        new = number // UNSEEN[kind] if various and unseen is not None else 0
        names = rng.permutation(names_of(kind, edition=edition if various else 1)).tolist()
        places = [(names[k % len(names)], *divmod(k, len(names))) for k in range(number - new)]
        if unseen is not None and new:
            names = rng.permutation(names_of(kind, edition=unseen)).tolist()
            places += [(names[k % len(names)], *divmod(k, len(names))) for k in range(new)]
        for effect, turn, place in places:
            large = kind == "pair" or (place + turn) % 4 != 0
            ends = (LARGE, SIGMA[1]) if large else (SIGMA[0], LARGE)
            sigma = float(np.exp(rng.uniform(*np.log(ends))))
            specs.append(
                Spec(
                    seed=int(free.pop()),
                    kind=kind,
                    effect=effect,
                    sigma=0.0 if kind == "null" else round(sigma, 3),
                    base_misfit=(place // 2 + turn) % 2 == 0,
                )
            )
    return [specs[k] for k in rng.permutation(len(specs)).tolist()]


def _numbers(count: int) -> dict[str, int]:
    """How many of each kind: the parts of the mix, rounded so that they add up."""
    numbers = {kind: int(part * count) for kind, part in MIX.items()}
    late = sorted(MIX, key=lambda kind: numbers[kind] - MIX[kind] * count)
    for kind in late[: count - sum(numbers.values())]:
        numbers[kind] += 1
    return numbers
