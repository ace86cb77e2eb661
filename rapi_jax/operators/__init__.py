"""Operators: drive in V to optical frequency in GHz, at one scan rate. One file a class."""

from rapi_jax.plays._plays import Plays as Plays

from ._base import AbstractOperator as AbstractOperator
from ._base import Fields as Fields
from ._base import FlexibleForm as FlexibleForm
from ._fixed_rapi import FixedRAPI as FixedRAPI
from ._general_rapi import GeneralRAPI as GeneralRAPI
from ._inverse_rapi import InverseRAPI as InverseRAPI
from ._mixed_rapi import MixedRAPI as MixedRAPI
from ._pi import PI as PI
from ._rapi import RAPI as RAPI
