"""Estimation: from recordings to models, with a verdict on whether to trust them.

Names load when first used, so that the command line can answer `--help` without JAX.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .claim_check._check import ClaimCheck as ClaimCheck
    from .claim_check._prediction import check_claim as check_claim
    from .claim_check._scan import CertifiedDrive as CertifiedDrive
    from .claim_check._scan import check_scan as check_scan
    from .comparison import Comparison as Comparison
    from .comparison import compare as compare
    from .diagnosis import Diagnosis as Diagnosis
    from .diagnosis import diagnose as diagnose
    from .identification._fit import fit as fit
    from .identification._fit_many import fit_many as fit_many
    from .identification._identify import identify as identify
    from .identification._model_order import Choice as Choice
    from .identification._model_order import choose_order as choose_order
    from .identification._result import FitResult as FitResult
    from .identification._result import UntrustedFit as UntrustedFit
    from .identification._weights import hysteresis_weights as hysteresis_weights
    from .identification.assessment._claim import Claim as Claim
    from .identification.assessment._estimates import Estimate as Estimate
    from .identification.assessment._verdict import Verdict as Verdict
    from .identification.inverse._identify_inverse import identify_inverse as identify_inverse
    from .identification.inverse._swap import swap as swap
    from .population._change import Change as Change
    from .population._check_against import check_against as check_against
    from .population._fit_population import fit_population as fit_population
    from .population._population import Population as Population
    from .recording_check._check import RecordingCheck as RecordingCheck
    from .recording_check._check import check_recording as check_recording
    from .solver._least_squares import SolverOptions as SolverOptions
    from .solver._least_squares import least_squares as least_squares
    from .solver._optimum import LeastSquares as LeastSquares
    from .uncertainty._profile import ProfileInterval as ProfileInterval
    from .uncertainty._profile import profile_likelihood as profile_likelihood
    from .uncertainty.bands._distance import DistanceBand as DistanceBand
    from .uncertainty.bands._distance import distance_band as distance_band
    from .uncertainty.bands._draws import ModelDraws as ModelDraws
    from .uncertainty.bands._draws import laplace_draws as laplace_draws
    from .uncertainty.bands._draws import posterior_draws as posterior_draws
    from .uncertainty.bands._nonlinearity import NonlinearityBand as NonlinearityBand
    from .uncertainty.bands._nonlinearity import nonlinearity_band as nonlinearity_band
    from .uncertainty.bands._prediction import PredictionBand as PredictionBand
    from .uncertainty.bands._prediction import prediction_band as prediction_band
    from .uncertainty.posterior._convergence import UntrustedPosterior as UntrustedPosterior
    from .uncertainty.posterior._sample import sample_posterior as sample_posterior

_HOME = {
    "CertifiedDrive": "claim_check._scan",
    "Change": "population._change",
    "Choice": "identification._model_order",
    "Claim": "identification.assessment._claim",
    "ClaimCheck": "claim_check._check",
    "Comparison": "comparison",
    "Diagnosis": "diagnosis",
    "DistanceBand": "uncertainty.bands._distance",
    "Estimate": "identification.assessment._estimates",
    "FitResult": "identification._result",
    "LeastSquares": "solver._optimum",
    "ModelDraws": "uncertainty.bands._draws",
    "NonlinearityBand": "uncertainty.bands._nonlinearity",
    "Population": "population._population",
    "PredictionBand": "uncertainty.bands._prediction",
    "ProfileInterval": "uncertainty._profile",
    "RecordingCheck": "recording_check._check",
    "SolverOptions": "solver._least_squares",
    "UntrustedFit": "identification._result",
    "UntrustedPosterior": "uncertainty.posterior._convergence",
    "Verdict": "identification.assessment._verdict",
    "check_against": "population._check_against",
    "check_claim": "claim_check._prediction",
    "check_recording": "recording_check._check",
    "check_scan": "claim_check._scan",
    "choose_order": "identification._model_order",
    "compare": "comparison",
    "diagnose": "diagnosis",
    "distance_band": "uncertainty.bands._distance",
    "fit": "identification._fit",
    "fit_many": "identification._fit_many",
    "fit_population": "population._fit_population",
    "hysteresis_weights": "identification._weights",
    "identify": "identification._identify",
    "identify_inverse": "identification.inverse._identify_inverse",
    "laplace_draws": "uncertainty.bands._draws",
    "least_squares": "solver._least_squares",
    "nonlinearity_band": "uncertainty.bands._nonlinearity",
    "posterior_draws": "uncertainty.bands._draws",
    "prediction_band": "uncertainty.bands._prediction",
    "profile_likelihood": "uncertainty._profile",
    "sample_posterior": "uncertainty.posterior._sample",
    "swap": "identification.inverse._swap",
}
__all__ = sorted(_HOME)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
