"""The types of effect: where one acts, and what else is known of it, is its type.

| type | acts on |
|---|---|
| `AbstractDriveEffect` | the drive, before the operator |
| `AbstractLawEffect` | the numbers of a run that the operator's laws see: rate, amplitude, gain |
| `AbstractOpticalEffect` | the response, after the operator |
| `AbstractCouplingEffect` | the response, with the drive that was sent at hand |

An optical effect that switches where the response crosses thresholds is an `AbstractSwitch`. A
drive or optical effect that is linear and time-invariant is an `AbstractLinearEffect` too: it gives
its transfer function. One that is a sum of first-order lags is an `AbstractLagEffect`: it gives its
modes, and the recursion is shared. One that can be inverted is an `AbstractInvertible`.
"""

import abc
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Inexact, Int

from ._contribution import Contribution
from ._derived import Derived, ScanRange
from ._residual_summary import ResidualSummary

T = TypeVar("T")
SignatureAxis = Literal["phase", "since_turn", "drive", "response", "session", "gain"]


class AbstractEffect(eqx.Module):
    """A change of what the operator predicts, the identity at its default parameters.

    - `name`: in files and hypotheses, lower case with underscores.
    - `label`: what it is, in running text ("creep of the piezo"); by default the name with spaces.
    - `remedy`: what a user can do about it, in a sentence.
    - `smooth`: false where the response jumps as a parameter changes, so that a fit needs a search
      without derivatives before Gauss-Newton steps.
    - `mechanism`: the name of what causes it, by default its own; effects that are different
      equations of one cause share it.
    - `strength`: the parameters that say how strong it is, of which any one is enough; by default
      the first.
    - `signature_axis`: over what its signature is regular: the `phase` of the period, the time
      `since_turn` of the drive, the `drive` or the `response` itself, the time of the `session`, or
      the response's `gain` over the session. See `signature_period`, too.

    >>> from rapi_jax.effects import ALL
    >>> len(ALL), ALL[0].name
    (15, 'quantisation')
    """

    name: eqx.AbstractClassVar[str]
    label: ClassVar[str]
    remedy: ClassVar[str] = "Compensate with the corrected model."
    smooth: ClassVar[bool] = True
    mechanism: ClassVar[str]
    strength: ClassVar[tuple[str, ...]] = ()
    signature_axis: ClassVar[SignatureAxis] = "phase"

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "name" in vars(cls) and "label" not in vars(cls):
            cls.label = cls.name.replace("_", " ")
        if "name" in vars(cls) and "mechanism" not in vars(cls):
            cls.mechanism = cls.name

    @classmethod
    def at(cls: type[T], **values: Any) -> T:
        """The effect with these parameters, plain numbers or arrays, and the others' defaults."""
        return cls(**values)

    @classmethod
    def onset(cls: type[T], summary: ResidualSummary) -> T:
        """The effect where it is about to change a recording: by default, at its defaults."""
        del summary
        return cls()

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        """Quantities of the field that follow from the parameters; by default none."""
        del scan
        return ()

    def other_forms(self, here: Contribution) -> Sequence[Float[np.ndarray, "functions samples"]]:
        """Sets of functions that its mechanism may add, should this equation not be right.

        What all forms of it have in common defines them, such as a period in time, and no other
        mechanism may be a sum of them. A set explains a recording or not as a whole, and its sizes
        follow from it. By default none are known. `here`: what the effect adds by its equation.
        """
        del here
        return ()

    def signature_period(self) -> float | None:
        """Period of its signature along `signature_axis`; by default it has none."""
        return None

    @classmethod
    @abc.abstractmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[AbstractEffect]":
        """Effects from which a fit may start: a grid over what the residual could show.

        Each differs from the identity. Amplitudes are first guesses, which a fit scales. Parameters
        declared `held` keep the values given here.
        """


class AbstractDriveEffect(AbstractEffect):
    """Acts on the drive (V), before the operator.

    >>> from rapi_jax.effects import AbstractDriveEffect, ALL
    >>> [effect.name for effect in ALL if issubclass(effect, AbstractDriveEffect)]
    ['quantisation', 'slew_limit', 'saturation', 'amplifier_lowpass']
    """

    @abc.abstractmethod
    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        """The changed drive of one run; `t` is the session's time in s, not always even."""


