"""From chi-squares to probabilities: evidence, calibration, credible set."""
