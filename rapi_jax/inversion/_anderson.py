"""Fixed points of a map that is nearly linear: Anderson's mixing of what was tried."""

import numpy as np

from ._thresholds import THRESHOLDS


class AndersonMixing:
    """Remembers where a map was tried, and proposes where to try next.

    With the last rounds' errors `f = g(x) - x`, the next place is the `g` of that mixture of them
    whose error is smallest, as if the map were linear. (D. G. Anderson, J. ACM 12, 547, 1965.)
    """

    def __init__(self) -> None:
        self._images: list[np.ndarray] = []
        self._errors: list[np.ndarray] = []

    def next(self, place: np.ndarray, image: np.ndarray) -> np.ndarray:
        """Where to try next, now that the map is known to take `place` to `image`."""
        self._images = [*self._images[-THRESHOLDS.mixed_iterations :], image]
        self._errors = [*self._errors[-THRESHOLDS.mixed_iterations :], image - place]
        if len(self._errors) < 2:
            return image
        errors, images = np.diff(self._errors, axis=0), np.diff(self._images, axis=0)
        weight = np.linalg.lstsq(errors.T, self._errors[-1], rcond=1e-10)[0]
        return image - weight @ images
