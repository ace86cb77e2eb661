"""Realised gap and linearity gain of a diagnosis, measured on the simulated device."""
