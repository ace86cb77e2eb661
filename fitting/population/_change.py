"""What a new recording has changed since a population was recorded."""

import dataclasses
from typing import Any

import numpy as np

from fitting._json import replace_nonfinite

from ._thresholds import THRESHOLDS

SCHEMA = "rapi.change/1"
NONE, SEVERAL = "none", "several"


@dataclasses.dataclass(frozen=True)
class ParameterChange:
    """One parameter of a new recording beside what the population predicts; NaN: no estimate.

    - `expected`, `expected_stderr`: for a recording at that time and temperature, the scatter
      between recordings included; `expected_at_mean`: the same at the population's mean
      temperature. `measured`, `stderr`: by its own fit.
    - `p_value`: of the difference by itself; `p_holm`: for all parameters together.
    - `change`, `change_stderr`: of this parameter, if all others are as before; `p_given_others`
      of it, and for all parameters together.
    - `probability`: that this parameter changed, and it alone.
    """

    name: str
    unit: str
    expected: float
    expected_stderr: float
    expected_at_mean: float
    measured: float
    stderr: float
    p_value: float
    p_holm: float
    change: float
    change_stderr: float
    p_given_others: float
    p_given_others_holm: float
    probability: float

    @property
    def amount(self) -> str:
        """The change in words: in per cent of what was expected, or where that is near 0 in units.

        Near is less than three standard errors.
        """
        if abs(self.expected) > 3.0 * self.expected_stderr:
            return f"{100.0 * self.change / abs(self.expected):+.2g} %"
        return f"{self.change:+.2g} {'' if self.unit == '1' else self.unit}".strip()


@dataclasses.dataclass(frozen=True)
class Change:
    """A new recording against a population; see `check_against`.

    - `p_value`: of all parameters together, `statistic` by F on `degrees`; uniform where nothing
      changed.
    - `p_change`: the smaller of that and of each parameter given the others, for both: what
      `changed` is decided by.
    - `probabilities`: of "none", each parameter alone, and "several"; they sum to 1.
    - `days`: when it was recorded, since the population's first; `None` where that is not known.
    - `set`: given a change, the most probable ones that hold 95 % together.

    >>> from fitting import Change
    >>> odds = {"none": 0.97, "alpha": 0.02, "several": 0.01}
    >>> friday = Change("friday", 0.4, 1.1, (9.0, 40.0), 0.6, False, (), odds, (), ())
    >>> friday.changed, friday.probabilities["none"]
    (False, 0.97)
    """

    label: str
    p_value: float
    statistic: float
    degrees: tuple[float, float]
    p_change: float
    changed: bool
    parameters: tuple[ParameterChange, ...]
    probabilities: dict[str, float]
    set: tuple[str, ...]
    notes: tuple[str, ...]
    days: float | None = None

    def __getitem__(self, name: str) -> ParameterChange:
        """The parameter `name`."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        names = ", ".join(p.name for p in self.parameters)
        raise KeyError(f"no parameter {name!r}; there are {names}")

    @property
    def sentence(self) -> str:
        """What changed and how sure that is, in one sentence."""
        sure = f"(p = {self.p_change:.2g})"
        if not self.changed:
            return f"unchanged: as the population predicts {sure}"
        singles = [name for name in self.set if name != SEVERAL]
        if self.set[0] == SEVERAL:
            moved = [p for p in self.parameters if p.p_holm < THRESHOLDS.change_level]
            named = ", ".join(f"`{p.name}` by {_difference(p)}" for p in moved)
            return f"changed since: several parameters{': ' if named else ''}{named} {sure}"
        more = "; perhaps others with it" if SEVERAL in self.set else "; all else as before"
        if len(singles) == 1:
            one = self[singles[0]]
            return f"changed since: `{one.name}` by {one.amount} {sure}{more}"
        ways = " or ".join(f"`{self[name].name}` by {self[name].amount}" for name in singles)
        return f"changed since: {ways}, which this recording cannot tell apart {sure}{more}"

    def __str__(self) -> str:
        return self.sentence

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for a file (schema `rapi.change/1`)."""
        return replace_nonfinite(
            {
                "schema": SCHEMA,
                "recording": self.label,
                "days": self.days,
                "sentence": self.sentence,
                "changed": self.changed,
                "p_change": self.p_change,
                "p_value": self.p_value,
                "statistic": self.statistic,
                "degrees": list(self.degrees),
                "probabilities": self.probabilities,
                "set": list(self.set),
                "parameters": {
                    p.name: {k: v for k, v in dataclasses.asdict(p).items() if k != "name"}
                    for p in self.parameters
                },
                "notes": list(self.notes),
            }
        )


def _difference(p: ParameterChange) -> str:
    """Measured less expected, which is the change where several parameters did."""
    return dataclasses.replace(p, change=p.measured - p.expected).amount


def change_probabilities(
    names: list[str], z: np.ndarray, statistic: float, wishart: float
) -> dict[str, float]:
    r"""Probabilities that nothing, one parameter alone, or several changed.

    Given a change of parameter $j$ by $\delta$ the difference is $d \sim N(\delta e_j, V)$, and
    $z_j = (V^{-1}d)_j / \sqrt{(V^{-1})_{jj}}$ is its estimate in standard errors. A priori
    $\delta \sim N(0, \kappa^2)$ in these, $\kappa$ one of `change_sizes`; several are $d \sim
    N(0, (1 + \kappa^2) V)$. `wishart`: degrees of freedom of $V$: tails are Student's.
    """
    size = z.size
    grow = 1.0 + np.asarray(THRESHOLDS.change_sizes) ** 2
    several = THRESHOLDS.prior_several if size > 1 else 0.0
    single = (1.0 - THRESHOLDS.prior_none - several) / size

    def log_density(distance: Any) -> Any:
        if not np.isfinite(wishart):
            return -0.5 * distance
        return -0.5 * (wishart + size) * np.log1p(distance / wishart)

    def average(logs: np.ndarray) -> Any:
        return np.logaddexp.reduce(logs, axis=0) - np.log(grow.size)

    share = (1.0 - 1.0 / grow)[:, None]
    each = log_density(statistic - share * z**2) - 0.5 * np.log(grow)[:, None]
    logs = {NONE: np.log(THRESHOLDS.prior_none) + log_density(statistic)}
    logs |= dict(zip(names, np.log(single) + average(each), strict=True))
    if several:
        together = log_density(statistic / grow) - 0.5 * size * np.log(grow)
        logs[SEVERAL] = np.log(several) + average(together)
    values = np.array(list(logs.values()), dtype=np.float64)
    values = np.exp(values - np.logaddexp.reduce(values))
    return dict(zip(logs, values.tolist(), strict=True))


def credible_changes(probabilities: dict[str, float]) -> tuple[str, ...]:
    """The fewest changes that hold 95 % of the probability of a change, the first likeliest."""
    changes = {name: p for name, p in probabilities.items() if name != NONE}
    total, held, out = sum(changes.values()), 0.0, []
    for name in sorted(changes, key=lambda name: -changes[name]):
        out.append(name)
        held += changes[name]
        if held >= THRESHOLDS.credible * total:
            break
    return tuple(out)
