"""Which tests shorter tiers leave to the others, by lists of functions that took long."""

from collections.abc import Collection, Sequence
from pathlib import Path

import pytest

LONGER_TIERS = ("slow", "process", "bank", "notebook")


def mark_listed(
    items: Sequence[pytest.Function], slow: Collection[str], release: Collection[str], root: Path
) -> None:
    """Mark as slow what `slow` lists, and as of a release what `release` lists of the longer tiers.

    What is run by hand stays so, whatever it takes.
    """
    for item in items:
        if item.get_closest_marker("calibration") is not None:
            continue
        function = f"{item.path.relative_to(root).as_posix()}::{item.originalname}"
        if function in slow:
            item.add_marker(pytest.mark.slow(listed=True))
        if function in release and any(map(item.get_closest_marker, LONGER_TIERS)):
            item.add_marker(pytest.mark.release)
