"""What samples the photodiodes."""
