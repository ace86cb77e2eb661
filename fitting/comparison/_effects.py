"""Effects that a diagnosis names in either of two recordings."""

from collections.abc import Callable, Sequence

from fitting.diagnosis import Diagnosis, diagnose
from rapi_jax import ECDL, Recording, effects
from rapi_jax.effects import AbstractEffect

from ._differences import EffectPresence


def named_effects(
    ecdl: ECDL,
    given: ECDL | None,
    pair: tuple[Recording, Recording],
    candidates: Sequence[type[AbstractEffect]] | None,
    report: Callable[[str], None],
) -> tuple[ECDL, tuple[EffectPresence, ...]]:
    """`ecdl` with the effects named in either recording, and which recording has which.

    Each diagnosis begins from `given`, the model that was brought, if any; an effect stands in the
    model as the diagnosis that named it fitted it.
    """
    found = []
    for label, recording in zip(("before", "after"), pair, strict=True):
        report(f"diagnosis {label}")
        found.append(diagnose(given, recording, candidates=candidates, scan=False))
    own = {type(effect) for effect in ecdl.effects}
    added: dict[type[AbstractEffect], AbstractEffect] = {}
    for report_of in found:
        for effect in report_of.model.effects:
            if type(effect) not in own and effect.name in report_of.verdict.effects:
                added.setdefault(type(effect), effect)
    order = list(effects.ALL)
    every = [*ecdl.effects, *added.values()]
    every.sort(key=lambda e: order.index(type(e)) if type(e) in order else len(order))
    presence = tuple(_presence(type(effect), found[0], found[1]) for effect in added.values())
    return ECDL(ecdl.operator, tuple(every)), presence


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
