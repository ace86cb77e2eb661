"""Runs of an HDF5 file that is not trusted: all objects are looked at, no link followed, first.

A crafted file can name another file (external links, external storage, virtual datasets, soft
links), declare far more than it holds, or make the HDF5 library crash or never return. `_netcdf.py`
therefore runs this file as a script of its own, which imports nothing of ours: the HDF5 file is on
standard input, one line of JSON and then the columns (float64, little-endian) on standard output.
"""

import json
import math
import os
import sys
import time
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5g, h5o, h5t  # pyright: ignore[reportAttributeAccessIssue]

MAX_DECLARED = 4 * 2**30
MAX_RATIO = 1000  # declared / stored
COLUMNS = ("time_s", "drive", "response")
_MAX_OBJECTS = 50_000
_MAX_ATTRIBUTES = 1000
_SPARE_BYTES = 2 * 2**30  # of address space, for the libraries
_SPARE_SECONDS = 3  # of processor time, for what is not data
_FILTERS = {1: "deflate", 2: "shuffle", 3: "fletcher32"}  # others may load a plug-in
_LINKS = {1: "a soft link", 64: "an external link"}
_CURE = "Write the recording again, all of it in one file."
EXACT = {"f2", "f4", "f8", "i1", "i2", "i4", "u1", "u2", "u4"}  # kinds that float64 holds


class Refused(Exception):
    """Why the file is not read."""


def check(file: h5py.File, stored: int, *, foreign: bool = False) -> int:
    """Refuse links, foreign storage, unknown filters and types, and sizes beyond the caps.

    `stored`: bytes that the file really stores. `foreign`: a file of another program, which may
    also hold types that are not read. Returns the bytes that it declares.
    """
    root = h5o.open(file.id, b"/")
    about = h5o.get_info(root)
    seen = {about.addr}
    declared = _attribute_bytes(root, "/")
    groups = [(root, "")]
    while groups:
        group, path = groups.pop()
        names: list[bytes] = []
        group.links.iterate(names.append)
        for name in names:
            place = f"{path}/{name.decode('utf-8', 'replace')}"
            kind = group.links.get_info(name).type
            if kind != 0:
                what = _LINKS.get(kind, "a user-defined link")
                raise Refused(f"'{place}' is {what}, which is not followed. {_CURE}")
            item = h5o.open(group, name)
            info = h5o.get_info(item)
            if info.fileno != about.fileno:
                raise Refused(f"'{place}' lies in another file. {_CURE}")
            if info.addr in seen:
                continue
            seen.add(info.addr)
            if len(seen) > _MAX_OBJECTS:
                raise Refused(f"holds more than {_MAX_OBJECTS} objects. This is no recording.")
            if isinstance(item, h5g.GroupID):
                groups.append((item, place))
            elif isinstance(item, h5d.DatasetID):
                declared += _dataset_bytes(item, place, foreign)
            elif not foreign:
                raise Refused(f"'{place}' is neither group nor dataset. {_CURE}")
            declared += _attribute_bytes(item, place)
            if declared > MAX_DECLARED or declared > MAX_RATIO * stored:
                raise Refused(
                    f"declares {declared} bytes in a file that stores {stored}; at most "
                    f"{MAX_DECLARED} bytes and {MAX_RATIO} times are read. The file is damaged, or "
                    "made to exhaust memory."
                )
    return declared


def _dataset_bytes(dataset: Any, place: str, foreign: bool) -> int:
    plan = dataset.get_create_plist()
    layout = plan.get_layout()  # before the shape: that of a virtual dataset may open its sources
    if layout == h5d.VIRTUAL:
        raise Refused(f"'{place}' is a virtual dataset, which is not followed. {_CURE}")
    if plan.get_external_count() > 0:
        raise Refused(f"'{place}' keeps its data in another file. {_CURE}")
    for i in range(plan.get_nfilters()):
        code = plan.get_filter(i)[0]
        if code not in _FILTERS:
            known = ", ".join(_FILTERS.values())
            raise Refused(f"'{place}' uses filter {code}; only {known} are read. {_CURE}")
    kind = dataset.get_type()
    if kind.get_class() not in (h5t.INTEGER, h5t.FLOAT) and not foreign:
        raise Refused(f"'{place}' does not hold plain numbers. {_CURE}")
    samples = math.prod(dataset.shape or ())
    # A chunk may be larger than what is declared of it, and is unpacked whole.
    chunk = math.prod(plan.get_chunk()) if layout == h5d.CHUNKED else 0
    return max(samples, chunk) * kind.get_size()


def _attribute_bytes(item: Any, place: str) -> int:
    count = h5a.get_num_attrs(item)
    if count > _MAX_ATTRIBUTES:
        raise Refused(f"'{place}' has {count} attributes. This is no recording.")
    total = 0
    for i in range(count):
        attribute = h5a.open(item, index=i)
        total += math.prod(attribute.shape or ()) * attribute.get_type().get_size()
    return total


def attributes(item: Any) -> dict[str, Any]:
    """The attributes with one value: text, or a number."""
    found = {}
    for key, value in item.attrs.items():
        value = (
            value.item()
            if isinstance(value, np.generic | np.ndarray) and value.size == 1
            else value
        )
        value = value.decode() if isinstance(value, bytes) else value
        # _NCProperties and the like belong to the netCDF libraries
        if isinstance(value, str | float | int) and not key.startswith("_"):
            found[key] = value
    return found


def _column(group: Any, name: str, key: str) -> h5py.Dataset:
    column = group.get(key)
    if not isinstance(column, h5py.Dataset):
        raise Refused(f"'{name}' has no `{key}`, so it is no run. Write it again.")
    if column.ndim != 1 or column.dtype.str[1:] not in EXACT:
        raise Refused(
            f"`{key}` of '{name}' must be one column of float64 or narrower numbers, but is "
            f"{column.dtype} of {column.ndim} dimension(s). Write it again."
        )
    return column


def main(stored: int) -> None:
    """Check the file on standard input, and write what it holds to standard output."""
    out = sys.stdout.buffer
    limit(0)
    try:
        with os.fdopen(0, "rb") as raw, h5py.File(raw, "r") as file:
            declared = check(file, stored)
            columns: list[h5py.Dataset] = []
            runs = []
            for name, group in file.items():
                if isinstance(group, h5py.Group):
                    run = [_column(group, name, key) for key in COLUMNS]
                    sizes = [column.size for column in run]
                    runs.append({"name": name, "size": sizes, "attributes": attributes(group)})
                    columns += run
            said = {"attributes": attributes(file), "runs": runs}
            limit(declared)
            data = [np.asarray(column[:], dtype="<f8").tobytes() for column in columns]
    except Refused as error:
        said, data = {"refused": str(error)}, []
    except Exception as error:  # a damaged file makes the library raise almost anything
        said, data = {"damaged": str(error) or type(error).__name__}, []
    out.write(json.dumps(said).encode() + b"\n")
    for column in data:
        out.write(column)
    out.flush()


def limit(declared: int) -> None:
    """Let this process be ended by the system where it needs far more than `declared` bytes do."""
    try:
        import resource
    except ImportError:  # not on this system; the parent still has its time limit
        return
    seconds = math.ceil(time.process_time()) + _SPARE_SECONDS + declared // 10**7
    for what, soft in (
        (resource.RLIMIT_AS, 2 * declared + _SPARE_BYTES),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        if hard == resource.RLIM_INFINITY or soft < hard:
            resource.setrlimit(what, (soft, hard))


if __name__ == "__main__":
    main(int(sys.argv[1]))
