"""Effects that a diagnosis names in either of two recordings."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from fitting._parameter_words import describe_parameter
from fitting.diagnosis import Diagnosis, diagnose
from fitting.diagnosis.refit._effect_vector import strength_names
from rapi_jax import ECDL, Recording, effects
from rapi_jax.effects import AbstractEffect

from ._differences import EffectPresence, EffectSize, Interval
from ._estimates import LABELS, PairEstimates
from ._joint_fit import Two
from ._thresholds import THRESHOLDS

_UNLIMITED = 1e9  # in place of an infinite limit, in units of the drive or of its slope


def named_effects(
    ecdl: ECDL,
    given: ECDL | None,
    pair: tuple[Recording, Recording],
    candidates: Sequence[type[AbstractEffect]] | None,
    report: Callable[[str], None],
) -> tuple[tuple[ECDL, ECDL], tuple[EffectPresence, ...]]:
    """`ecdl` with the effects named in either recording, for each, and which recording has which.

    Each diagnosis begins from `given`, the model that was brought, if any. In the model of a
    recording an effect stands as its diagnosis fitted it, or off where that does not name it.
    """
    found = []
    for label, recording in zip(("before", "after"), pair, strict=True):
        report(f"diagnosis {label}")
        found.append(diagnose(given, recording, candidates=candidates, scan=False))
    own = {type(effect) for effect in ecdl.effects}
    named = [
        {
            type(effect): effect
            for effect in report_of.model.effects
            if type(effect) not in own and effect.name in report_of.verdict.effects
        }
        for report_of in found
    ]
    added = list(dict.fromkeys([*named[0], *named[1]]))
    presence = tuple(_presence(cls, found[0], found[1]) for cls in added)
    before, after = (_with_effects(ecdl, added, present) for present in named)
    return (before, after), presence


def with_sizes(
    presence: Sequence[EffectPresence],
    classes: Mapping[str, str],
    pair: PairEstimates,
    values: Two,
    covariances: Two,
) -> tuple[EffectPresence, ...]:
    """The same with the parameters of what one recording alone has, by their estimates there.

    `classes`: their names, by those of the effects.
    """
    half = float(stats.t.ppf(0.5 + 0.5 * THRESHOLDS.interval_level, pair.degrees))
    out = []
    for one in presence:
        owner, sizes = classes[one.effect], []
        for session, label in enumerate(LABELS):
            for at, name in enumerate(pair.own[session], start=len(pair.names)):
                if one.only_in != label or name.partition(".")[0] != owner:
                    continue
                value = float(values[session][at])
                error = float(np.sqrt(covariances[session][at, at]))
                interval = Interval(value, value - half * error, value + half * error)
                words, unit = describe_parameter(name), pair.unit(name)
                sizes.append(EffectSize(name, words, unit, interval, error))
        out.append(dataclasses.replace(one, sizes=tuple(sizes)))
    return tuple(out)


def effects_test(
    presence: Sequence[EffectPresence], classes: Mapping[str, str], pair: PairEstimates
) -> float:
    """The p-value of the effects that one recording alone has, each against none, for all of them.

    By Wald's test of the parameters that say how strong an effect is. 1 where there is none.
    """
    found = [_effect_p(one, classes[one.effect], pair) for one in presence if one.only_in]
    return min(1.0, len(found) * min(found)) if found else 1.0


def _effect_p(one: EffectPresence, owner: str, pair: PairEstimates) -> float:
    session = LABELS.index(str(one.only_in))
    (effect,) = (e for e in pair.results[session].ecdl.effects if e.name == one.effect)
    names = [name for n in strength_names(effect) if (name := f"{owner}.{n}") in pair.own[session]]
    if not names:
        return 1.0
    off = np.array([float(getattr(_off(type(effect)), name.partition(".")[2])) for name in names])
    at = [len(pair.names) + pair.own[session].index(name) for name in names]
    # A limit that is infinite where it does nothing: its inverse is 0 there, as many errors away.
    size = pair.values[session][at] - np.where(np.isfinite(off), off, 0.0)
    inverse = np.linalg.inv(pair.covariances[session][np.ix_(at, at)])
    return float(stats.chi2.sf(size @ inverse @ size, len(at)))


def _with_effects(
    ecdl: ECDL,
    added: list[type[AbstractEffect]],
    present: dict[type[AbstractEffect], AbstractEffect],
) -> ECDL:
    order = list(effects.ALL)
    every = [*ecdl.effects, *(_finite(present.get(cls, _off(cls))) for cls in added)]
    every.sort(key=lambda e: order.index(type(e)) if type(e) in order else len(order))
    return ECDL(ecdl.operator, tuple(every))


def _off(cls: Any) -> AbstractEffect:
    """An effect that does nothing: at its defaults."""
    return cls()


def _finite(effect: AbstractEffect) -> AbstractEffect:
    """The same with a finite limit, beyond any drive, where it has none: a fit needs numbers."""
    return jax.tree.map(lambda leaf: jnp.clip(leaf, -_UNLIMITED, _UNLIMITED), effect)


def _presence(cls: type[AbstractEffect], before: Diagnosis, after: Diagnosis) -> EffectPresence:
    return EffectPresence(
        effect=cls.name,
        label=before.labels.get(cls.name, cls.label),
        before=cls.name in before.verdict.effects,
        after=cls.name in after.verdict.effects,
        before_probability=_probability(cls.name, before),
        after_probability=_probability(cls.name, after),
    )


def _probability(name: str, diagnosis: Diagnosis) -> float:
    """That the effect is present, alone or with another."""
    return float(
        sum(h["probability"] for h in diagnosis.content["hypotheses"] if name in h["effects"])
    )
