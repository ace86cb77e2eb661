"""The light path of a simulated laser, run after run on one clock, oversampled.

Order: command, effects on the drive, hysteresis, effects on the displacement, effects on the
light; within one kind as the effects are listed, and `ORDER` says in which order the generator
lists them. Each run's drive has been on for a lead-in of at least 0.1 s and two whole periods
before the first sample. Before the session and between runs the displacement rests at `rest`: the
middle of the first run's loop at that run's bias.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ._other_hysteresis import Actuator
from ._scan import Scan

Array = npt.NDArray[np.float64]
LEAD_S = 0.1


@dataclass
class RunState:
    """What an effect may know of the run it acts on; arrays are on the fine clock."""

    scan: Scan
    number: int  # of the run
    t: Array  # session time, s
    step: float  # s
    command: Array  # V
    drive: Array  # V, after the effects on the drive
    operator_response: Array  # GHz, the operator's output
    hysteresis_part: Array  # GHz, the hysteretic part of it
    rest: float  # GHz, the response at rest
    earlier: Scan | None  # the run before
    cycles: float  # periods driven before this run
    state: dict[str, Any] = field(default_factory=dict)  # carried from run to run


Law = Callable[[Array, RunState], Array]


@dataclass(frozen=True)
class Effect:
    """One effect: what it does to the actuator's laws, the drive, the displacement, the light."""

    name: str
    law: Callable[[Any], Actuator] | None = None  # of a `Piezo`
    drive: Law | None = None
    displacement: Law | None = None
    light: Law | None = None

    @property
    def after_hysteresis(self) -> bool:
        """Whether the hysteresis is as without the effect."""
        return self.law is None and self.drive is None


ORDER = ("gain_drift", "drift", "current_coupling", "mode_hop", "etalon", "pickup")


@dataclass(frozen=True)
class SignalPath:
    """A laser with its effects."""

    piezo: Actuator
    effects: tuple[Effect, ...]
    oversample: int
    rest: float  # GHz

    def path(
        self, scans: Sequence[Scan], known: Sequence[RunState] | None = None
    ) -> list[RunState]:
        """Each run up to the operator's output, with `known` ones of the same laws."""
        if known is not None:
            return list(known)
        piezo = self.piezo
        for effect in self.effects:
            piezo = effect.law(piezo) if effect.law else piezo
        moments, earlier, cycles = [], None, 0.0
        for number, scan in enumerate(scans):
            lead = max(2, math.ceil(LEAD_S * scan.rate_hz))
            step = scan.step_s / self.oversample
            first = -lead * scan.samples * self.oversample
            last = (scan.periods * scan.samples - 1) * self.oversample
            local = np.arange(first, last + 1, dtype=float) * float(step)
            command = drive_with_corners(scan, local, self.oversample)
            moment = RunState(
                scan, number, scan.start_s + local, step, command, command, command, command,
                self.rest, earlier, cycles,
            )  # fmt: skip
            for effect in self.effects:
                moment.drive = effect.drive(moment.drive, moment) if effect.drive else moment.drive
            moment.operator_response, moment.hysteresis_part = piezo.respond(
                moment.drive, scan.rate_hz, scan.swing
            )
            moments.append(moment)
            earlier, cycles = scan, cycles + lead + scan.periods
        return moments

    def simulate(
        self, scans: Sequence[Scan], known: Sequence[RunState] | None = None
    ) -> list[Array]:
        """Frequency in GHz at the samples of each run, without noise."""
        answers, state = [], {}
        for moment in self.path(scans, known):
            nu, now = moment.operator_response, replace(moment, state=state)
            for act in ("displacement", "light"):
                for effect in self.effects:
                    law = getattr(effect, act)
                    nu = law(nu, now) if law else nu
            count = moment.scan.periods * moment.scan.samples
            answers.append(nu[:: self.oversample][-count:].copy())
        return answers


def drive_with_corners(scan: Scan, local: Array, oversample: int) -> Array:
    """The drive on the fine clock, with its sharp turning points that lie between its ticks.

    The tick next to each takes the extreme value, but for ticks that are samples. Missing it by a
    fraction of a tick, plays would turn a millivolt early.
    """
    command = scan.voltage(local)
    step = float(local[1] - local[0])
    for phase, extreme in _sharp_turns(scan):
        first = np.ceil(scan.rate_hz * local[0] + scan.phase - phase)
        last = np.floor(scan.rate_hz * local[-1] + scan.phase - phase)
        at = (np.arange(first, last + 1) + phase - scan.phase) / scan.rate_hz
        place = (at - local[0]) / step
        near = np.rint(place)
        off = place - near
        missed = np.abs(off) > 1e-6
        near += np.where(near % oversample == 0, np.sign(off), 0.0)
        inside = missed & (near >= 0) & (near < len(local))
        command[near[inside].astype(int)] = extreme
    return command


def _sharp_turns(scan: Scan) -> list[tuple[float, float]]:
    """Phases at which the drive turns at a corner, and its value there, V; none on a plateau."""
    if scan.table is not None:
        size = len(scan.table)
        ends = [int(np.argmin(scan.table)), int(np.argmax(scan.table))]
        same = 1e-9 * float(np.ptp(scan.table))
        return [
            (at / size, float(scan.table[at]))
            for at in ends
            if np.count_nonzero(np.abs(scan.table - scan.table[at]) <= same) == 1
        ]
    if scan.waveform == "triangle":
        return [(0.0, scan.bias - scan.swing / 2), (0.5, scan.bias + scan.swing / 2)]
    return []


def mean_at_crossings(operator_response: Array, drive: Array, volts: float) -> float:
    """Mean response in GHz where the drive crosses `volts`, over both directions."""
    above = drive >= volts
    crossed = np.flatnonzero(above[1:] != above[:-1])
    if len(crossed) == 0:
        return float(np.mean(operator_response))
    part = (volts - drive[crossed]) / (drive[crossed + 1] - drive[crossed])
    values = operator_response[crossed] + part * (
        operator_response[crossed + 1] - operator_response[crossed]
    )
    rising = above[crossed + 1]
    sides = [float(np.mean(v)) for v in (values[rising], values[~rising]) if len(v)]
    return sum(sides) / len(sides)
