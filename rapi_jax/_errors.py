"""Errors that a caller may want to tell apart."""


class DataError(ValueError):
    """A recording, file or drive that cannot be used: what, where, likely cause and cure."""


class ModelError(ValueError):
    """A model that does not fit the data or the request it is used with."""


class NotInvertible(ModelError):
    """A model without an inverse on the range asked for; says where it is not monotone."""


class LimitError(DataError):
    """A drive beyond its limits: which sample, its value, the limit. Nothing of it may be sent."""
