"""The files that commands write: drives, measurements, and where they come from."""
