"""Files of each kind, damaged at random: read, or refused in one line; never anything else.

A few of each here; `RAPI_MUTATIONS=10000` tries as many.
"""

import hashlib
import os
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bad_input import good
from benches import bench_file
from mutations import mutated, trials

from fitting._result_files import check_belongs
from fitting.batch.jobs._jobs_file import read_jobs_file
from fitting.claim_check._certificate import read_certificate
from hardware import read_bench
from rapi_jax import AfgWaveform, DataError, LimitError, ModelError
from rapi_jax.examples import paper_device
from rapi_jax.io import (
    read_afg,
    read_drive,
    read_fringe_records,
    read_limits,
    read_model,
    read_recording,
    write_afg,
    write_drive,
    write_fringe_records,
    write_model,
    write_recording,
)
from rapi_jax.ranging import AirState, FringeRecord, FringeRecords

LONGEST_S = 5.0
JOBS = """schema = "rapi.jobs/1"
[options]
plays = 12
[[job]]
recording = "monday"
name = "monday-cubic"
options = { order = 4 }
"""
CERTIFICATE = """{"schema": "rapi.compensation/1", "unit": "GHz", "drive_unit": "V", "drives": [
{"file": "drive.csv", "nonlinearity": {"up": 0.1, "down": 0.2}, "notes": []}], "files": {},
"claim": {"rms": 0.02, "low": 0.018, "high": 0.022, "noise": 0.02, "curvature": 5.0, "unit": "GHz",
"rates_hz": [10.0, 40.0], "swings": [4.5, 4.5], "hours": 1.0, "runs": 4}}"""


def cpu_s() -> float:
    """Processor time of this process and of those that it has waited for, s.

    A netCDF file that never ends is left after 3 s of it, however busy the machine is.
    """
    return sum(os.times()[:4])


def signed(content: bytes) -> bytes:
    """A model file whose checksum is right again."""
    body = content.rstrip(b"\n").rpartition(b"\n")[0]
    return body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n"


def recording(folder: Path, file: str) -> Path:
    write_recording(good(20, 2), folder / "r")
    return folder / "r" / file


def netcdf(folder: Path) -> Path:
    write_recording(good(20, 2), folder / "r.nc")
    return folder / "r.nc"


def fringes(folder: Path) -> Path:
    air = AirState(temperature_c=20.0, pressure_pa=101325.0, relative_humidity=0.5)
    columns = np.arange(300, dtype=np.int16)
    records = tuple(FringeRecord(columns, columns, start_s=0.1 * k, name=f"r{k}") for k in (0, 1))
    write_fringe_records(FringeRecords(records, 30e6, 10.0, 7.34, air=air), folder / "f")
    return folder / "f" / "manifest.toml"


def model(folder: Path) -> Path:
    write_model(folder / "model.rapi", paper_device(), response_unit="GHz", drive_unit="V")
    return folder / "model.rapi"


def drive(folder: Path) -> Path:
    write_drive(good(20, 1).runs[0].drive, folder / "drive.csv")
    return folder / "drive.csv"


def generator(folder: Path) -> Path:
    write_afg(AfgWaveform.of(good(20, 1).runs[0].drive, 64), folder / "drive.afg")
    return folder / "drive.afg"


def text(name: str, content: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_text(content)
        return folder / name

    return make


LIMITS = "low_v = 0.0\nhigh_v = 6.5\nslew_v_per_s = 900.0\nstep_v = 0.1\nmax_frequency_hz = 50.0\n"
# What makes the file, what reads it, how many are tried, and what is done after the damage.
KINDS = {
    "manifest": (lambda f: recording(f, "manifest.toml"), read_recording, 60, None),
    "CSV": (lambda f: recording(f, "run01.csv"), lambda p: read_recording(p.parent), 60, None),
    "fringes": (fringes, lambda p: read_fringe_records(p.parent), 60, None),
    "netCDF": (netcdf, read_recording, 2, None),
    "model": (model, read_model, 20, None),
    "model, signed": (model, read_model, 60, signed),
    "bench": (bench_file, read_bench, 60, None),
    "limits": (text("limits.toml", LIMITS), read_limits, 100, None),
    "jobs": (text("jobs.toml", JOBS), read_jobs_file, 60, None),
    "drive": (drive, read_drive, 60, None),
    "generator": (generator, read_afg, 60, None),
    "certificate": (text("certificate.json", CERTIFICATE), read_certificate, 60, None),
    "list": (text("model.json", CERTIFICATE), check_belongs, 30, None),
}


@pytest.mark.fault(
    name=lambda kind: f"a file damaged at random: {kind}",
    promise="read, or refused in one line, within 5 s of processor time",
    trials=lambda kind: trials(KINDS[kind][2]),
    seed="its kind",
)
@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_read_or_refused_in_one_line(kind, tmp_path):
    make, read, few, after = KINDS[kind]
    path = make(tmp_path)
    if kind == "certificate":
        drive(tmp_path)
    whole = path.read_bytes()
    read(path)
    rng = random.Random(kind)
    for trial in range(trials(few)):
        content = mutated(whole, rng)
        path.write_bytes(content if after is None else after(content))
        began = cpu_s()
        try:
            read(path)
        except (DataError, ModelError, LimitError) as error:
            said = str(error)
            assert said.isprintable() and 0 < len(said) < 1000, (trial, said)
        except Exception as error:
            raise AssertionError(f"trial {trial}: {type(error).__name__}: {error}") from error
        assert cpu_s() - began < LONGEST_S, trial
