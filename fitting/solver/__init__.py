"""Nonlinear least squares on optimistix: bounds, normal equations, refinement, identifiability."""
