"""What scans say of a target: apparent distances, their errors and their Doppler gains."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError

Column = Float[np.ndarray, " scans"]


@dataclasses.dataclass(frozen=True, eq=False)
class Observations:
    """Apparent distances of scans, one entry per scan, in the order of time.

    A scan of a moving target measures `|L + G v + A a|` with distance L, velocity v and
    acceleration a at its middle: the optical path changes while the frequency does, and the sign of
    the fringe phase is not seen.

    - `time_s`: the scans' middles, s, increasing.
    - `apparent_m`: apparent distances, m; not negative. `stderr_m`: their standard errors, m.
    - `doppler_gain_s`: G, s; about `nu_0 T / (nu_1 - nu_0)` for a scan of duration T from `nu_0` to
      `nu_1`: positive up, negative down.
    - `acceleration_gain_s2`: A, s^2; zero by default. Used by a track of order 2.

    Raises `DataError` where columns differ in length, hold what is no number, or times do not
    increase.
    """

    time_s: Column
    apparent_m: Column
    stderr_m: Column
    doppler_gain_s: Column
    acceleration_gain_s2: Column | None = None

    def __post_init__(self) -> None:
        if self.acceleration_gain_s2 is None:
            object.__setattr__(self, "acceleration_gain_s2", np.zeros(np.shape(self.time_s)))
        for field in dataclasses.fields(self):
            column = np.asarray(getattr(self, field.name), dtype=float)
            if column.shape != np.shape(self.time_s) or column.ndim != 1:
                raise DataError(
                    f"`{field.name}` has shape {column.shape}, but there are "
                    f"{np.size(self.time_s)} scans. Give one entry per scan."
                )
            if not np.isfinite(column).all():
                where = int(np.argmin(np.isfinite(column)))
                raise DataError(
                    f"`{field.name}` of scan {where} is no number. Leave that scan out."
                )
            object.__setattr__(self, field.name, column)
        if self.size < 3:
            raise DataError(f"{self.size} scans are too few for a track: at least 3 are needed.")
        if (np.diff(self.time_s) <= 0).any():
            where = int(np.argmax(np.diff(self.time_s) <= 0)) + 1
            raise DataError(
                f"`time_s` must increase, but does not at scan {where}. Sort the scans."
            )
        if (self.stderr_m <= 0).any() or (self.apparent_m < 0).any():
            where = int(np.argmax((self.stderr_m <= 0) | (self.apparent_m < 0)))
            raise DataError(
                f"scan {where}: its error must be positive and its apparent distance not negative, "
                f"but they are {self.stderr_m[where]:g} m and {self.apparent_m[where]:g} m."
            )

    @property
    def size(self) -> int:
        """Number of scans."""
        return self.time_s.size

    def gains(self, order: int) -> Float[np.ndarray, "scans state"]:
        """Rows h of the measurement `h x`, for the state (L, v) or (L, v, a)."""
        rows = (np.ones(self.size), self.doppler_gain_s, np.asarray(self.acceleration_gain_s2))
        return np.stack(rows[: order + 1], axis=1)
