"""A session of a simulated laser, with effects of the size asked for."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._noise import LEAST, MOST, Noise, draw_noise
from ._other_actuators import FAMILIES
from ._piezo import draw_other_form, draw_paper_form
from ._scan import Scan, draw_scans
from ._session_designs import draw_session
from ._signal_path import Effect, RunState, SignalPath, mean_at_crossings
from ._tangent import base_tangent
from .effects._recipe import Setting
from .effects._strength import NEAR, Maker, ScaledEffects, scale_to_size

Array = npt.NDArray[np.float64]
TICKS = 4000  # fewest a period of a session of many designs
SESSION, PIEZO, NOISE, CHOICE, EFFECT, READINGS = range(6)
"""Random streams of a seed."""


@dataclass(frozen=True, eq=False)
class DrawnSession:
    """A session of a laser with its effects, before it is read.

    `noise_free`, `without`: frequencies in GHz with the effects, and without them.
    """

    scans: Sequence[Scan]
    found: ScaledEffects
    noise: Noise
    signal_path: SignalPath
    noise_free: tuple[Array, ...]
    without: tuple[Array, ...]

    @property
    def least_size(self) -> float:
        """Of the smallest effect by itself, in multiples of the noise."""
        return min(self.found.single_sizes, default=0.0) / self.noise.rms


def session_of(
    seed: int,
    made: Sequence[Maker],
    requested_size: float,
    again: int,
    misfit: bool,
    any_session: bool,
    hysteresis: str,
) -> DrawnSession:
    """The device in the session of its seed, or in another: the `again`-th after it."""
    more = [again] if again else []
    draw = draw_session if any_session else draw_scans
    scans = draw(np.random.default_rng([seed, SESSION, *more]))
    rng = np.random.default_rng([seed, PIEZO])
    oversample = int(rng.integers(8, 17))
    if any_session:  # of coarse samples a slew limit would be missed by as much as the noise
        oversample = max(oversample, math.ceil(TICKS / min(scan.samples for scan in scans)))
    own = draw_other_form if misfit else draw_paper_form
    piezo = FAMILIES[hysteresis](rng) if hysteresis else own(rng)
    noise = draw_noise(np.random.default_rng([seed, NOISE]))

    bare = SignalPath(piezo, (), oversample, 0.0)
    known = bare.path(scans)
    first = known[0]
    rest = mean_at_crossings(first.operator_response, first.drive, first.scan.bias)
    bare = SignalPath(piezo, (), oversample, rest)
    known = bare.path(scans)
    without = tuple(bare.simulate(scans, known))
    found = ScaledEffects((), {}, 0.0, ())
    if made:
        setting = Setting(scans, without, rest, requested_size * noise.rms)
        space = base_tangent(piezo, scans, oversample)

        def size(effects: tuple[Effect, ...]) -> float:
            answers = _answers(SignalPath(piezo, effects, oversample, rest), scans, known)
            return space.left([a - b for a, b in zip(answers, without, strict=True)])

        found = scale_to_size(np.random.default_rng([seed, EFFECT, *more]), made, setting, size)
        wanted = found.size / (requested_size * noise.rms)
        if abs(wanted - 1) > NEAR:
            least, most = LEAST / noise.rms, MOST / noise.rms
            noise = noise.scaled(float(np.clip(wanted, least, most)))
    signal_path = SignalPath(piezo, found.effects, oversample, rest)
    clean = tuple(_answers(signal_path, scans, known))
    return DrawnSession(scans, found, noise, signal_path, clean, without)


def _answers(
    signal_path: SignalPath, scans: Sequence[Scan], known: Sequence[RunState]
) -> list[Array]:
    """Answers, with the hysteresis taken from `known` where the effects leave it as it is."""
    same = all(effect.after_hysteresis for effect in signal_path.effects)
    return signal_path.simulate(scans, known if same else None)
