"""Effects of the simulated lasers: listed ones, other functional forms, and unlisted ones."""
