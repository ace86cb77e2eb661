"""The oscilloscope traces of a scanned laser, as drives and cavity transmission."""

import numpy as np
from scipy.optimize import least_squares

from rapi_jax import Drive

NAMES = ("5", "6", "9", "10")
FSR = 0.322  # GHz


def load(folder, name):
    """Drive and transmission of one trace; the coarse scan voltage as straight ramps."""
    table = np.genfromtxt(folder / f"{name}.csv", delimiter=",", skip_header=2, usecols=range(5))
    t = (table[-1, 0] - table[0, 0]) * np.arange(len(table)) / (len(table) - 1)
    volts = table[:, 4]
    smooth = np.convolve(np.pad(volts, 20, mode="edge"), np.ones(41) / 41, "valid")
    corners = [int(np.argmax(smooth[:1500])), int(np.argmin(smooth))]
    last = 7000 + int(np.argmax(smooth[7000:]))
    if smooth[-1] < smooth[last] - 0.1:
        corners.append(last)
    n = len(corners)

    def ramps(p):
        return np.interp(t, np.concatenate([[0.0], p[:n], [t[-1]]]), p[n:])

    start = np.concatenate([t[corners], volts[[0]], smooth[corners], volts[[-1]]])
    scale = np.concatenate([np.full(n, 1e-3), np.full(n + 2, 0.1)])
    best = least_squares(lambda p: ramps(p) - volts, start, x_scale=scale)
    return Drive(t, ramps(best.x)), table[:, 3], best.x[:n]


def opening(drive, frequency, corners, lag=0.0):
    """Largest vertical opening between the full ramp and the flyback after it, over the span."""
    volts = np.interp(drive.time - lag, drive.time, drive.value)
    branch = np.searchsorted(corners + lag, drive.time)
    down, up = branch == 1, branch == 2
    low = max(volts[up].min(), volts[down].min()) + 0.05
    high = min(volts[up].max(), volts[down].max()) - 0.05
    grid, order = np.linspace(low, high, 200), np.argsort(volts[down])
    gap = np.interp(grid, volts[up], frequency[up]) - np.interp(
        grid, volts[down][order], frequency[down][order]
    )
    return float(np.abs(gap).max() / np.ptp(frequency))
