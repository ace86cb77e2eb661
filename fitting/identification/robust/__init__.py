"""Fits that single readings cannot spoil: M-estimates by iteratively reweighted least squares."""
