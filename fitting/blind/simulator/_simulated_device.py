"""Simulated lasers with a recorded session, whose effects are withheld from a diagnosis.

Nothing here comes from the model or the estimator. A device is a function of its seed and of what
is asked for. Its random streams are apart: session, actuator, noise, effects and readings each have
their own, so a device with an effect and the null of its seed share session, actuator and, but for
its size, noise.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._noise import LEAST, MOST, Noise, draw_noise
from ._other_actuators import FAMILIES
from ._piezo import draw_other_form, draw_paper_form
from ._scan import Scan, draw_scans
from ._session_designs import draw_session
from ._signal_path import Effect, RunState, SignalPath, mean_at_crossings
from ._tangent import base_tangent
from .effects._kinds import MIX, SIGMA, makers, names_of
from .effects._recipe import Setting, log_uniform
from .effects._strength import NEAR, ScaledEffects, scale_to_size

Array = npt.NDArray[np.float64]
TICKS = 4000  # fewest a period of a session of many designs


@dataclass(frozen=True, eq=False)
class Run:
    """One recorded run, as a recording's manifest and CSV file hold it."""

    time_s: Array  # from 0
    drive: Array  # V
    response: Array  # GHz, with noise and rounding
    excitation_hz: float
    amplitude: float  # V, peak to peak
    waveform: str  # triangle, sine, other
    start_s: float  # on the session's clock
    scan: Scan  # the drive between its samples too


@dataclass(frozen=True, eq=False)
class SimulatedDevice:
    """A simulated laser, its recorded session, and the answer that is withheld."""

    name: str  # tells nothing of the answer
    seed: int
    kind: str  # null, listed, form, pair, unlisted
    truth: tuple[str, ...]  # names of effects, () for none, ("unlisted:stiction",)
    requested_size: float  # size asked for, in multiples of the noise; 0 for a null
    size: float  # size achieved: projected rms of the noise-free effect over the noise's rms
    single_sizes: tuple[float, ...]  # size of each effect by itself, in the order of `truth`
    parameters: dict[str, dict[str, Any]]  # of each effect
    base_misfit: bool  # whether the paper's operator can fit the base only nearly
    runs: tuple[Run, ...]
    noise_free: tuple[Array, ...]  # GHz, with the effects
    without: tuple[Array, ...]  # GHz, noise-free, without the effects
    noise: Noise
    signal_path: SignalPath

    def simulate(self, scans: Sequence[Scan]) -> list[Array]:
        """Noise-free frequencies in GHz for a session of any drives, recorded or new.

        `start_s` of each scan says where on the session's clock it lies; scans must be in order of
        time. What is fixed in absolute time goes on past the recorded session.
        """
        return self.signal_path.simulate(_in_order(scans))

    def simulate_without_effects(self, scans: Sequence[Scan]) -> list[Array]:
        """The same laser's answers without its effects, GHz."""
        signal_path = self.signal_path
        bare = SignalPath(signal_path.piezo, (), signal_path.oversample, signal_path.rest)
        return bare.simulate(_in_order(scans))

    def measure(self, scans: Sequence[Scan], seed: int) -> tuple[Run, ...]:
        """New readings with noise and rounding; the same `seed` gives the same noise."""
        rng = np.random.default_rng([self.seed, _READINGS, 1 + seed])
        return _read(scans, self.simulate(scans), self.noise, rng)


_SESSION, _PIEZO, _NOISE, _CHOICE, _EFFECT, _READINGS = range(6)


