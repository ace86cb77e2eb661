"""Realised gap: the closed fraction on new scans, against the noise-free response."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from fitting.blind.simulator._scan import Scan
from rapi_jax import ECDL

from ._model_response import model_response
from ._new_scans import KINDS, new_scans

Array = npt.NDArray[np.float64]


@runtime_checkable
class NoiseFreeDevice(Protocol):
    """A device whose noise-free response in GHz is known."""

    def simulate(self, scans: Sequence[Scan]) -> list[Array]: ...  # noqa: D102


def realised_gap(
    device: NoiseFreeDevice,
    session: Sequence[Scan],
    models: tuple[ECDL, ECDL],
    promised: Mapping[str, Any],
) -> dict[str, Any]:
    """Realised closed fractions of the model with the effects named beside the base alone.

    `models`: with and without the effects. `promised`: the diagnosis' `shrinkage`, of which what
    is `foreseen` of scans not recorded counts. Each of the unseen scans, and `all` together, has
    `closed`: `1 - sum e_model^2 / sum e_base^2`, and `closed_about_mean`: the same of errors about
    each run's mean, since origins may drift; whether `closed` lies `inside` the interval promised,
    and whether it is `no_worse` than its lower end.
    """
    new = new_scans(session)
    scans = [*session, *new.values()]
    truth = device.simulate(scans)[-len(new) :]
    model, base = (
        [a - t for a, t in zip(model_response(ecdl, scans)[-len(new) :], truth, strict=True)]
        for ecdl in models
    )
    found = {kind: _closed_fractions([model[k]], [base[k]]) for k, kind in enumerate(new)}
    found["all"] = _closed_fractions(model, base)
    interval = promised.get("foreseen")
    return {
        "promised": interval,
        **{
            kind: one | _compare_with_interval(one["closed"], interval)
            for kind, one in found.items()
        },
    }


def _closed_fractions(model: Sequence[Array], base: Sequence[Array]) -> dict[str, float | None]:
    about = [[e - e.mean() for e in errors] for errors in (model, base)]
    return {
        "rms_base": _rms(base),
        "rms_model": _rms(model),
        "closed": _closed_fraction(model, base),
        "closed_about_mean": _closed_fraction(*about),
    }


def _closed_fraction(model: Sequence[Array], base: Sequence[Array]) -> float | None:
    before = float(sum(e @ e for e in base))
    return 1 - float(sum(e @ e for e in model)) / before if before > 0 else None


def _rms(errors: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _compare_with_interval(
    closed: float | None, interval: Mapping[str, float] | None
) -> dict[str, bool | None]:
    """`None` where nothing was promised, or the base had nothing to close."""
    low, high = ((interval or {}).get(end) for end in ("low", "high"))
    if closed is None or low is None or high is None:
        return {"inside": None, "no_worse": None}
    return {"inside": low <= closed <= high, "no_worse": low <= closed}


WHICH = ("all", *KINDS)
