"""A turn fitted on a given fringe: the one that mends a count, or the one nearest to a time."""

import dataclasses

import numpy as np

from rapi_jax.readout._fringe_signal import FringeSignal
from rapi_jax.readout._thresholds import THRESHOLDS

from ._laser_turn import LaserTurn, fit_all_shapes, refine_turn


def refit_on_fringe(s: FringeSignal, found: LaserTurn, jump: int) -> LaserTurn:
    """The turn refitted on the fringe that takes `jump` fringes out of the phase after it."""
    at = s.at(found.fit.time_s)
    low = int(np.searchsorted(s.travel, s.travel[at] - THRESHOLDS.turn_outer))
    high = min(
        s.time.size - 1, int(np.searchsorted(s.travel, s.travel[at] + THRESHOLDS.turn_outer))
    )
    ends = found.fit.phase(s.time[[low, high]])
    twice = (ends[1] - ends[0] + s.raw[low] + s.raw[high]) / (2 * np.pi)
    fringe_order = round(float(twice)) + (jump if found.rising_after else -jump)
    place = int(
        np.clip(
            np.searchsorted(s.travel, s.travel[0] + (np.pi * fringe_order - s.raw[0]) / 2 / np.pi),
            0,
            s.time.size - 1,
        )
    )
    fits, onward = fit_all_shapes(s, place, (fringe_order,), None, 3)
    if not fits:
        return found
    again = dataclasses.replace(
        found,
        fit=fits[0],
        fringe_orders=(fringe_order,),
        rivals=(),
        evidence=onward / fits[0].cost,
        hidden_s=0.0,
    )
    return refine_turn(s, again)


def turn_on_fringe(s: FringeSignal, found: LaserTurn, near_s: float) -> LaserTurn | None:
    """The turn on the extreme of a fringe that is nearest to a time; `None` where none fits."""
    at = s.at(near_s)
    order = round(float(np.interp(near_s, s.time, s.raw)) / np.pi)
    fits, onward = fit_all_shapes(s, at, (order,), None, 0)
    if not fits:
        return None
    return dataclasses.replace(
        found, fit=fits[0], fringe_orders=(order,), rivals=(), evidence=onward / fits[0].cost
    )
