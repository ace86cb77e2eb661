"""The second set of other forms and unlisted effects, for development."""
