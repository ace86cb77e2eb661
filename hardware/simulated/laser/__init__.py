"""Physics of the simulated laser and its optics."""
