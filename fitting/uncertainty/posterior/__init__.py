"""The posterior of a fit's parameters, sampled by NUTS."""
