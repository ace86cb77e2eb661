"""Turning points of the scan: of the drive, of the laser, and models of the phase there."""
