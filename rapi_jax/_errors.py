"""Errors that a caller may want to tell apart, and the cure of a missing package."""


def install_extra(name: str) -> str:
    """What to do where the packages of an extra are missing."""
    return (
        f"Install the extra: pip install 'rapi-jax[{name}]' (in its folder, with uv: `uv run "
        f"--extra {name} rapi ...`)."
    )


class DataError(ValueError):
    """A recording, file or drive that cannot be used: what, where, likely cause and cure.

    >>> import numpy as np
    >>> from rapi_jax import DataError, Drive
    >>> try:
    ...     Drive(np.array([0.0, 0.1, 0.1, 0.3]), np.array([1.0, 2.0, 3.0, 2.0]))
    ... except DataError as error:
    ...     print(str(error).split(" (")[0])
    `time_s` repeats at sample 2
    """


class ModelError(ValueError):
    """A model that does not fit the data or the request it is used with.

    >>> from rapi_jax import ModelError
    >>> from rapi_jax.examples import paper_recording
    >>> from rapi_jax.operators import InverseRAPI
    >>> recording, _ = paper_recording(samples=100)
    >>> try:
    ...     InverseRAPI.guess(recording)
    ... except ModelError as error:
    ...     print(str(error).split(".")[0])
    operator InverseRAPI has no initial guess from a recording
    """


class NotInvertible(ModelError):
    """A model without an inverse on the range asked for; says where it is not monotone.

    >>> from rapi_jax import PI, NotInvertible, certify
    >>> falling = PI(r=[0.0, 1.0], p=[1.0, -2.0], d=[0.5])
    >>> try:
    ...     certify(falling, 0.0, 5.0, 10.0).require()
    ... except NotInvertible as error:
    ...     print(type(error).__name__)
    NotInvertible
    """


class LimitError(DataError):
    """A drive beyond its limits: which sample, its value, the limit. Nothing of it may be sent.

    >>> from rapi_jax import DriveLimits, LimitError, triangle
    >>> limits = DriveLimits(low_v=0.0, high_v=5.0, slew_v_per_s=1000.0)
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=4.0, samples=100)
    >>> try:
    ...     limits.check(drive)
    ... except LimitError as error:
    ...     print(str(error).split(", the worst")[0])
    25 sample(s) beyond `high_v` = 5 V, the first at sample 38
    """
