"""Fits of a comparison that ended worse than what is known to be possible."""

from scipy import stats

from fitting._units import quantity
from rapi_jax import ECDL

from ._estimates import LABELS, PairEstimates
from ._joint_fit import JointFit, SharedErrors, Two, rms
from ._thresholds import THRESHOLDS


def failed_fits(
    errors: tuple[SharedErrors, SharedErrors], alone: Two, begun: tuple[ECDL, ECDL], unit: str
) -> list[str]:
    """What the fit of a recording left, where the model that it began from, `begun`, leaves less.

    That model has the effects as the diagnosis of the recording found them.
    """
    out = []
    for label, error, values, model in zip(LABELS, errors, alone, begun, strict=True):
        left, known = rms(error(values)), rms(error.of_model(model))
        if left > (1.0 + THRESHOLDS.worse_fit) * known:
            out.append(
                f"The fit {label} leaves {quantity(left, unit)} rms, where the model that it began "
                f"from leaves {quantity(known, unit)}."
            )
    return out


def failed_joint_fit(
    pair: PairEstimates,
    errors: tuple[SharedErrors, SharedErrors],
    joint: JointFit,
    unit: str,
) -> list[str]:
    """What one model leaves, where it is far more than two leave.

    To be asked where the parameters, to first order, do not differ: both must then leave the same.
    """
    own = [rms(e(v)) for e, v in zip(errors, pair.values, strict=True)]
    cost = sum(
        result.effective * ((both / one) ** 2 - 1.0)
        for result, both, one in zip(pair.results, joint.rmse, own, strict=True)
    )
    if float(stats.chi2.sf(cost, len(pair.names))) > THRESHOLDS.joint_failure:
        return []
    left = " and ".join(
        f"{quantity(both, unit)} {label}, where its own leaves {quantity(one, unit)}"
        for label, both, one in zip(LABELS, joint.rmse, own, strict=True)
    )
    return [f"One model for both leaves {left}, though no parameter is seen to differ."]
