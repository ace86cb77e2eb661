"""Diagnoses under the blindfold, in processes of their own, and simpler methods beside them."""
