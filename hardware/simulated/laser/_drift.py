"""Slow change of a device over a session: thermal random walks of its origin and its piezo."""

import dataclasses

import numpy as np

_STEP_S = 30.0  # nodes of the walk; straight between them, since a temperature has no jumps


@dataclasses.dataclass(frozen=True)
class State:
    """Where a device has drifted: origin (GHz), relative change of its gain and of its memory."""

    origin_ghz: float = 0.0
    gain: float = 0.0
    memory: float = 0.0

    def response(self, memory: np.ndarray, memoryless: np.ndarray) -> np.ndarray:
        """The drifted response from the two functions of Eq. 16, GHz."""
        return (1.0 + self.gain) * ((1.0 + self.memory) * memory + memoryless) + self.origin_ghz


@dataclasses.dataclass(frozen=True)
class Drift:
    """Random walks in session time, each given by its rms after one hour.

    - `origin_ghz`: of the optical frequency, GHz. A laser moves by about 30 GHz/K, so a mount that
      is held to tens of mK gives about 1 GHz in a session.
    - `gain`: of the whole response, relative. Piezo displacement changes by some 0.1 to 0.5 %/K.
    - `memory`: of the memory function's weights (Eq. 14) beside that, relative: the hysteresis.
    - `seed`: the walks are a function of session time and of this alone.

    The default is none.
    """

    origin_ghz: float = 0.0
    gain: float = 0.0
    memory: float = 0.0
    seed: int = 0

    @classmethod
    def laboratory(cls, seed: int = 0) -> "Drift":
        """A quiet laboratory: 0.5 GHz, 3e-4 and 1e-3 in one hour, for a temperature within 0.1 K.

        Over 120 minutes the memory's weights then move by about 0.14 %, which puts up to a few MHz
        of nonlinearity into a compensated scan: of the size of the paper's Fig. 11, or below.
        """
        return cls(0.5, 3e-4, 1e-3, seed)

    def at(self, session_s: float) -> State:
        """The state at a session time (s from its start); before it, none."""
        sizes = np.array([self.origin_ghz, self.gain, self.memory])
        if not sizes.any() or session_s <= 0:
            return State()
        place = session_s / _STEP_S
        nodes = int(place) + 1
        # Rows are drawn in order, so a longer walk begins like a shorter one of the same seed.
        steps = np.random.default_rng(self.seed).standard_normal((nodes, 3))
        scale = sizes * np.sqrt(_STEP_S / 3600.0)
        whole = steps[:-1].sum(axis=0) + steps[-1] * (place - (nodes - 1))
        return State(*(float(x) for x in whole * scale))
