"""What every effect is: a change of what the operator predicts."""

import abc
from collections.abc import Iterable
from typing import Any, ClassVar, Literal, TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Float

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
    - `in_reading_alone`: where the reading may show it though the light does not have it, and a
      drive would compensate it all the same: when that is so, in words that follow "where". Empty
      for others.
    - `smooth`: false where the response jumps as a parameter changes, so that a fit needs a search
      without derivatives before Gauss-Newton steps.
    - `pointwise`: whether a sample of the changed response follows, of all samples of the response,
      from that one alone, so that the derivative by the response is a factor for each sample. What
      it remembers of the drive, or of a threshold that was passed, has no such derivative.
    - `mechanism`: the name of what causes it, by default its own; effects that are different
      equations of one cause share it.
    - `strength`: the parameters that say how strong it is, of which any one is enough; by default
      the first.
    - `signature_axis`: over what its signature is regular: the `phase` of the period, the time
      `since_turn` of the drive, the `drive` or the `response` itself, the time of the `session`, or
      the response's `gain` over the session. See `signature_period`, too.
    - `free_of_drive`: whether what it adds does not depend on the drive, so that no more of its
      other forms repeats with the drive than by chance.

    >>> from rapi_jax.effects import ALL
    >>> len(ALL), ALL[0].name
    (15, 'quantisation')
    """

    name: eqx.AbstractClassVar[str]
    label: ClassVar[str]
    remedy: ClassVar[str] = "Compensate with the corrected model."
    in_reading_alone: ClassVar[str] = ""
    smooth: ClassVar[bool] = True
    pointwise: ClassVar[bool] = False
    mechanism: ClassVar[str]
    strength: ClassVar[tuple[str, ...]] = ()
    signature_axis: ClassVar[SignatureAxis] = "phase"
    free_of_drive: ClassVar[bool] = False

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

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """Sets of functions that its mechanism may add, should this equation not be right.

        What all forms of it have in common defines them, such as a period in time, and no other
        mechanism may be a sum of them. A set explains a recording or not as a whole, and its sizes
        follow from it. By default none are known. `here`: what the effect adds by its equation.
        """
        del here
        return ()

    def rival_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """Sets of functions that tell another mechanism from any form of this one.

        They stand in place of what the equation adds. Where such a set is likelier than all of
        `other_forms`, none of these is taken. By default none are known.
        """
        del here
        return ()

    def kind(self) -> str:
        """Of which kind it is, where it has several that no small step leads between; one here.

        Guesses of each kind are refitted apart.
        """
        return ""

    def log_prior(self) -> float:
        """Logarithm of how probable its values are beforehand, beside those its name suggests.

        0 here: none is odd. A diagnosis names an effect of odd values the less surely.
        """
        return 0.0

    def signature_period(self) -> float | None:
        """Period of its signature along `signature_axis`; by default it has none."""
        return None

    @classmethod
    def search_ranges(cls, summary: ResidualSummary) -> dict[str, tuple[float, float]]:
        """Least and greatest value of parameters that one recording allows less than all would.

        By name of the parameter; by default none.
        """
        del summary
        return {}

    @classmethod
    @abc.abstractmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[AbstractEffect]":
        """Effects from which a fit may start: a grid over what the residual could show.

        Each differs from the identity. Amplitudes are first guesses, which a fit scales. Parameters
        declared `held` keep the values given here.
        """
