"""The table of a batch: columns, numbers read back, hostile and missing parts."""

import csv
import dataclasses
import hashlib
import io
import json
import math
import sys
import tracemalloc
from pathlib import Path

import batch_results as made
import diagnoses
import h5py
import hypothesis
import hypothesis.strategies as st
import numpy as np
import pandas
import pytest
import xarray

from fitting.batch.table import _read, write_table
from fitting.batch.table._csv import write_cell
from rapi_jax import DataError
from rapi_jax.io import OutputError

FIRST = ["recording", "status", "exit_code", "trusted", "rmse", "rmse_held_out", "seconds"]
FORMULA = tuple("=+-@\uff1d\uff0b\uff0d\uff20")


def read(folder: Path) -> list[dict[str, str]]:
    with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, strict=True))


@pytest.fixture
def mixed(tmp_path):
    """A batch of all tasks, two operators, a failure and an untrusted fit, in that folder."""
    classic = made.model([0.3, 1.7], [1e-3, 2e-3], names=("gain", "lam"), units=("GHz/V", "1"),
                         operator="ClassicPI", correlation=np.eye(2))  # fmt: skip
    return [
        made.write_job(tmp_path, "a", {"model.json": made.model()}),
        made.write_job(tmp_path, "b", {"model.json": classic}),
        made.write_job(tmp_path, "c", {}),
        made.write_job(tmp_path, "d", {"diagnosis.json": diagnoses.creep()}, task="diagnose"),
        made.write_job(tmp_path, "e", {"range.json": made.ranging()}, task="range"),
        made.write_job(
            tmp_path,
            "f",
            {"model.json": made.model(), "certificate.json": made.certificate()},
            task="compensate",
        ),
        made.write_job(
            tmp_path,
            "g",
            {"model.json": made.model(trusted=False)},
            exit_code=4,
            message="too few periods to tell",
        ),  # fmt: skip
    ]


def test_fixed_columns_of_fits(tmp_path):
    write_table(made.fits(tmp_path, made.scattered(3)), tmp_path)
    head = list(read(tmp_path)[0])
    assert head[:7] == FIRST and head[-1] == "message"
    pairs = [end for name in (*made.NAMES, "origin") for end in (name, f"{name}_stderr")]
    assert head[7 : 7 + len(pairs)] == pairs
    assert len(set(head)) == len(head)
    assert "verdict" not in head


def test_rows_are_in_the_order_of_the_jobs_and_hold_their_figures(mixed, tmp_path):
    write_table(mixed, tmp_path)
    rows = read(tmp_path)
    assert [row["recording"] for row in rows] == list("abcdefg")
    a, b, c, d, e, f, g = rows
    assert a["status"] == "done" and a["trusted"] == "True" and a["exit_code"] == "0"
    assert float(a["alpha"]) == made.CENTRE[0] and float(a["alpha_stderr"]) == made.STDERR[0]
    assert float(a["rmse"]) == 0.0197 and float(a["rmse_held_out"]) == 0.0204
    assert a["faults"] == "run00: a mode hop" and a["unit"] == "GHz"
    assert b["alpha"] == "" and float(b["gain"]) == 0.3 and float(b["lam"]) == 1.7
    assert c["status"] == "failed" and c["trusted"] == "" and c["lam"] == ""
    assert c["message"] == "run00: 3 samples are NaN, the first at 17."
    creep = diagnoses.creep()
    assert d["verdict"] == creep["verdict"]["name"] == "creep"
    assert d["set"] == "; ".join(creep["verdict"]["set"]) and 0 < float(d["probability"]) <= 1
    gain = next(h for h in creep["hypotheses"] if h["name"] == "creep")["parameters"]["gain"]
    assert float(d["creep.gain"]) == gain["value"]
    assert float(d["creep.gain_stderr"]) == gain["stderr"]
    assert float(e["distance"]) == 0.7 and float(e["distance_stderr"]) == 2e-6
    assert (e["scans"], e["scans_counted"], e["method"]) == ("20", "19", "resample-phase")
    assert (float(f["drive_min"]), float(f["drive_max"])) == (0.8, 5.5)
    assert float(f["nonlinearity_max"]) == 3e-4 and float(f["expected_high"]) == 0.009
    assert float(f["slope_min"]) == 11.5 and f["invertible"] == "True" and f["trusted"] == "True"
    assert g["trusted"] == "False" and g["exit_code"] == "4" and float(g["alpha"])
    head = list(rows[0])
    after = head.index("velocity_stderr") + 1
    assert head[after : after + 3] == ["verdict", "probability", "set"]


