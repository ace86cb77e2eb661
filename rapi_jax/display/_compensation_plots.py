"""The pictures of a compensation, by name: `made.plot.drive()`."""

import dataclasses
from typing import Any

import numpy as np


@dataclasses.dataclass(frozen=True)
class CompensationPlots:
    """Each method returns a figure; `ax` draws into axes of yours. `made`: a `Compensation`."""

    made: Any

    def drive(self) -> Any:
        """The scan asked for, the drive for it, and how far that is from a straight one."""
        from .. import plot

        return plot.compensation([self.made], self.made.target.unit, self.made.drive_unit)

    def error(self, *, ax: Any = None) -> Any:
        """What the model's answer to the drive lacks of the scan asked for, over the phase.

        Raises `ValueError` for the paper's inverse, which knows no forward model.
        """
        from ..plot._style import UP, fine_unit, one_axis, rate_text

        made = self.made
        if made.predicted is None:
            raise ValueError(
                "the paper's inverse has no forward model whose answer could be compared with the "
                "scan. Predict with one: `predict(model, made.drive)`."
            )
        off = made.predicted - (made.target.value - made.target.value.min())
        unit, factor = fine_unit(float(np.abs(off).max()), made.target.unit)
        figure, axis = one_axis(ax)
        axis.plot(made.drive.time * made.drive.rate, factor * off, lw=1, color=UP)
        axis.axhline(0.0, lw=0.8, color="black")
        axis.set_xlabel("scan phase since the drive's minimum")
        axis.set_ylabel(f"answer less scan ({unit})")
        axis.set_title(
            f"{rate_text(made.drive.rate)}: what the model leaves of the scan", fontsize=10
        )
        return figure
