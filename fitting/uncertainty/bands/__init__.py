"""What the uncertainty of parameters makes of a prediction, a compensated scan and a distance."""