def draw_device(
    seed: int,
    kind: str | None = None,
    effect: str | None = None,
    sigma: float | None = None,
    *,
    base_misfit: bool | None = None,
    any_session: bool = False,
    hysteresis: str = "",
) -> SimulatedDevice:
    """The device of a seed; what is not asked for is drawn, in the mix of `_kinds.MIX`.

    `effect` is a name of `_kinds.names_of(kind)`, two names joined by `+` for a pair. `sigma` is
    the size in multiples of the noise; where no strength within the effect's physical range has it,
    the noise is scaled, within 5 to 30 MHz, and where that is not enough the nearest is taken;
    `SimulatedDevice.size` says what it is. `any_session`: of any design, see `draw_session`.
    `hysteresis`: a family of `FAMILIES` in place of the model's. Raises ValueError for unknown
    names.
    """
    choice = np.random.default_rng([seed, _CHOICE])
    drawn = str(choice.choice(list(MIX), p=list(MIX.values())))
    kind = drawn if kind is None else kind
    named = str(choice.choice(names_of(kind)))
    effect = named if effect is None else effect
    requested_size = log_uniform(choice, *SIGMA)
    misfit = bool(choice.random() < 0.5)
    requested_size = requested_size if sigma is None else float(sigma)
    misfit = misfit if base_misfit is None else base_misfit
    made = makers(kind, effect)

    draw = draw_session if any_session else draw_scans
    scans = draw(np.random.default_rng([seed, _SESSION]))
    rng = np.random.default_rng([seed, _PIEZO])
    oversample = int(rng.integers(8, 17))
    if any_session:  # of coarse samples a slew limit would be missed by as much as the noise
        oversample = max(oversample, math.ceil(TICKS / min(scan.samples for scan in scans)))
    if hysteresis and hysteresis not in FAMILIES:
        raise ValueError(
            f"Argument `hysteresis` must be one of {', '.join(FAMILIES)}, but it is {hysteresis!r}."
        )
    own = draw_other_form if misfit else draw_paper_form
    piezo = FAMILIES[hysteresis](rng) if hysteresis else own(rng)
    noise = draw_noise(np.random.default_rng([seed, _NOISE]))

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

        found = scale_to_size(np.random.default_rng([seed, _EFFECT]), made, setting, size)
        wanted = found.size / (requested_size * noise.rms)
        if abs(wanted - 1) > NEAR:
            least, most = LEAST / noise.rms, MOST / noise.rms
            noise = noise.scaled(float(np.clip(wanted, least, most)))
    signal_path = SignalPath(piezo, found.effects, oversample, rest)
    clean = tuple(_answers(signal_path, scans, known))
    readings = np.random.default_rng([seed, _READINGS, 0])
    return SimulatedDevice(
        name=f"world-{seed}",
        seed=seed,
        kind=kind,
        truth=tuple(effect.name for effect in found.effects),
        requested_size=requested_size if made else 0.0,
        size=found.size / noise.rms,
        single_sizes=tuple(part / noise.rms for part in found.single_sizes),
        parameters=found.parameters,
        base_misfit=misfit,
        runs=_read(scans, clean, noise, readings),
        noise_free=clean,
        without=without,
        noise=noise,
        signal_path=signal_path,
    )


def _answers(
    signal_path: SignalPath, scans: Sequence[Scan], known: Sequence[RunState]
) -> list[Array]:
    """Answers, with the hysteresis taken from `known` where the effects leave it as it is."""
    same = all(effect.after_hysteresis for effect in signal_path.effects)
    return signal_path.simulate(scans, known if same else None)


def _read(
    scans: Sequence[Scan], answers: Sequence[Array], noise: Noise, rng: np.random.Generator
) -> tuple[Run, ...]:
    return tuple(
        Run(
            time_s=scan.time_s,
            drive=scan.drive,
            response=noise.read(nu, rng, scan.step_s),
            excitation_hz=scan.rate_hz,
            amplitude=scan.swing,
            waveform=scan.waveform,
            start_s=scan.start_s,
            scan=scan,
        )
        for scan, nu in zip(scans, answers, strict=True)
    )


def _in_order(scans: Sequence[Scan]) -> Sequence[Scan]:
    for before, after in zip(scans, scans[1:], strict=False):
        if after.start_s < before.start_s + before.duration_s:
            raise ValueError(
                f"Argument `scans` must be in order of time, but the scan at {after.start_s} s "
                f"begins before the one at {before.start_s} s has ended. Place them with `placed`."
            )
    return scans
