"""Versions of the packages that computed a result."""

import importlib.metadata
import platform

_PACKAGES = ("rapi-jax", "jax", "equinox", "optimistix", "numpy")


def package_versions() -> dict[str, str]:
    """Version of each package that a result depends on, and of Python."""
    found = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return found | {"python": platform.python_version()}
