"""A small good recording, and how to damage it: the injectors of the bad-input matrix."""

import dataclasses
import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rapi_jax.examples import paper_recording
from rapi_jax.io import write_recording
from rapi_jax.recording._recording import Recording

SAMPLES, PERIODS, SEED = 200, 2, 7
FAST = ("--each", "none", "--starts", "2", "--no-plots")


@dataclasses.dataclass
class Raw:
    """A recording that nothing has checked: what an injector may change at will."""

    columns: list[list[np.ndarray]]  # a run: time_s, drive, response
    head: dict[str, Any]
    entries: list[dict[str, Any]]

    def write(self, folder: Path) -> None:
        """Write it as an exchange folder."""
        folder.mkdir(parents=True, exist_ok=True)
        lines = [f"{key} = {_toml(value)}" for key, value in self.head.items()]
        for entry, columns in zip(self.entries, self.columns, strict=True):
            lines += ["", "[[run]]", *(f"{key} = {_toml(value)}" for key, value in entry.items())]
            rows = ["time_s,drive,response", *(f"{t!r},{u!r},{y!r}" for t, u, y in _rows(columns))]
            (folder / entry["file"]).write_text("\n".join(rows) + "\n")
        (folder / "manifest.toml").write_text("\n".join(lines) + "\n")


def _rows(columns: list[np.ndarray]) -> zip:
    return zip(*(column.tolist() for column in columns), strict=True)


def _toml(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


@functools.cache
def good(samples: int = SAMPLES, periods: int = PERIODS, noise: float = 0.02) -> Recording:
    """The paper's device at 10, 20, 30 and 40 Hz."""
    return paper_recording(samples=samples, periods=periods, noise=noise, seed=SEED)[0]


def raw(recording: Recording | None = None) -> Raw:
    """`recording`, or the good one, free to be damaged."""
    recording = recording or good()
    return Raw(
        [[r.drive.time.copy(), r.drive.value.copy(), r.response.copy()] for r in recording.runs],
        {
            "schema": "rapi.recording/1",
            "response_unit": recording.response_unit,
            "drive_unit": recording.drive_unit,
        },
        [
            {"file": f"{r.name}.csv", "excitation_hz": r.drive.rate, "waveform": r.drive.waveform}
            | {"start_s": r.drive.start_s}
            for r in recording.runs
        ],
    )


Injector = Callable[[Path], Path | None]  # writes a damaged recording to a folder; may say where


def data(change: Callable[[Raw], Any], recording: Recording | None = None) -> Injector:
    """Damage the numbers or the manifest's keys."""

    def inject(folder: Path) -> None:
        damaged = raw(recording)
        change(damaged)
        damaged.write(folder)

    return inject


def files(change: Callable[[Path], Any]) -> Injector:
    """Damage the files of the good folder."""

    def inject(folder: Path) -> None:
        raw().write(folder)
        change(folder)

    return inject


def edit(file: str, old: str, new: str) -> Injector:
    """Replace text in a file of the good folder."""

    def change(folder: Path) -> None:
        text = (folder / file).read_text()
        assert old in text
        (folder / file).write_text(text.replace(old, new))

    return files(change)


def netcdf(change: Callable[[Path], Any]) -> Injector:
    """Damage the good netCDF-4 file."""

    def inject(folder: Path) -> Path:
        folder.mkdir()
        path = folder / "recording.nc"
        write_recording(good(), path)
        change(path)
        return path

    return inject


def put(run: int, column: int, sample: int | slice, value: float) -> Callable[[Raw], None]:
    """Write `value` over samples of a column (0 time, 1 drive, 2 response) of a run."""

    def change(damaged: Raw) -> None:
        damaged.columns[run][column][sample] = value

    return change


def cut(size: int) -> Callable[[Raw], None]:
    """Keep the first samples of the first run, and no other run."""

    def change(damaged: Raw) -> None:
        damaged.columns = [[column[:size] for column in damaged.columns[0]]]
        del damaged.entries[1:]

    return change


def scale(column: int, factor: float, **head: str) -> Callable[[Raw], None]:
    """Multiply a column of every run; `head` overrides keys of the manifest."""

    def change(damaged: Raw) -> None:
        for columns in damaged.columns:
            columns[column] = columns[column] * factor
        damaged.head.update(head)

    return change


def entry(run: int = 0, **keys: Any) -> Callable[[Raw], None]:
    """Set keys of a run's `[[run]]`; `None` removes one."""

    def change(damaged: Raw) -> None:
        damaged.entries[run].update(keys)
        for key in [k for k, v in keys.items() if v is None]:
            del damaged.entries[run][key]

    return change


def head(**keys: Any) -> Callable[[Raw], None]:
    """Set keys of the manifest; `None` removes one."""

    def change(damaged: Raw) -> None:
        damaged.head.update(keys)
        for key in [k for k, v in keys.items() if v is None]:
            del damaged.head[key]

    return change


def swapped(damaged: Raw) -> None:
    """Exchange two rows of the first run."""
    for column in damaged.columns[0]:
        column[[50, 51]] = column[[51, 50]]


def jittered(damaged: Raw) -> None:
    """Shake the clock of the first run by a fifth of a step."""
    time = damaged.columns[0][0]
    time[1:] += 0.2 * time[1] * np.random.default_rng(SEED).uniform(-1, 1, time.size - 1)


def dropped(damaged: Raw) -> None:
    """Lose three samples of the first run."""
    damaged.columns[0] = [np.delete(column, [80, 81, 82]) for column in damaged.columns[0]]


def clipped(low: float | None, high: float | None) -> Callable[[Raw], None]:
    """Limit the first run's reading to shares of its span."""

    def change(damaged: Raw) -> None:
        y = damaged.columns[0][2]
        at = y.min() + np.ptp(y) * np.array([0.0 if low is None else low, high or 1.0])
        damaged.columns[0][2] = np.clip(y, at[0], at[1])

    return change


def hopped(size: float, first: int, last: int | None = None) -> Callable[[Raw], None]:
    """Shift the first run's reading by `size` (GHz) from sample `first` to `last`."""

    def change(damaged: Raw) -> None:
        damaged.columns[0][2][first:last] += size

    return change


def unrelated(kind: str) -> Callable[[Raw], None]:
    """Readings that have nothing to do with the drive: noise, or some other oscillation."""

    def change(damaged: Raw) -> None:
        rng = np.random.default_rng(SEED)
        for columns in damaged.columns:
            time = columns[0]
            other = 30 * np.sin(2 * np.pi * 3.37 / time[-1] * time + rng.uniform(0, 6))
            columns[2] = 20 * rng.standard_normal(time.size) if kind == "noise" else other

    return change


def constant(column: int, value: float) -> Callable[[Raw], None]:
    """Hold a column of every run at `value`."""

    def change(damaged: Raw) -> None:
        for columns in damaged.columns:
            columns[column] = np.full_like(columns[column], value)

    return change


def first_run() -> Recording:
    """The first run of the good recording alone."""
    recording = good()
    return dataclasses.replace(recording, runs=recording.runs[:1])


def rewrite(file: str, content: bytes) -> Callable[[Path], None]:
    """Give a file of a folder another content."""
    return lambda folder: (folder / file).write_bytes(content) and None


def shifted(by: float) -> Callable[[Raw], None]:
    """Let the first run's clock start late."""

    def change(damaged: Raw) -> None:
        damaged.columns[0][0] = damaged.columns[0][0] + by

    return change


def repeated(damaged: Raw) -> None:
    """Write one time of the first run twice."""
    time = damaged.columns[0][0]
    time[51] = time[50]


def short(damaged: Raw) -> None:
    """Keep eight samples, one period of a fast drive."""
    cut(8)(damaged)
    entry(excitation_hz=125.0)(damaged)


def weak(damaged: Raw) -> None:
    """A device of 5 GHz/V whose readings are called MHz."""
    scale(2, 0.3, response_unit="MHz")(damaged)


def doubled(folder: Path) -> None:
    """Name a column twice."""
    path = folder / "run00.csv"
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([f"{head},drive", *(f"{row},1.0" for row in rows)]) + "\n")


