"""One fit in a process of its own, from a file of arrays: `ours FILE` or `peer FILE`.

Each side imports only what it needs; the start and the data are the same. Prints the final cost.
"""

import sys

import numpy as np


def peer(file: str) -> float:
    """SciPy and Numba, without JAX."""
    from ._peer_fit import peer_fit
    from ._runs import Runs, Shape

    with np.load(file) as data:
        runs = Runs(*(data[name] for name in Runs._fields))
        shape = Shape(*(int(n) for n in data["shape"]))
        return peer_fit(data["values"], shape, runs, analytic=True).cost


def ours(file: str) -> float:
    """The complete `fit` from one start, without held-out refits."""
    from fitting import fit
    from rapi_jax import ECDL, RAPI, Drive, Recording

    with np.load(file) as data:
        values, u, y, freq = (data[name] for name in ("values", "u", "y", "freq"))
        plays, _, order = (int(n) for n in data["shape"])
    time = np.arange(u.shape[1]) / u.shape[1]
    begins = np.cumsum(1.0 / freq) - 1.0 / freq
    drives = [
        Drive(time / rate, value, float(rate), "triangle", float(begin))
        for rate, value, begin in zip(freq, u, begins, strict=True)
    ]
    names = ("alpha", "zeta", "lam", "eta", "a", "b")
    fields = dict(zip(names, values[:6], strict=True))
    start = ECDL(RAPI(**fields, d=values[6 : 6 + order], d_0=values[6 + order], plays=plays))
    result = fit(
        start, Recording.of(drives, list(y)), starts=1, guess=False, hold_out=False, throw=False
    )
    return result.starts[0].cost


if __name__ == "__main__":
    print(repr({"ours": ours, "peer": peer}[sys.argv[1]](sys.argv[2])))
