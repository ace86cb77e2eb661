"""Numbers of an HDF5 file of another program, read in a process of its own.

Run as a script, as `recordings/_hdf5.py` is and with its checks: the HDF5 file is on standard
input, one line of JSON and then the values (float64, little-endian) on standard output. Arguments:
the bytes that the file stores, then the paths to read; without any, what there is is listed.
"""

import importlib.util
import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np

_MOST = 1000  # data sets listed


def _load_checks() -> Any:
    path = Path(__file__).parents[1] / "recordings" / "_hdf5.py"
    spec = importlib.util.spec_from_file_location("_rapi_hdf5", path)
    if spec is None or spec.loader is None:
        raise ImportError(str(path))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def list_columns(file: h5py.File, checks: Any) -> list[dict[str, Any]]:
    """Data sets of numbers with one or two dimensions: path, shape, unit."""
    found: list[dict[str, Any]] = []

    def visit(name: str, item: Any) -> None:
        plain = isinstance(item, h5py.Dataset) and item.dtype.str[1:] in checks.EXACT | {"i8", "u8"}
        shape = item.shape if plain else ()
        if len(shape) not in (1, 2) or math.prod(shape) < 2 or len(found) >= _MOST:
            return
        about = checks.attributes(item)
        unit = next((about[key] for key in ("units", "unit", "Unit") if key in about), None)
        unit = unit if isinstance(unit, str) else None
        found.append({"path": name, "shape": list(shape), "unit": unit})

    file.visititems(visit)
    return found


def list_structures(file: h5py.File) -> list[dict[str, Any]]:
    """Structure arrays of MATLAB: of each element, the paths of what its fields refer to.

    A group whose data sets all hold references, as many of each; in the order in which MATLAB
    counts the elements, which is that of the file, its axes being reversed there.
    """
    found: list[dict[str, Any]] = []

    def visit(name: str, item: Any) -> None:
        fields = dict(item.items()) if isinstance(item, h5py.Group) else {}
        if not fields or len(found) >= _MOST or not all(map(_refers, fields.values())):
            return
        counts = {field.size for field in fields.values()}
        if len(counts) != 1 or not 1 < min(counts) <= _MOST:
            return
        paths = {
            key: [_target(file, one) for one in field[...].ravel()] for key, field in fields.items()
        }
        elements = [dict(zip(paths, one, strict=True)) for one in zip(*paths.values(), strict=True)]
        found.append({"path": name, "elements": elements})

    file.visititems(visit)
    return found


def _refers(item: Any) -> bool:
    return isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is h5py.Reference


def _target(file: h5py.File, reference: Any) -> str:
    """The path of what a reference leads to; empty where it leads nowhere."""
    return str(file[reference].name or "").lstrip("/") if reference else ""


def _values(file: h5py.File, path: str) -> np.ndarray:
    item = file[path]
    if not isinstance(item, h5py.Dataset):
        raise TypeError(f"'{path}' is no data set")
    return np.ascontiguousarray(item[...], dtype="<f8")


def main(stored: int, wanted: list[str]) -> None:
    """Check the file on standard input; list its columns, or write those that are wanted."""
    checks = _load_checks()
    out = sys.stdout.buffer
    checks.limit(0)
    try:
        with os.fdopen(0, "rb") as raw, h5py.File(raw, "r") as file:
            declared = checks.check(file, stored, foreign=True)
            columns = list_columns(file, checks)
            kept = [column for column in columns if column["path"] in wanted]
            said: dict[str, Any] = {"columns": kept if wanted else columns}
            said["structures"] = [] if wanted else list_structures(file)
            size = sum(8 * math.prod(column["shape"]) for column in kept)
            checks.limit(declared + size)
            data = [_values(file, column["path"]).tobytes() for column in kept]
    except checks.Refused as error:
        said, data = {"refused": str(error)}, []
    except Exception as error:  # a damaged file makes the library raise almost anything
        said, data = {"damaged": str(error) or type(error).__name__}, []
    out.write(json.dumps(said).encode() + b"\n")
    for column in data:
        out.write(column)
    out.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
