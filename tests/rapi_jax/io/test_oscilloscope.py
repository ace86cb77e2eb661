"""Traces from oscilloscopes: headers, separators, decimal commas, units, and what is refused."""

import numpy as np
import pytest

from rapi_jax._errors import DataError
from rapi_jax.io import join_runs, read_oscilloscope, read_recording, write_recording

ROWS = [(-0.2, 1.5, 10.0), (-0.1, 2.5, 20.0), (0.0, 3.5, 30.25), (0.1, 2.5, 20.0)]
COLUMNS = {"time_s": "TIME", "drive": "CH1", "response": "CH2"}


def text(separator=",", decimal=".", head="TIME{0}CH1{0}CH2\n", end="\n", rows=ROWS) -> str:
    """A trace in some dialect."""
    body = [separator.join(str(x).replace(".", decimal) for x in row) for row in rows]
    return head.format(separator) + end.join(body) + end


def read(where, content, columns=COLUMNS, **options):
    """The run in a file of this content."""
    path = where / "scope.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    units = {"response_unit": "GHz", "drive_unit": "V"} | options
    return read_oscilloscope(path, columns, **units)


TRACES = {
    "commas": (text(), COLUMNS),
    "semicolons": (text(";"), COLUMNS),
    "decimal commas": (text(";", ","), COLUMNS),
    "tabs": (text("\t"), COLUMNS),
    "tabs and decimal commas": (text("\t", ","), COLUMNS),
    "windows": ("\ufeff" + text(end="\r\n"), COLUMNS),
    "trailing separators": (text(end=", \r\n"), COLUMNS),
    "spaces": (text(", ", head="TIME , CH1 , CH2\n"), COLUMNS),
    "quoted names": (text(head='"TIME"{0}"CH1"{0}"CH2"\n'), COLUMNS),
    "blank end": (text() + "\n  \n", COLUMNS),
    "no header, by number": (text(head=""), {"time_s": 0, "drive": 1, "response": 2}),
    "names in two lines": (
        text(head=",CH1,CH2\nSecond,Volt,Volt\n"),
        {"time_s": "Second", "drive": "CH1", "response": "CH2"},
    ),
    "names and numbers": (
        text(head=",CH1,CH2\nSecond,Volt,Volt\n"),
        {"time_s": "Second", "drive": 1, "response": 2},
    ),
    "preamble": (
        "Model,MDO3024\nRecord Length,4\n\nSample Interval,0.1,s\nLabels,,\n" + text(),
        COLUMNS,
    ),
    "preamble, by number": (
        "Model,MDO3024\nRecord Length,4\n\nSample Interval,0.1,s\n" + text(),
        {"time_s": 0, "drive": 1, "response": 2},
    ),
    "scale and order": (
        text(rows=[(y * 1e3, t * 1e3, u / 10) for t, u, y in ROWS]),
        {"time_s": "CH1", "drive": "CH2", "response": "TIME"},
    ),
}


@pytest.mark.parametrize("name", TRACES)
def test_dialects(tmp_path, name):
    content, columns = TRACES[name]
    options = {"scale": {"time_s": 1e-3, "drive": 10.0}, "response_unit": "MHz"}
    run = read(tmp_path, content, columns, **(options if name == "scale and order" else {}))
    np.testing.assert_allclose(run.drive.time, [0, 0.1, 0.2, 0.3], atol=1e-15)
    np.testing.assert_allclose(run.drive.value, [1.5, 2.5, 3.5, 2.5], rtol=1e-15)
    np.testing.assert_allclose(run.response, [10, 20, 30.25, 20], rtol=1e-15)
    assert run.drive.time[0] == 0 and run.name == "scope"


def test_fields_units_and_gaps(tmp_path):
    options = {"excitation_hz": 10.0, "waveform": "triangle", "start_s": 2.0, "name": "first"}
    run = read(tmp_path, text(), drive_unit="mV", response_unit="MHz", **options)
    assert (run.drive.excitation_hz, run.drive.waveform) == (10.0, "triangle")
    assert (run.drive.start_s, run.name) == (2.0, "first")
    np.testing.assert_array_equal(run.drive.value, np.array([1.5, 2.5, 3.5, 2.5]) / 1e3)
    np.testing.assert_array_equal(run.response, np.array([10, 20, 30.25, 20]) / 1e3)
    gap = text().replace("30.25", "nan")
    assert np.isnan(read(tmp_path, gap, nan="mask").response[2])
    with pytest.raises(DataError, match="scope.csv: `response` has 1"):
        read(tmp_path, gap)


