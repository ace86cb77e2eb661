"""Nonlinear least squares that knows nothing of lasers: bounds, optimum, refinement, rank."""