class AbstractFollower(AbstractDriveEffect):
    """A drive effect whose state is its output, so that it can continue from any value.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import AbstractFollower, SlewLimit
    >>> limited = SlewLimit.at(limit=500.0)  # V/s
    >>> time, drive = jnp.arange(3.0) * 0.001, jnp.array([2.0, 2.0, 2.0])
    >>> limited.follow(time, drive, jnp.array(1.0)).tolist()  # from an output of 1 V
    [1.0, 1.5, 2.0]
    """

    @abc.abstractmethod
    def follow(
        self, t: Float[Array, " time"], u: Float[Array, " time"], start: Float[Array, ""]
    ) -> Float[Array, " time"]:
        """The changed drive of one run, `start` at its first sample."""

    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        """From rest at the first value."""
        return self.follow(t, u, u[0])


class AbstractOpticalEffect(AbstractEffect):
    """Acts on the response (GHz), after the operator.

    >>> from rapi_jax.effects import AbstractOpticalEffect, ALL
    >>> [effect.name for effect in ALL if issubclass(effect, AbstractOpticalEffect)]
    ['delay', 'creep', 'resonance', 'drift', 'mode_hop', 'etalon', 'pickup']
    """

    @abc.abstractmethod
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The changed response of one run; `t` is the session's time in s, not always even."""


class AbstractSwitch(AbstractOpticalEffect):
    """Adds `size` (GHz) while on; switches where the response crosses thresholds.

    No model of the response predicts the instant of a switch to a fraction of a sample.

    >>> from rapi_jax.effects import AbstractSwitch, ModeHop
    >>> isinstance(ModeHop(), AbstractSwitch)
    True
    """

    smooth: ClassVar[bool] = False
    size: eqx.AbstractVar[Float[Array, ""]]

    @abc.abstractmethod
    def with_states(
        self,
        nu: Float[np.ndarray, " samples"],
        on: Bool[np.ndarray, " samples"],
        run: Int[np.ndarray, " samples"],
    ) -> "AbstractSwitch":
        """The same effect with the thresholds that best reproduce the given states `on`.

        `nu`: the response before the effect, GHz, run after run; `run`: run number of each sample.
        """


class AbstractCouplingEffect(AbstractEffect):
    """Acts on the response (GHz), as a function of the drive that was sent.

    `steady`: whether the response to a periodic drive is periodic.

    >>> from rapi_jax.effects import AbstractCouplingEffect, CurrentCoupling
    >>> isinstance(CurrentCoupling(), AbstractCouplingEffect)
    True
    """

    steady: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"], u: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The changed response of one run; `u` (V) is the drive sent."""


class Law(NamedTuple):
    """The quantities of a run that Eq. 11 and the gain depend on.

    `freq`: scan rate, Hz. `u_pp`: peak-to-peak drive, V. `gain` multiplies the operator's response
    less its constant; `offset` (response unit) is added.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Law
    >>> law = Law.of(jnp.array(10.0), jnp.array(4.5))  # Hz, V peak to peak
    >>> float(law.gain), float(law.offset)  # the operator's own: 1 and 0
    (1.0, 0.0)
    """

    freq: Float[Array, ""]
    u_pp: Float[Array, ""]
    gain: Float[Array, ""]
    offset: Float[Array, ""]

    @classmethod
    def of(cls, freq: Float[Array, "*runs"], u_pp: Float[Array, "*runs"]) -> "Law":
        """Those of the operator alone: gain 1, offset 0."""
        return cls(freq, u_pp, jnp.ones_like(freq), jnp.zeros_like(freq))

    def after(
        self, response: Float[Array, "*time"], constant: Float[Array, ""]
    ) -> Float[Array, "*time"]:
        """The response with gain and offset applied; `constant` is the operator's own."""
        return constant + self.gain * (response - constant) + self.offset

    def before(
        self, response: Float[Array, "*time"], constant: Float[Array, ""]
    ) -> Float[Array, "*time"]:
        """The operator's response that `after` maps to `response`."""
        return constant + (response - constant - self.offset) / self.gain


class AbstractLawEffect(AbstractEffect):
    """Changes how thresholds and gain follow rate, amplitude and bias (Eq. 11).

    >>> from rapi_jax.effects import AbstractLawEffect, ALL
    >>> [effect.name for effect in ALL if issubclass(effect, AbstractLawEffect)]
    ['rate_law', 'amplitude_law']
    """

    @abc.abstractmethod
    def __call__(self, law: Law, bias: Float[Array, ""]) -> Law:
        """The changed numbers of one run; `bias` (V) is the middle of its drive."""


