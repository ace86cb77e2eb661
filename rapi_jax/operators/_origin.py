"""The drive from which plays and polynomial count."""

from rapi_jax.recording._recording import Recording

from ._thresholds import THRESHOLDS


def drive_origin(recording: Recording) -> float:
    r"""The origin for a model of `recording`, in the drive's unit: 0 unless that is far.

    A falling bound $\lambda u + \eta r$ depends on where zero is. Where the drives come near their
    zero, it stands; where it is far, by an offset that says nothing of the device, `scan_origin`.

    So a guess moves with an offset of the drives beyond `origin_reach` ranges and not below it:
    there a zero of the device's own cannot be told from an offset before both are fitted, which
    `fitting.identify` does. For the paper's device at its own bias both are 0. With its drives
    written 0.5 V higher (a ninth of their range) a fit of the guess leaves 3 times the noise, 15 V
    higher 33 times.
    """
    low, high = _range(recording)
    reach = THRESHOLDS.origin_reach * (high - low)
    return 0.0 if low - reach <= 0.0 <= high + reach else scan_origin(recording)


def scan_origin(recording: Recording) -> float:
    """An origin that moves with the drives: below the lowest, as far as zero is in the paper."""
    low, high = _range(recording)
    return low - THRESHOLDS.origin_below * (high - low)


def _range(recording: Recording) -> tuple[float, float]:
    drives = [drive.value for drive in recording.drives]
    return min(float(u.min()) for u in drives), max(float(u.max()) for u in drives)
