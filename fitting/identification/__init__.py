"""From a recording to a model: starts, covariance, cross-validation, model order, verdict."""
