"""Effects that an operator leaves out: one file each, every one the identity at its defaults."""

from ._base import AbstractDriveEffect as AbstractDriveEffect
from ._base import AbstractEffect as AbstractEffect
from ._base import AbstractInvertible as AbstractInvertible
from ._base import AbstractOpticalEffect as AbstractOpticalEffect