def european(folder: Path) -> None:
    """Decimal commas, and semicolons between columns."""
    path = folder / "run00.csv"
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))


def append(file: str, content: bytes) -> Callable[[Path], None]:
    """Add bytes to the end of a file of a folder."""

    def change(folder: Path) -> None:
        with (folder / file).open("ab") as out:
            out.write(content)

    return change


def linked_out(folder: Path) -> None:
    """Replace a CSV file by a symbolic link to one outside the folder."""
    outside = folder.parent / "outside.csv"
    (folder / "run00.csv").rename(outside)
    (folder / "run00.csv").symlink_to(outside)


def sparse(folder: Path) -> None:
    """Make a CSV file declare five gibibytes, which it does not store."""
    os.truncate(folder / "run00.csv", 5 * 2**30)


def truncated(path: Path) -> None:
    """Cut a file to 60 % of its length."""
    os.truncate(path, int(0.6 * path.stat().st_size))


def flipped(path: Path) -> None:
    """Flip one bit in the compressed drive of a netCDF-4 file."""
    with h5py.File(path) as file:
        place = file["run01/drive"].id.get_chunk_info(0)  # pyright: ignore[reportAttributeAccessIssue]
    content = bytearray(path.read_bytes())
    content[place.byte_offset + place.size // 2] ^= 0x10
    path.write_bytes(bytes(content))


def external(path: Path) -> None:
    """Make a run of a netCDF-4 file a link to another file."""
    (path.parent / "other.nc").write_bytes(path.read_bytes())
    with h5py.File(path, "r+") as file:
        del file["run01"]
        file["run01"] = h5py.ExternalLink("other.nc", "/run01")


def ragged(path: Path) -> None:
    """Make the response of a run in a netCDF-4 file one sample shorter than its drive."""
    with h5py.File(path, "r+") as file:
        reading = file["run01/response"][:-1]  # pyright: ignore[reportIndexIssue]
        del file["run01/response"], file.attrs["content_sha256"]
        file["run01/response"] = reading


def bomb(path: Path) -> None:
    """Make a run of a netCDF-4 file declare eight gibibytes that it does not hold."""
    with h5py.File(path, "r+") as file:
        del file["run01/response"]
        file["run01"].create_dataset("response", (2**30,), "f8", chunks=(2**20,))  # pyright: ignore[reportAttributeAccessIssue]
