"""Errors that a caller may want to tell apart."""


class DataError(ValueError):
    """A recording, file or drive that cannot be used: what, where, likely cause and cure."""


class ModelError(ValueError):
    """A model that does not fit the data or the request it is used with."""
