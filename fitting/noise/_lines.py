"""The power of a run's readings by Fourier line, in bins of frequency."""

import dataclasses
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from ._thresholds import THRESHOLDS

Pick = Literal["all", "harmonics", "between"]


@dataclasses.dataclass(frozen=True, eq=False)
class PowerBins:
    """A run's Fourier lines in bins: sums over the lines of each.

    - `place`: the bin of each line, -1 for lines that do not count.
    - `multiplicity`: 2 for a line with real and imaginary part, 1 for the mean and Nyquist's.
    - `size`: samples of the run. `count`: bins. `step_s`: s between samples.
    - `harmonic`: the slowest line of each bin, in scan rates.
    """

    place: Int[np.ndarray, " lines"]
    multiplicity: Float[np.ndarray, " lines"]
    size: int
    count: int
    step_s: float
    harmonic: Float[np.ndarray, " bins"]

    @classmethod
    def of(cls, size: int, step_s: float, periods: int = 1, pick: Pick = "all") -> "PowerBins":
        """Bins for `size` samples over `periods` whole periods, whose harmonics are every so many.

        `pick`: which lines count. Bins are by frequency, so that bins of one run can be compared.
        """
        line = np.arange(size // 2 + 1)
        single = THRESHOLDS.single_lines
        beyond = np.log(np.maximum(line, single) / single) / np.log(THRESHOLDS.bin_ratio)
        place = np.where(line < single, line, single + np.floor(beyond + 1e-9).astype(int))
        count = int(place.max()) + 1
        harmonic = line % periods == 0
        counts = {"all": np.full(line.size, True), "harmonics": harmonic, "between": ~harmonic}
        multiplicity = np.where((line == 0) | (2 * line == size), 1.0, 2.0)
        slowest = np.searchsorted(place, np.arange(count)) / periods
        place = np.where(counts[pick], place, -1)
        return cls(place, multiplicity, size, count, step_s, slowest)

    def sums(self, values: Float[np.ndarray, "*more lines"]) -> Float[np.ndarray, "*more bins"]:
        """Sums over the lines of each bin, each as often as its multiplicity says."""
        begins, order = self._order
        weighted = (self.multiplicity * values)[..., order]
        padded = np.concatenate([weighted, np.zeros((*weighted.shape[:-1], 1))], axis=-1)
        out = np.add.reduceat(padded, begins[:-1], axis=-1)
        return np.where(begins[1:] > begins[:-1], out, 0.0)

    @cached_property
    def _order(self) -> tuple[Int[np.ndarray, " edges"], Int[np.ndarray, " counted"]]:
        """Where each bin begins among the lines that count, in the order of bins."""
        order = np.argsort(self.place, kind="stable")
        order = order[np.count_nonzero(self.place < 0) :]
        return np.searchsorted(self.place[order], np.arange(self.count + 1)), order

    def power(self, series: Float[np.ndarray, " time"]) -> Float[np.ndarray, " bins"]:
        """Sums of squares of `series` in each bin."""
        return self.sums(np.abs(np.fft.rfft(series)) ** 2 / self.size)

    def products(
        self, columns: Float[np.ndarray, "time columns"]
    ) -> Float[np.ndarray, "bins columns columns"]:
        """Sums of the products of columns in each bin."""
        wave = np.fft.rfft(np.ascontiguousarray(columns.T), axis=1)
        wave = wave * np.sqrt(self.multiplicity / self.size)
        out = np.zeros((self.count, columns.shape[1], columns.shape[1]))
        begins, order = self._order
        for i in range(self.count):
            some = wave[:, order[begins[i] : begins[i + 1]]]
            out[i] = some.real @ some.real.T + some.imag @ some.imag.T
        return out
