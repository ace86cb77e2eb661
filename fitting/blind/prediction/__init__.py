"""Diagnoses in processes that cannot read the answers, and baseline methods."""
