"""Branches of the scan cut out of a record, with the phase of the interferometer on each."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Float32

from rapi_jax._metrics import SPEED_OF_LIGHT as C
from rapi_jax.ranging._records import FringeRecord, FringeRecords
from rapi_jax.recording._run import ROI

from ._analytic import analytic_signal, band_pass, taper, unwrapped_phase
from ._cavity import CavityPeaks, find_peaks
from ._decimate import Rates, decimate, group_means, plan_decimation
from ._threads import side_by_side
from ._thresholds import THRESHOLDS
from ._transforms import usable_size
from ._turns import Turns, find_turns


@dataclasses.dataclass(frozen=True, eq=False)
class Scans:
    """Branches of one direction, side by side on as many samples each.

    - `begin_s`: session time of each branch's first sample, s. `hz`: samples a second.
    - `phase`: of the interferometer, rad, growing. `signal`: the measurement arm, mean taken off.
    - `first`, `last`: the region of interest, in samples; the rest is margin for filters.
    - `rising`: whether the frequency rises. `peaks`: the cavity's, in session time.
    - `light`, `reference`: least visibility of measurement arm and interferometer in the region, of
      the usual one of the scan.
    """

    begin_s: np.ndarray
    hz: float
    phase: Float[np.ndarray, "scans samples"]
    signal: Float32[np.ndarray, "scans samples"]
    first: int
    last: int
    rising: bool
    peaks: tuple[CavityPeaks, ...]
    measurement_hz: float
    light: np.ndarray
    reference: np.ndarray

    @property
    def count(self) -> int:
        """Number of branches."""
        return self.begin_s.size

    @property
    def middle_s(self) -> np.ndarray:
        """Session time of the middle of each region of interest, s."""
        return self.begin_s + (self.first + self.last) / 2 / self.hz


@dataclasses.dataclass(frozen=True, eq=False)
class ScanReading:
    """Branches of a record, up and down apart, and what is wrong or doubtful, one line each."""

    scans: tuple[Scans, ...]
    faults: tuple[str, ...]


def read_scans(records: FringeRecords) -> Iterator[ScanReading]:
    """The branches of every record, at most 32 periods at once, in the order of time.

    Raises `DataError` where a record shows no fringes of the interferometer or no turns.
    """
    for record in records:
        rates, faults = plan_decimation(
            record.interferometer, record.measurement, records.sample_hz, record.name
        )
        hz = records.sample_hz / rates.factor
        faults += list_clipped(record, records.full_scale)
        whole = THRESHOLDS.block_periods / records.excitation_hz
        step = int(whole * records.sample_hz) // rates.factor * rates.factor
        # Blocks overlap by a period, so that the branch across a border is whole in one of them.
        overlap = int(records.sample_hz / records.excitation_hz) // rates.factor * rates.factor
        done_s = -np.inf
        for begin in range(0, record.size, step):
            end = min(begin + step + overlap, record.size)
            if begin and end - begin < 1.2 * overlap:
                break
            scans, more, done_s = _read_block(
                records, record, rates, hz, begin, end, done_s, first=begin == 0
            )
            yield ScanReading(scans, tuple(faults + more))
            faults = []


def list_clipped(record: FringeRecord, full_scale: tuple[float, float] | None) -> list[str]:
    """A line for each interferometer whose samples lie on the digitizer's edges."""
    faults = []
    for name in ("measurement", "interferometer"):
        column = getattr(record, name)
        part = column[:: max(1, column.size // 100_000)]
        low, high = part.min(), part.max()
        if low == high:  # no light, or no detector: said elsewhere
            continue
        margin = 0.01 * (float(high) - float(low))
        share = 0.0
        for edge, near in ((high, part >= high - margin), (low, part <= low + margin)):
            own, close = int((part == edge).sum()), int(near.sum())
            at_limit = full_scale is not None and float(edge) in full_scale
            if own >= 8 and (own > 0.5 * close or at_limit):
                share += own / part.size
        if share:
            faults.append(
                f"{record.name}: the detector of the {name} is clipped in {100 * share:.1f} % of "
                "the samples: its fringes are bent, and distances less sure. Widen its range"
            )
    return faults


def _read_block(records, record, rates: Rates, hz, begin, end, done_s, *, first):
    """Branches between two samples of a record that begin after `done_s`; faults; the last end."""
    name = record.name
    x, y = decimate((record.interferometer[begin:end], record.measurement[begin:end]), rates.factor)
    drive = None
    if record.drive is not None:
        drive = group_means(record.drive[begin:end], rates.factor)
    known = record.rising_at_start
    turns, faults = find_turns(
        x,
        hz,
        rates.interferometer,
        records.excitation_hz,
        symmetric=records.waveform in ("triangle", "sine"),
        rising_at_start=known if first else True,
        drive=drive,
        name=name,
    )
    if not first and drive is None:
        turns = _continued(turns, begin / records.sample_hz, record, records)
        faults = []
    start_s = record.start_s + (begin + (rates.factor - 1) / 2) / records.sample_hz
    peaks = None
    if record.cavity is not None and records.cavity_spacing_hz is not None:
        delay = records.interferometer_path_m / C
        order_s = records.cavity_spacing_hz * delay / rates.interferometer
        peaks, more = find_peaks(record.cavity[begin:end], records.sample_hz, order_s, name)
        shift = record.start_s + begin / records.sample_hz
        peaks = CavityPeaks(peaks.time_s + shift, peaks.stderr_s)
        faults += more if first else []
    groups = []
    last_s = done_s
    for rising in (True, False):
        cut = _cut(turns, rising, x.size, hz)
        cut = [one for one in cut if start_s + one[0] / hz > done_s - 1e-3 / records.excitation_hz]
        if not cut:
            continue
        last_s = max(last_s, start_s + cut[-1][1] / hz)
        some = THRESHOLDS.scans_together
        groups += [(cut[i : i + some], rising) for i in range(0, len(cut), some)]
    scans = side_by_side(
        lambda one: _branches(x, y, one[0], start_s, hz, rates, one[1], peaks), groups
    )
    return tuple(scans), faults, last_s


def _continued(turns: Turns, at_s: float, record: FringeRecord, records: FringeRecords) -> Turns:
    """The turns of a later block, with directions as the first block's go on."""
    first, _ = _first_turns(record, records)
    period = 1.0 / records.excitation_hz
    minima = first.time_s[first.rising]
    place = ((turns.time_s + at_s - minima[0]) / period + 0.25) % 1.0
    near = place < 0.5
    agree = np.mean(near == turns.rising)
    return turns if agree >= 0.5 else Turns(turns.time_s, ~turns.rising)


def _first_turns(record: FringeRecord, records: FringeRecords) -> tuple[Turns, float]:
    count = int(2.5 * records.sample_hz / records.excitation_hz)
    part = dataclasses.replace(
        record,
        measurement=record.measurement[:count],
        interferometer=record.interferometer[:count],
        cavity=None,
        drive=None,
    )
    rates, _ = plan_decimation(
        part.interferometer, part.measurement, records.sample_hz, record.name
    )
    hz = records.sample_hz / rates.factor
    turns, _ = find_turns(
        group_means(part.interferometer, rates.factor),
        hz,
        rates.interferometer,
        records.excitation_hz,
        symmetric=records.waveform in ("triangle", "sine"),
        rising_at_start=record.rising_at_start,
        drive=None,
        name=record.name,
    )
    return turns, hz


def _cut(turns: Turns, rising: bool, size: int, hz: float) -> list[tuple[float, float]]:
    """First and last sample of each complete branch of one direction, margins left out."""
    margin = THRESHOLDS.near_turn
    out = []
    for a, b, up in zip(turns.time_s[:-1], turns.time_s[1:], turns.rising[:-1], strict=True):
        low, high = (a + margin * (b - a)) * hz, (b - margin * (b - a)) * hz
        if up == rising and low >= 0 and high <= size - 1:
            out.append((low, high))
    return out


def _branches(x, y, cut, start_s, hz, rates: Rates, rising, peaks) -> Scans:
    margin = THRESHOLDS.near_turn
    whole = min(int(high - low) for low, high in cut)
    size = usable_size(whole)
    begin = np.array([round((low + high - size) / 2) for low, high in cut])
    place = begin[:, None] + np.arange(size)[None, :]
    a, b = x[place], y[place]
    # The region of interest counts from turn to turn, the cut from margin to margin.
    branch = whole / (1 - 2 * margin)
    first = round(size / 2 - (0.5 - ROI[0]) * branch)
    first, last = max(first, 0), min(size - 1 - first, size - 1)
    edge = max(1, first // 2)
    a = (a - a.mean(axis=1, keepdims=True)) * taper(size, edge)[None, :]
    b = b - b.mean(axis=1, keepdims=True)
    low, high = (f * rates.interferometer / hz for f in THRESHOLDS.band)
    z = analytic_signal(a, band_pass(size, low, min(high, 0.49)))
    phase = unwrapped_phase(z)
    roi = slice(first, last + 1)
    size_of = np.abs(z[:, roi])
    middle_s = start_s + begin / hz
    found = []
    for at in middle_s:
        near = (at, at + (size - 1) / hz)
        found.append(peaks.between(*near) if peaks is not None else _NO_PEAKS)
    return Scans(
        middle_s,
        hz,
        phase,
        b,
        first,
        last,
        rising,
        tuple(found),
        rates.measurement,
        light=_least_swing(b[:, roi]),
        reference=_least_mean(size_of),
    )


def _least_mean(size: np.ndarray) -> np.ndarray:
    """Least amplitude of the stretches of each scan, of the usual one."""
    stretch = max(1, size.shape[1] // THRESHOLDS.stretches)
    whole = size.shape[1] // stretch * stretch
    mean = size[:, :whole].reshape(size.shape[0], -1, stretch).mean(axis=2)
    return mean.min(axis=1) / np.maximum(np.median(mean, axis=1), 1e-30)


def _least_swing(signal: np.ndarray) -> np.ndarray:
    """Least swing of the stretches of each scan, of the usual one: three fringes each, or more.

    Of the signal itself: where light is lost its mean changes, too, and a filter would ring.
    """
    out = np.ones(signal.shape[0])
    for k, one in enumerate(signal):
        middle = (one.min() + one.max()) / 2
        turns = int(np.count_nonzero(np.diff(np.signbit(one - middle)))) // 2
        count = min(THRESHOLDS.stretches, turns // 3)
        if count < 4:
            continue
        stretch = one.size // count
        swing = one[: count * stretch].reshape(count, stretch).std(axis=1)
        out[k] = swing.min() / max(float(np.median(swing)), 1e-30)
    return out


_NO_PEAKS = CavityPeaks(np.zeros(0), np.zeros(0))
