"""Variances between recordings: restricted likelihood, choice of the model, what follows."""
