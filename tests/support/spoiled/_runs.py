"""Runs that do not belong together, and drives and devices that no model is for."""

from typing import Any

import numpy as np

from rapi_jax import ECDL, RAPI
from rapi_jax.examples import AMPLITUDE, BIAS

from ._columns import Columns, answers, scaled
from ._ways import way


@way("response of another run")
def _(columns: Columns) -> None:
    columns.response[3] = columns.response[0].copy()


@way("columns swapped")
def _(columns: Columns) -> None:
    columns.drive, columns.response = columns.response, columns.drive


@way("two devices, 5 % apart")
def _(columns: Columns) -> None:
    other = scaled(columns.device, 1.05)
    for row in (1, 3):
        columns.response[row] = answers(other, columns, row)


@way("two devices, the second from the middle of a run")
def _(columns: Columns) -> None:
    other = scaled(columns.device, 1.05)
    half = columns.time[2].size // 2
    columns.response[2][half:] = answers(other, columns, 2)[half:]
    columns.response[3] = answers(other, columns, 3)


@way("a square drive")
def _(columns: Columns) -> None:
    for row, rate in enumerate(columns.rates):
        high = np.mod(columns.time[row] * rate, 1.0) < 0.5
        columns.drive[row] = BIAS + AMPLITUDE * (high - 0.5)
        columns.response[row] = answers(columns.device, columns, row)
        columns.waveforms[row] = "step"


@way("a linear device")
def _(columns: Columns) -> None:
    flat: Any = columns.device.operator
    columns.device = ECDL(
        RAPI(
            alpha=0.3, zeta=6e-3, lam=1.0, eta=1.0, a=1e-9, b=0.1,
            d=(float(flat.d[0]), 0.0, 0.0), d_0=0.0, plays=10,
        )
    )  # fmt: skip
    for row in range(len(columns.time)):
        columns.response[row] = answers(columns.device, columns, row)


@way("responses in another order")
def _(columns: Columns) -> None:
    columns.response = columns.response[::-1]


@way("the same data under all rates")
def _(columns: Columns) -> None:
    columns.response = [columns.response[0].copy() for _ in columns.response]


@way("bias wrong in half of the runs")
def _(columns: Columns) -> None:
    for row in (1, 3):
        columns.drive[row] = columns.drive[row] + 0.3
