"""How good a fit is: convergence, covariance, cross-validation, estimates, verdict."""
