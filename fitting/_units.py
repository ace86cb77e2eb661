"""The unit of a dimension in which a quantity is best read: 41 MHz, not 0.041 GHz."""

from rapi_jax.internal import in_interval as in_interval
from rapi_jax.internal import interval_digits as interval_digits
from rapi_jax.internal import quantity as quantity
from rapi_jax.internal import readable_unit as readable_unit
from rapi_jax.internal import significant as significant
