"""Simulated instruments and bridges on the network: TCP and HiSLIP."""
