"""What stands out among many recordings, and what drifts."""
