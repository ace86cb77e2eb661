"""Distance from one scan: three estimators, and how each answers to motion and noise."""
