"""The third set of other forms and unlisted effects, for sealed banks alone."""
