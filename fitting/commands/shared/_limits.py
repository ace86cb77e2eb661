"""Limits of a file beside the unit of the drive that they are for."""

from pathlib import Path
from typing import Any


def check_limits_unit(limits: Any, path: Path | None, drive_unit: str) -> None:
    """Raise `ModelError` where limits (`None` for none) are not in the unit of the drive.

    `path`: their file.
    """
    from rapi_jax import ModelError
    from rapi_jax.io import printable

    if limits is not None and limits.unit != drive_unit:
        raise ModelError(
            f"{printable(path)}: these limits are in {limits.unit}, and the drive is in "
            f"{drive_unit}. Give limits of the drive: `low_{drive_unit.lower()}` and the like."
        )
