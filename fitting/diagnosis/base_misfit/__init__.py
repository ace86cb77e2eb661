"""What a richer hysteresis than the identified one would add: a Gaussian density of plays."""
