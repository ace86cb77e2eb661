"""Distance and velocity of a target from the apparent distances of its scans (Kalman filter)."""

from ._observations import Observations as Observations
from ._track import Track as Track
from ._track import track as track