@pytest.mark.fault(name="an oscilloscope's CSV that is wrong", promise="refused in one line")
@pytest.mark.parametrize(
    ("content", "columns", "said"),
    [
        ("", COLUMNS, "no column 'TIME'; names found: none"),
        ("TIME,CH1,CH2\n", COLUMNS, "no samples in columns"),
        (text(), COLUMNS | {"drive": "CH7"}, "no column 'CH7'; names found: TIME, CH1, CH2"),
        (text(), COLUMNS | {"drive": 7}, "no samples in columns 'TIME', 7, 'CH2'"),
        (
            text(head=",CH1,CH2\nSecond,Volt,Volt\n"),
            COLUMNS | {"drive": "Volt"},
            "several columns are called 'Volt': give the number of one of [1, 2]",
        ),
        (text().replace("3.5", "?"), COLUMNS, "line 4: `drive` must be a number, but is '?'"),
        (text() + "0.2,1", COLUMNS, "line 6 has no column 3"),
        (text() + "\x1b[2J,1,1", COLUMNS, "line 6: `time_s` must be a number, but is '\\x1b[2J'"),
        (text().replace("0.0,", "-0.3,"), COLUMNS, "goes back at sample 2"),
        (text().encode() + b"\0", COLUMNS, "NUL bytes"),
        (text(head="Zeit (\u00b5s)\n").encode("latin-1"), COLUMNS, "not UTF-8 text at byte"),
        (text(rows=ROWS[:2]), COLUMNS, "at least 3 samples"),
    ],
)
def test_bad_traces(tmp_path, content, columns, said):
    with pytest.raises(DataError) as caught:
        read(tmp_path, content, columns)
    assert said in str(caught.value) and "scope.csv: " in str(caught.value)
    assert str(caught.value).isprintable()


def test_bad_arguments(tmp_path):
    with pytest.raises(ValueError, match="Argument `columns` must name"):
        read(tmp_path, text(), {"time_s": 0})
    with pytest.raises(ValueError, match="must count from 0"):
        read(tmp_path, text(), {"time_s": -1, "drive": 1, "response": 2})
    with pytest.raises(ValueError, match="Argument `scale`"):
        read(tmp_path, text(), scale={"volt": 1.0})
    with pytest.raises(DataError, match="`drive_unit` must be one of"):
        read(tmp_path, text(), drive_unit="kV")


def test_runs_are_joined_and_judged(tmp_path):
    runs = [read(tmp_path, text(), name=name, response_unit="MHz") for name in ("a", "b")]
    units = {"response_unit": "MHz", "drive_unit": "V"}
    recording = join_runs(runs, **units, response_origin="run", provenance={"scope": "x"})
    assert (recording.response_unit, recording.response_origin) == ("GHz", "run")
    write_recording(recording, tmp_path / "r")
    assert read_recording(tmp_path / "r").sha256() == recording.sha256()
    with pytest.raises(DataError, match="same name"):
        join_runs([runs[0], runs[0]], **units)
    slip = read(tmp_path, text(rows=[(t, 1e3 * u, y) for t, u, y in ROWS]))
    with pytest.raises(DataError, match="likely in mV"):
        join_runs([slip], response_unit="GHz", drive_unit="V")


def test_a_real_scan_of_a_laser(data):
    path = data / "ecdl_scan" / "5.csv"
    columns = {"time_s": "Second", "drive": "CH4", "response": "CH3"}
    run = read_oscilloscope(path, columns, response_unit="V", drive_unit="V")
    assert run.drive.size == 8192 and run.name == "5"
    assert (run.drive.time[0], run.drive.value[0], run.response[0]) == (0.0, 2.6, -0.303)
    assert (run.drive.value[-1], run.response[-1]) == (9.2, -0.354)
    np.testing.assert_allclose(run.drive.time[-1], 2.27171 + 0.128)
    with pytest.raises(DataError, match=r"several columns are called 'Volt'"):
        read_oscilloscope(path, columns | {"drive": "Volt"}, response_unit="V", drive_unit="V")
