"""Simulated lasers with a recorded session, whose effects are withheld from a diagnosis.

Nothing here comes from the model or the estimator. A device is a function of its seed and of what
is asked for. Its random streams are apart: session, actuator, noise, effects and readings each have
their own, so a device with an effect and the null of its seed share session, actuator and, but for
its size, noise. Where a session cannot show one of two effects, another is drawn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._drawn_session import CHOICE, READINGS, DrawnSession, session_of
from ._noise import Noise
from ._other_actuators import FAMILIES
from ._scan import Scan
from ._signal_path import SignalPath
from .effects._kinds import MIX, SIGMA, makers, names_of
from .effects._recipe import log_uniform

Array = npt.NDArray[np.float64]
SHOWN = 2.0  # multiples of the noise; of two effects each has to reach it, or need not be named
SESSIONS = 8  # drawn at most, until one shows both


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
        rng = np.random.default_rng([self.seed, READINGS, 1 + seed])
        return _read(scans, self.simulate(scans), self.noise, rng)


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
    `SimulatedDevice.size` says what it is. Each of a pair is to be of `SHOWN` by itself: where it
    is not (a law of thresholds with scan rate at one rate), other sessions are drawn, `SESSIONS` at
    most, and the best is kept. `any_session`: of any design, see `draw_session`.
    `hysteresis`: a family of `FAMILIES` in place of the model's. Raises ValueError for unknown
    names.
    """
    choice = np.random.default_rng([seed, CHOICE])
    drawn = str(choice.choice(list(MIX), p=list(MIX.values())))
    kind = drawn if kind is None else kind
    named = str(choice.choice(names_of(kind)))
    effect = named if effect is None else effect
    requested_size = log_uniform(choice, *SIGMA)
    misfit = bool(choice.random() < 0.5)
    requested_size = requested_size if sigma is None else float(sigma)
    misfit = misfit if base_misfit is None else base_misfit
    made = makers(kind, effect)

    if hysteresis and hysteresis not in FAMILIES:
        raise ValueError(
            f"Argument `hysteresis` must be one of {', '.join(FAMILIES)}, but it is {hysteresis!r}."
        )
    best: DrawnSession | None = None
    for again in range(SESSIONS):
        one = session_of(seed, made, requested_size, again, misfit, any_session, hysteresis)
        if best is None or one.least_size > best.least_size:
            best = one
        if len(made) < 2 or best.least_size >= SHOWN:
            break
    assert best is not None  # noqa: S101
    found, noise = best.found, best.noise
    readings = np.random.default_rng([seed, READINGS, 0])
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
        runs=_read(best.scans, best.noise_free, noise, readings),
        noise_free=best.noise_free,
        without=best.without,
        noise=noise,
        signal_path=best.signal_path,
    )


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
