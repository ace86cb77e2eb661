"""Reflectors told apart: the beat's width by Eqs. 5 to 7 and measured, and a fit of sines."""

from ._reflectors import Reflectors as Reflectors
from ._reflectors import find_reflectors as find_reflectors
from ._resolving import resolving_probability as resolving_probability
from ._width_curve import WidthCurve as WidthCurve
from ._width_curve import crooked_branch as crooked_branch
from ._width_curve import width_curve as width_curve
