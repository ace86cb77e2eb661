"""The least-squares problem of a fit: its vector, residuals, linear part, bounds and solution."""