def test_provenance_has_its_columns(tmp_path):
    good = {"recorded_at": "2026-11-24T10:00:00Z", "temperature_c": "21.5"}
    records = [
        made.write_job(tmp_path, "a", {"model.json": made.model()}, provenance=good),
        made.write_job(tmp_path, "b", {}, provenance={"temperature_c": "warm"}),
    ]
    write_table(records, tmp_path)
    a, b = read(tmp_path)
    assert a["recorded_at"] == good["recorded_at"] and float(a["temperature_c"]) == 21.5
    assert b["recorded_at"] == "" and b["temperature_c"] == ""


def test_one_line_opens_each(mixed, tmp_path):
    assert [path.name for path in write_table(mixed, tmp_path)] == ["results.csv", "results.nc"]
    frame = pandas.read_csv(tmp_path / "results.csv")
    with xarray.open_dataset(tmp_path / "results.nc") as table:
        assert list(table["recording"].values) == list(frame["recording"])
        assert table["value"].dims == table["stderr"].dims == ("recording", "parameter")
        for name in table["parameter"].values:
            for key, column in (("value", name), ("stderr", f"{name}_stderr")):
                ours = table[key].sel(parameter=name).values
                np.testing.assert_array_equal(ours, frame[column].to_numpy(dtype=float))
        units = dict(zip(table["parameter"].values, table["parameter_unit"].values, strict=True))
        assert units["zeta"] == "V/Hz" and units["distance"] == "m"
        assert table["seconds"].attrs["units"] == "s"
        assert math.isnan(table["trusted"].values[2]) and table["trusted"].values[6] == 0.0
        text = (tmp_path / "results.csv").read_bytes()
        assert table.attrs["results_csv_sha256"] == hashlib.sha256(text).hexdigest()
    with h5py.File(tmp_path / "results.nc") as file:
        assert all(file[name].fletcher32 for name in ("value", "stderr", "rmse", "seconds"))


def test_units_of_one_response_are_attributes(tmp_path):
    write_table(made.fits(tmp_path, made.scattered(2)), tmp_path)
    with xarray.open_dataset(tmp_path / "results.nc") as table:
        assert table["rmse"].attrs["units"] == "GHz"
        assert table["claim_high"].attrs["units"] == "GHz"


def test_a_diagnosis_without_a_refit_has_no_held_out_figures(tmp_path):
    """They were the residual of the fit itself, which is held out of nothing."""
    shrinkage = {"before": 0.02, "after": 0.02, "held_out": [], "closed_fraction": None}
    content = diagnoses.creep() | {"shrinkage": shrinkage}
    write_table(
        [made.write_job(tmp_path, "d", {"diagnosis.json": content}, task="diagnose")], tmp_path
    )
    row = read(tmp_path)[0]
    assert row["rmse"] and row["rmse_held_out"] == row["gap_before"] == ""


def test_parquet_is_the_same_table(mixed, tmp_path):
    paths = write_table(mixed, tmp_path, parquet=True)
    assert paths[-1].name == "results.parquet"
    frame = pandas.read_parquet(paths[-1])
    rows = read(tmp_path)
    assert list(frame.columns) == list(rows[0])
    assert frame["recording"].tolist() == [row["recording"] for row in rows]
    expected = [float(row["lam"]) if row["lam"] else math.nan for row in rows]
    np.testing.assert_array_equal(frame["lam"].to_numpy(dtype=float), expected)


