"""The error that asks for what a file leaves open."""

from rapi_jax._errors import DataError


class OpenQuestion(DataError):
    """A file that does not say which column is what, or in which unit, and options that will.

    >>> from rapi_jax import DataError
    >>> from rapi_jax.io.imports.columns._open_question import OpenQuestion
    >>> isinstance(OpenQuestion("scope.csv: which column is the drive?"), DataError)
    True
    """
