"""What diagnoses predicted, realised on the simulated device: gap and linearity on unseen scans."""