def test_parquet_without_pyarrow_says_what_to_install(mixed, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(DataError, match="--extra parquet"):
        write_table(mixed, tmp_path, parquet=True)


@hypothesis.given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_come_back_bit_for_bit(x):
    assert float(write_cell(x)) == x


@hypothesis.given(st.text())
@hypothesis.example("=1+1")
@hypothesis.example("a\r\n=1")
@hypothesis.example("x; =1")
def test_text_is_one_cell_and_no_formula(text):
    rows = list(csv.reader(io.StringIO(f"{write_cell(text)},x\n"), strict=True))
    assert len(rows) == 1 and len(rows[0]) == 2
    cell = rows[0][0]
    assert not cell.lstrip().startswith(FORMULA) and all(c.isprintable() for c in cell)
    assert not any(part.lstrip().startswith(FORMULA) for part in cell.split(";"))


def test_hostile_text_everywhere(tmp_path):
    records = []
    for i, text in enumerate(made.HOSTILE):
        model = made.model(names=(text, "zeta", "lam", "eta"))
        model |= {"operator": text, "unit": text, "effects": [text]}
        model["verdict"]["reasons"] = [text]
        records.append(
            made.write_job(
                tmp_path,
                f"job{i}",
                {"model.json": model},
                message=text,
                provenance={"recorded_at": text},
            )
        )
    write_table(records, tmp_path)
    text = (tmp_path / "results.csv").read_text(encoding="utf-8")
    assert all(c.isprintable() or c == "\n" for c in text)
    rows = list(csv.reader(io.StringIO(text), strict=True))
    assert len(rows) == len(records) + 1 and len({len(row) for row in rows}) == 1
    numbers = [k for k, cell in enumerate(rows[0]) if cell.endswith("_stderr")]
    for row in rows:
        for k, cell in enumerate(row):
            assert not cell.lstrip().startswith(FORMULA) or k + 1 in numbers or k in numbers
    with xarray.open_dataset(tmp_path / "results.nc") as table:
        assert table.sizes == {"recording": len(records), "parameter": 4 + len(made.HOSTILE)}


@pytest.mark.parametrize("name", ["rmse", "message", "verdict", "parameter", "recording", "value"])
def test_a_parameter_may_be_called_like_a_column(tmp_path, name):
    model = made.model(names=(name, "zeta", "lam", "eta"))
    write_table([made.write_job(tmp_path, "a", {"model.json": model})], tmp_path)
    (row,) = read(tmp_path)
    key = name if name in ("parameter", "value") else f"parameter.{name}"
    assert float(row[key]) == made.CENTRE[0] and float(row["rmse"] or "nan") == 0.0197
    with xarray.open_dataset(tmp_path / "results.nc") as table:
        assert float(table["value"].sel(parameter=name).values[0]) == made.CENTRE[0]
        assert float(table["rmse"].values[0]) == 0.0197


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda p: p.unlink(), "no such file"),
        (lambda p: p.write_text(p.read_text() + " "), "not the file that the job wrote"),
        (lambda p: (p.unlink(), p.mkdir()), "not a regular file"),
    ],
)
def test_a_result_that_is_not_the_jobs_is_left_out_and_said(tmp_path, damage, why):
    records = made.fits(tmp_path, made.scattered(3))
    damage(tmp_path / "rec0001" / "model.json")
    write_table(records, tmp_path)
    rows = read(tmp_path)
    assert why in rows[1]["message"] and rows[1]["alpha"] == "" and rows[1]["status"] == "done"
    assert rows[0]["message"] == rows[2]["message"] == "" and rows[2]["alpha"]


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{", "null", '{"schema": "rapi.unfinished/1", "files": {}}', '{"schema": 1}']
    + [json.dumps(made.model() | {"parameters": bad}) for bad in ([1], {"a": 3}, "x", {"a": None})]
    + [json.dumps(made.model() | {"correlation": {"names": ["a"], "matrix": [["x"]]}})]
    + ["[" * 100_000],
)
def test_a_file_of_another_form_is_left_out_and_said(tmp_path, content):
    record = made.write_job(tmp_path, "a", {"model.json": content})
    write_table([record], tmp_path)
    (row,) = read(tmp_path)
    assert row["message"].startswith("model.json") and row["rmse"] == ""