class Modes(NamedTuple):
    r"""A linear system as first-order lags: $x + \mathrm{Re}\sum_k c_k (L_k[x] - x)$.

    $L_k$ is the solution of $\tau_k \dot L = x - L$. With `tau` = 0 a mode passes its input; with
    weights 0 the system is the identity. At rest the output equals the input for any weights.

    `tau`: s, shape `modes`, real part not negative. `weight`: 1, shape `modes`. A pair of complex
    modes is named once, with twice the weight. Both real (which is faster) or both complex.

    >>> from rapi_jax.effects import AmplifierLowpass
    >>> modes = AmplifierLowpass.at(tau=1e-4).modes()
    >>> modes.tau.real.tolist(), modes.weight.real.tolist()  # s; 1
    ([0.0001], [1.0])
    """

    tau: Inexact[Array, " modes"]
    weight: Inexact[Array, " modes"]


class Past(NamedTuple):
    """The state before the runs of a session, of a linear effect whose memory outlasts a run.

    - `settled`: from rest (0) to a drive that has long been that of the first run (1), before it.
    - `rest`: the signal while nothing is driven, counted from the first run's first value, as a
      share of that run's range.
    - `lead_s`: for how long each run's drive has been on when its first sample is taken, after a
      rest; beyond `ALWAYS_ON_S` there is no rest: a run's drive is on from the end of the run
      before, and the first one's begins with its first sample.
    """

    settled: Float[Array, ""]
    rest: Float[Array, ""]
    lead_s: Float[Array, ""]

    @classmethod
    def of(cls, settled: float) -> "Past":
        """No rests between runs; `settled` before the first."""
        return cls(jnp.asarray(settled), jnp.zeros(()), jnp.asarray(2.0 * ALWAYS_ON_S))


ALWAYS_ON_S = 1e4


class AbstractLinearEffect(AbstractEffect):
    """A linear time-invariant effect; second base beside the type that says where it acts.

    >>> import numpy as np
    >>> from rapi_jax.effects import Delay
    >>> delayed = Delay.at(tau=1e-3).transfer(np.array([250.0]))  # Hz
    >>> round(float(np.degrees(np.angle(delayed[0]))), 6)
    -90.0
    """

    @abc.abstractmethod
    def transfer(self, hertz: Float[np.ndarray, " freq"]) -> Complex[np.ndarray, " freq"]:
        """The transfer function at frequencies in Hz, of concrete parameters."""


class AbstractLagEffect(AbstractLinearEffect):
    """A linear effect that is a sum of first-order lags, which share one recursion.

    `session`: whether its memory outlasts a run, so that the runs of a session are one history.

    >>> from rapi_jax.effects import Creep
    >>> Creep.at(gain=0.01).modes().tau.shape  # its first-order lags
    (8,)
    """

    session: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def modes(self) -> Modes:
        """Time constants and weights of the lags."""

    @abc.abstractmethod
    def past(self) -> Past:
        """The state before the runs, where the memory outlasts them."""

    def transfer(self, hertz: Float[np.ndarray, " freq"]) -> Complex[np.ndarray, " freq"]:
        modes = jax.tree_util.tree_map(np.asarray, _compiled_modes(self))
        return np.asarray(transfer(modes, hertz))


@jax.jit
def _compiled_modes(effect: AbstractLagEffect) -> Modes:
    return effect.modes()


class AbstractInvertible(eqx.Module):
    """An effect with an inverse, so that a drive can compensate for it.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Etalon
    >>> etalon, nu = Etalon.at(amplitude=0.3, spacing=5.0), jnp.linspace(0.0, 20.0, 9)  # GHz
    >>> bool(jnp.allclose(etalon.inverse(nu, etalon(nu, nu)), nu))
    True
    """

    @abc.abstractmethod
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal that this effect changes into `signal`: one period, repeated for ever.

        `t` is even. Raises `NotInvertible` where there is none.
        """


def transfer(modes: Modes, hertz: Float[Array | np.ndarray, " freq"]) -> Any:
    """The transfer function of `modes` at the given frequencies, Hz: of NumPy or JAX arrays."""
    tau, weight = modes.tau.astype(complex), modes.weight.astype(complex) / 2.0
    s = 2j * np.pi * hertz.astype(complex)
    lag = 1.0 / (1.0 + s[:, None] * tau[None, :]) - 1.0
    mirror = 1.0 / (1.0 + s[:, None] * tau.conj()[None, :]) - 1.0
    return 1.0 + lag @ weight + mirror @ weight.conj()