def test_a_name_that_leads_out_of_the_folder_is_not_followed(tmp_path):
    inner = tmp_path / "batch"
    inner.mkdir()
    record = made.write_job(tmp_path, "outside", {"model.json": made.model()})
    there = made.write_job(inner, "../other", {"model.json": made.model()}, place="x")
    write_table([record, there], inner)
    rows = read(inner)
    assert all(row["message"] and row["rmse"] == "" for row in rows)


KEYS = [key for key in made.model() if key != "schema"]


@pytest.mark.parametrize("null", [True, False])
def test_any_key_may_be_missing_or_null(tmp_path, null):
    records = []
    for whole, file, task in (
        (made.model(), "model.json", "fit"),
        (diagnoses.creep(), "diagnosis.json", "diagnose"),
        (made.certificate(), "certificate.json", "compensate"),
        (made.ranging(), "range.json", "range"),
    ):
        for key in whole:
            if key == "schema":
                continue
            part = {k: v for k, v in whole.items() if k != key} | ({key: None} if null else {})
            records.append(made.write_job(tmp_path, f"{task}-{key}", {file: part}, task=task))
    write_table(records, tmp_path)
    assert [row["message"] for row in read(tmp_path)] == [""] * len(records)


def test_an_empty_batch_has_a_header(tmp_path):
    write_table([], tmp_path)
    assert read(tmp_path) == []
    head = (tmp_path / "results.csv").read_text().strip().split(",")
    assert head[:7] == FIRST and head[-1] == "message"
    with xarray.open_dataset(tmp_path / "results.nc") as table:
        assert table.sizes["recording"] == 0


def test_what_cannot_be_written_leaves_what_was_there(tmp_path):
    records = made.fits(tmp_path, made.scattered(2))
    (tmp_path / "results.nc").mkdir()
    with pytest.raises(OutputError, match="not a regular file"):
        write_table(records, tmp_path)
    left = sorted(path.name for path in tmp_path.iterdir() if not path.name.startswith("rec"))
    assert left == ["results.csv", "results.nc"]


def test_a_thousand_rows_read_each_file_once(tmp_path, monkeypatch):
    one = made.fits(tmp_path, made.scattered(1))[0]
    records = [dataclasses.replace(one, name=f"rec{i:04d}") for i in range(1000)]
    opened = []
    monkeypatch.setattr(
        _read, "inside", lambda folder, name: opened.append(name) or folder / "rec0000"
    )
    write_table(records, tmp_path)
    assert opened == [record.name for record in records]
    assert [row["recording"] for row in read(tmp_path)] == opened


@pytest.mark.slow
def test_memory_grows_by_rows_not_by_what_the_files_hold(tmp_path):
    maps = {"maps": {"phase": [float(i) for i in range(20_000)]}}  # 160 kB, 0.6 MB once read
    content = diagnoses.creep() | maps
    one = made.write_job(tmp_path, "one", {"diagnosis.json": content}, task="diagnose")

    def peak(count: int) -> int:
        tracemalloc.start()
        write_table([one] * count, tmp_path)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(3)  # what is imported and cached
    assert peak(203) - peak(3) < 200 * 40_000  # bytes; one file once read is 600_000


@pytest.mark.slow
def test_a_saved_fit_is_in_the_table(tmp_path):
    import fitting
    from fitting._result_files import hash_files
    from fitting.batch._record import JobRecord
    from rapi_jax import ECDL, RAPI, examples

    recording, _ = examples.paper_recording(samples=800, periods=2)
    result = fitting.fit(ECDL(RAPI.guess(recording)), recording, starts=2)
    paths = result.save(tmp_path / "one", plots=False)
    record = JobRecord("one", "one.nc", "fit", "0", "done", 0, "", 1.0, 1, "", {}, {
        name: str(found) for name, found in hash_files(paths).items()
    })  # fmt: skip
    write_table([record], tmp_path)
    (row,) = read(tmp_path)
    for estimate in result.parameters:
        assert float(row[estimate.name]) == estimate.value
        assert float(row[f"{estimate.name}_stderr"]) == estimate.stderr
    assert float(row["rmse"]) == result.rmse and row["trusted"] == str(result.verdict.trusted)
    assert row["data_sha256"] == recording.sha256()
