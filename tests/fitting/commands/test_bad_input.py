"""Bad input through the command line: every row ends with its exit code and one line that helps.

The line says what is wrong, where, and what to do. Fits that are not to be trusted write everything
and say why in `model.json`. Figures of detection are in `tests/README.md`.
"""

import dataclasses
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bad_input import (
    FAST,
    Injector,
    append,
    bomb,
    clipped,
    constant,
    cut,
    data,
    doubled,
    dropped,
    edit,
    entry,
    european,
    external,
    files,
    first_run,
    flipped,
    head,
    hopped,
    jittered,
    linked_out,
    netcdf,
    put,
    ragged,
    repeated,
    rewrite,
    scale,
    shifted,
    short,
    sparse,
    swapped,
    truncated,
    unrelated,
    weak,
)

from fitting import UntrustedFit, fit
from fitting.cli import app
from fitting.commands.run import run
from rapi_jax import ECDL, RAPI
from rapi_jax._recording import Drive, Recording

NAN, INF = float("nan"), float("inf")
MASK = (*FAST, "--nan", "mask")


@dataclasses.dataclass(frozen=True)
class Row:
    """A fault: what is done to a good recording, the exit code, and words that must be said.

    The words are looked for in the one line on standard error, or, with code 4, in the verdict's
    reasons. `samples`: what the fault in `model.json` must list for the first run.
    """

    name: str
    inject: Injector
    code: int
    words: tuple[str, ...] = ()
    options: tuple[str, ...] = FAST
    samples: tuple[tuple[int, int], ...] | None = None


ROWS = (
    Row(
        "NaN in a reading",
        data(put(1, 2, 57, NAN)),
        3,
        ("run01.csv", "`response`", "1 value", "sample 57", "--nan mask"),
    ),
    Row(
        "Inf in a reading",
        data(put(0, 2, 9, -INF)),
        3,
        ("run00.csv", "`response`", "-inf", "sample 9"),
    ),
    Row(
        "NaN in the drive",
        data(put(2, 1, slice(4, 7), NAN)),
        3,
        ("run02.csv", "`drive`", "3 value", "sample 4", "again"),
    ),
    Row(
        "Inf in the drive",
        data(put(2, 1, 199, INF)),
        3,
        ("run02.csv", "`drive`", "inf", "sample 199"),
    ),
    Row("NaN in the clock", data(put(3, 0, 20, NAN)), 3, ("run03.csv", "`time_s`", "sample 20")),
    Row(
        "Inf in the clock",
        data(put(3, 0, 199, INF)),
        3,
        ("run03.csv", "`time_s`", "inf", "sample 199"),
    ),
    Row("NaN in readings, masked", data(put(1, 2, slice(57, 60), NAN)), 0, (), MASK),
    Row("Inf in readings, masked", data(put(0, 2, [9, 150], INF)), 0, (), MASK),
    Row(
        "NaN in the drive, masked",
        data(put(2, 1, 4, NAN)),
        3,
        ("run02.csv", "`drive`", "never guessed"),
        MASK,
    ),
    Row(
        "no reading left after the mask",
        data(put(1, 2, slice(None), NAN)),
        3,
        ("run01.csv", "0 finite", "leave this run out"),
        MASK,
    ),
    Row("empty CSV", files(rewrite("run00.csv", b"")), 3, ("run00.csv", "the file is empty")),
    Row(
        "header only",
        files(rewrite("run00.csv", b"time_s,drive,response\n")),
        3,
        ("run00.csv", "no samples", "again"),
    ),
    Row("two samples", data(cut(2)), 3, ("run00.csv", "at least 3 samples", "has 2", "again")),
    Row(
        "fewer samples than parameters",
        data(short),
        3,
        ("8 usable samples", "parameters", "Record more"),
    ),
    Row(
        "no complete period",
        data(cut(60)),
        3,
        ("run00", "no complete period", "10 Hz", "excitation_hz"),
    ),
    Row(
        "constant drive",
        data(constant(1, 3.0)),
        4,
        ("unidentifiable", "lam", "d_1", "no drive", "run00", "rests at 3"),
    ),
    Row(
        "constant reading", data(constant(2, 3.0)), 4, ("no signal", "no reading", "run00", "cable")
    ),
    Row(
        "one reading constant",
        data(put(0, 2, slice(None), 3.0)),
        4,
        ("no reading", "run00", "rests at 3", "cable"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "samples out of order",
        data(swapped),
        3,
        ("run00.csv", "`time_s` goes back", "sample 51", "sort"),
    ),
    Row(
        "sample twice", data(repeated), 3, ("run00.csv", "`time_s` repeats", "sample 51", "remove")
    ),
    Row("jitter", data(jittered), 3, ("run00.csv", "jitters", "the usual one", "digits")),
    Row(
        "samples dropped",
        data(dropped),
        3,
        ("run00.csv", "3 sample(s) are missing after sample 79", "record again"),
    ),
    Row(
        "clock does not start at 0",
        data(shifted(5.0)),
        3,
        ("run00.csv", "starts at 5 s", "start_s"),
    ),
    Row(
        "clock in ms",
        data(scale(0, 1e3)),
        4,
        ("wrong period", "run00", "10 Hz", "factor of 1000", "`time_s` must be in s"),
    ),
    Row(
        "clock beyond all bounds",
        data(scale(0, 1e300)),
        3,
        ("run00", "`time_s` ends at 1.99e+299 s", "unit"),
    ),
    Row(
        "a column shorter than the others",
        files(append("run01.csv", b"0.2,3.0\n")),
        3,
        ("run01.csv", "line 202", "2 value(s)", "cut short"),
    ),
    Row(
        "a response shorter than its drive",
        netcdf(ragged),
        3,
        ("recording.nc", "run01", "199 samples", "200"),
    ),
    Row(
        "clipped above",
        data(clipped(None, 0.9)),
        4,
        ("clipped", "run00", "samples", "input range"),
        FAST,
        (),
    ),
    Row(
        "clipped below", data(clipped(0.1, None)), 4, ("clipped", "run00", "input range"), FAST, ()
    ),
    Row(
        "clipped on both sides",
        data(clipped(0.1, 0.9)),
        4,
        ("clipped", "run00", " and at "),
        FAST,
        (),
    ),
    Row(
        "mode hop",
        data(hopped(2.0, 130)),
        4,
        ("mode hop", "run00", "sample 130", "bias or current"),
        FAST,
        ((130, 130),),
    ),
    Row(
        "mode hop and back",
        data(hopped(-3.0, 60, 75)),
        4,
        ("mode hop", "run00", "samples 60, 75"),
        FAST,
        ((60, 60), (75, 75)),
    ),
    Row(
        "rate said 1.25 times too high",
        data(entry(excitation_hz=12.5)),
        4,
        ("wrong period", "run00", "12.5 Hz", "repeats at about 10 Hz"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate said half",
        data(entry(excitation_hz=5.0)),
        4,
        ("wrong period", "run00", "about 10 Hz"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate said double",
        data(entry(excitation_hz=20.0)),
        4,
        ("wrong period", "run00", "about 10 Hz"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate in mHz",
        data(entry(excitation_hz=10_000.0)),
        4,
        ("wrong period", "run00", "10000 Hz", "factor of 1000"),
        FAST,
        ((0, 199),),
    ),
    Row(
        "rate in kHz",
        data(entry(excitation_hz=0.01)),
        3,
        ("run00", "no complete period", "0.01 Hz", "excitation_hz"),
    ),
    Row(
        "drive in mV called V",
        data(scale(1, 1e3)),
        3,
        ("run00", "drive", "outside", "likely in mV"),
    ),
    Row("drive in V called mV", data(head(drive_unit="mV")), 3, ("run00", "called mV")),
    Row(
        "reading in GHz called Hz",
        data(head(response_unit="Hz")),
        3,
        ("run00", "response", "called MHz or Hz"),
    ),
    Row("reading in GHz called MHz", data(weak), 3, ("run00", "response", "GHz was called MHz")),
    Row("reading in Hz called GHz", data(scale(2, 1e9)), 3, ("run00", "likely in Hz")),
    Row("reading in MHz called GHz", data(scale(2, 1e3)), 3, ("run00", "likely in MHz")),
    Row(
        "no response unit",
        data(head(response_unit=None)),
        3,
        ("manifest.toml", "`response_unit` is missing", "No unit is assumed"),
    ),
    Row(
        "no drive unit",
        data(head(drive_unit=None)),
        3,
        ("manifest.toml", "`drive_unit` is missing", "No unit is assumed"),
    ),
    Row(
        "unknown unit",
        data(head(response_unit="THz")),
        3,
        ("manifest.toml", "`response_unit`", "GHz", "THz"),
    ),
    Row(
        "unknown waveform",
        data(entry(waveform="sawtooth")),
        3,
        ("manifest.toml", "run.0.waveform", "triangle"),
    ),
    Row(
        "no schema",
        data(head(schema=None)),
        3,
        ("manifest.toml", "`schema` is missing", "rapi.recording/1"),
    ),
    Row(
        "another schema",
        data(head(schema="rapi.recording/9")),
        3,
        ("manifest.toml", "rapi.recording/1", "rapi.recording/9"),
    ),
    Row(
        "misspelt key",
        edit("manifest.toml", "excitation_hz", "excitaton_hz"),
        3,
        ("manifest.toml", "excitaton_hz", "`excitation_hz` meant"),
    ),
    Row(
        "not TOML",
        edit("manifest.toml", "[[run]]", "[[run]"),
        3,
        ("manifest.toml", "not valid TOML", "line"),
    ),
    Row("no manifest", files(lambda f: (f / "manifest.toml").unlink()), 3, ("no manifest.toml",)),
    Row(
        "no run",
        files(
            rewrite(
                "manifest.toml",
                b'schema = "rapi.recording/1"\nresponse_unit = "GHz"\ndrive_unit = "V"\n',
            )
        ),
        3,
        ("manifest.toml", "`run` is missing", "[[run]]"),
    ),
    Row(
        "a CSV file is missing",
        files(lambda f: (f / "run02.csv").unlink()),
        3,
        ("run02.csv", "no such file"),
    ),
    Row(
        "a path out of the folder",
        edit("manifest.toml", "run00.csv", "../run00.csv"),
        3,
        ("manifest.toml", "../run00.csv", "inside the recording"),
    ),
    Row(
        "an absolute path",
        edit("manifest.toml", "run00.csv", "/etc/passwd"),
        3,
        ("manifest.toml", "/etc/passwd", "inside the recording"),
    ),
    Row(
        "a link out of the folder",
        files(linked_out),
        3,
        ("run00.csv", "link out of the recording", "Copy"),
    ),
    Row(
        "two runs of one name",
        data(entry(1, name="run00")),
        3,
        ("manifest.toml", "same name", "run00"),
    ),
    Row(
        "rate zero",
        data(entry(excitation_hz=0.0)),
        3,
        ("manifest.toml", "run.0.excitation_hz", "greater than 0", "is 0.0"),
    ),
    Row(
        "rate negative",
        data(entry(excitation_hz=-10.0)),
        3,
        ("manifest.toml", "run.0.excitation_hz", "greater than 0", "is -10.0"),
    ),
    Row("rate NaN", data(entry(excitation_hz=NAN)), 3, ("manifest.toml", "run.0.excitation_hz")),
    Row(
        "rate as text",
        data(entry(excitation_hz="10 Hz")),
        3,
        ("manifest.toml", "run.0.excitation_hz", "number"),
    ),
    Row(
        "latency longer than a run",
        data(head(response_lag_s=5.0)),
        3,
        ("run00", "`response_lag_s` = 5 s", "short beside"),
    ),
    Row(
        "latency negative",
        data(head(response_lag_s=-0.001)),
        3,
        ("manifest.toml", "response_lag_s", "0"),
    ),
    Row("netCDF cut short", netcdf(truncated), 3, ("recording.nc", "damaged or cut short", "copy")),
    Row("netCDF with a flipped bit", netcdf(flipped), 3, ("recording.nc", "damaged", "copy")),
    Row(
        "netCDF with an external link",
        netcdf(external),
        3,
        ("recording.nc", "/run01", "external link"),
    ),
    Row("netCDF that declares too much", netcdf(bomb), 3, ("recording.nc", "declares", "at most")),
    Row("netCDF of no bytes", netcdf(lambda p: p.write_bytes(b"")), 3, ("recording.nc", "empty")),
    Row(
        "text called netCDF",
        netcdf(lambda p: p.write_bytes(b"hello")),
        3,
        ("recording.nc", "neither a netCDF-4 file"),
    ),
    Row("CSV that declares too much", files(sparse), 3, ("run00.csv", "bytes, but at most")),
    Row("readings are noise", data(unrelated("noise")), 4, ("nothing explained", "wiring")),
    Row(
        "readings follow something else",
        data(unrelated("sine")),
        4,
        ("nothing explained", "wiring"),
    ),
    Row(
        "one start only",
        data(lambda r: None),
        4,
        ("one start only", "local minimum"),
        ("--each", "none", "--starts", "1", "--no-plots"),
    ),
    Row("a column twice", files(doubled), 3, ("run00.csv", "line 1", "twice")),
    Row(
        "columns in another order",
        edit("run00.csv", "time_s,drive,response", "time_s,response,drive"),
        3,
        ("run00.csv", "line 1", "time_s,drive,response"),
    ),
    Row("decimal commas", files(european), 3, ("run00.csv", "line 1")),
    Row(
        "text for a number",
        edit("run00.csv", "\n0.0,", "\noverload,"),
        3,
        ("run00.csv", "line 2", "`time_s`", "'overload'"),
    ),
    Row(
        "not UTF-8",
        files(append("manifest.toml", b'note = "\xb5m"\n')),
        3,
        ("manifest.toml", "not UTF-8", "byte"),
    ),
    Row(
        "NUL bytes", files(append("run00.csv", b"\0\0\0\0")), 3, ("run00.csv", "NUL bytes", "crash")
    ),
    Row(
        "escape sequence in a run's name",
        data(entry(name="\\u001b[2Jrun")),
        3,
        ("\\x1b[2Jrun", "cannot name a run"),
    ),
    Row("path in a run's name", data(entry(name="../run")), 3, ("../run", "cannot name a run")),
)


@pytest.fixture
def rapi(capfd) -> Callable[..., tuple[int, str, str]]:
    """`rapi` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, [str(a) for a in arguments])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


def assert_one_line(text: str, *words: str) -> None:
    """One line, safe on a terminal, with all words and no traceback."""
    assert text.endswith("\n") and text.count("\n") == 1, text
    assert text[:-1].isprintable() and "Traceback" not in text and "internal error" not in text
    assert [word for word in words if word not in text] == [], text


KEYS = {
    "schema",
    "operator",
    "parameters",
    "runs",
    "rmse",
    "rmse_held_out",
    "held_out",
    "verdict",
    "seconds",
    "versions",
    "data_sha256",
}


def assert_model(folder: Path, printed: str) -> dict:
    """`model.json` as the contract has it, the same as printed, beside the loadable model."""
    model = json.loads((folder / "model.json").read_text(), parse_constant=pytest.fail)
    assert json.loads(printed) == model
    assert KEYS <= model.keys() and model["schema"] == "rapi.model/1"
    for parameter in model["parameters"].values():
        assert {"value", "stderr", "unit", "at_bound"} <= parameter.keys()
    for one in model["runs"]:
        assert {"excitation_hz", "rmse", "unit", "span", "rmse_fraction"} <= one.keys()
    assert model["verdict"]["trusted"] == (not model["verdict"]["reasons"])
    assert (folder / "model.rapi").stat().st_size > 0
    assert not list(folder.glob(".tmp-*"))
    return model


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_recording(row, rapi, tmp_path):
    folder, output = tmp_path / "recording", tmp_path / "output"
    path = row.inject(folder) or folder
    code, out, err = rapi("fit", path, "-o", output, "--json", *row.options)
    assert code == row.code, err
    if code in (0, 4):
        assert err == ""
        model = assert_model(output, out)
        reasons = " | ".join(model["verdict"]["reasons"])
        assert [word for word in row.words if word not in reasons] == [], reasons
        assert "nan" not in reasons.lower().split()
        if row.samples is not None:
            listed = [f["samples"] for f in model["faults"] if f["run"] == "run00"]
            assert len(listed) == 1 and listed[0]
            assert listed[0] == [list(place) for place in row.samples] or not row.samples
    else:
        assert out == "" and not (output / "model.json").exists()
        assert_one_line(err, *row.words)


USAGE = {
    "unknown command": (("fti", "x"), ("fti", "Did you mean", "fit")),
    "misspelt option": (
        ("fit", "x", "-o", "y", "--strats", "2"),
        ("--strats", "Did you mean --starts?"),
    ),
    "no recording": (("fit",), ("RECORDING is missing", "rapi fit --help")),
    "no output": (("fit", "x"), ("--output is missing", "rapi fit --help")),
    "option without its value": (("fit", "x", "-o"), ("-o requires an argument",)),
    "too many arguments": (("fit", "x", "y", "-o", "z"), ("too many arguments: y",)),
    "not a number": (("fit", "x", "-o", "y", "--plays", "ten"), ("--plays", "ten", "int")),
    "number out of range": (("fit", "x", "-o", "y", "--plays", "0"), ("--plays", ">= 1")),
    "far too many plays": (("fit", "x", "-o", "y", "--plays", "1000000"), ("--plays", "<= 200")),
    "unknown choice": (("fit", "x", "-o", "y", "--each", "mu"), ("--each", "mu", "lam,eta")),
    "no such policy": (("fit", "x", "-o", "y", "--nan", "interpolate"), ("interpolate", "mask")),
    "escape sequence": (("fit", "x", "-o", "y", "--st\x1b[2J", "1"), ("\\x1b[2J",)),
}


@pytest.mark.parametrize("name", USAGE)
def test_usage(name, rapi):
    arguments, words = USAGE[name]
    code, out, err = rapi(*arguments)
    assert (code, out) == (2, "")
    assert_one_line(err, "usage:", "--help", *words)


def a_file(path: Path) -> Path:
    path.write_text("mine")
    return path


def read_only(path: Path) -> Path:
    """A folder that nobody may write to, root included where the system has one."""
    if Path("/proc/self").is_dir():
        return Path("/proc/self")
    path.mkdir(mode=0o500)
    return path


OUTPUTS = {
    "a file in the way": (a_file, "is not a folder"),
    "below a file": (lambda path: a_file(path) / "output", "cannot write"),
    "not writable": (read_only, "cannot write"),
}


@pytest.mark.parametrize("name", OUTPUTS)
def test_output(name, rapi, tmp_path):
    inject, words = OUTPUTS[name]
    raw_folder = tmp_path / "recording"
    data(lambda recording: None)(raw_folder)
    place = inject(tmp_path / "output")
    code, out, err = rapi("fit", raw_folder, "-o", place, *FAST)
    assert (code, out) == (3, "")
    assert_one_line(err, str(place), words, "Choose another with `-o`")


def test_paths_with_escape_sequences_and_markup_are_shown_as_text(rapi, tmp_path):
    code, _, err = rapi("fit", tmp_path / "no\x1b[2J\n[red]such", "-o", tmp_path / "y")
    assert code == 3
    assert_one_line(err, "no\\x1b[2J\\n[red]such: no such file")


def test_markup_in_a_run_name_is_text(rapi, tmp_path):
    data(entry(name="[red]x[-red]"))(tmp_path / "r")
    code, out, err = rapi("fit", tmp_path / "r", "-o", tmp_path / "o", *FAST)
    assert (code, err) == (0, "") and "[red]x" in out and "\x1b" not in out


@pytest.fixture(scope="module")
def fitted(tmp_path_factory) -> Path:
    """A folder that `rapi fit` wrote."""
    folder = tmp_path_factory.mktemp("fitted")
    data(lambda recording: None)(folder / "recording")
    assert run(app, ["fit", str(folder / "recording"), "-o", str(folder), *FAST]) == 0
    return folder


def flip(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


def signed(change: Callable[[dict], object]) -> Callable[[bytes], bytes]:
    """Change the header of a model file, and make its checksum right again."""

    def damage(content: bytes) -> bytes:
        line, _, rest = content.rstrip(b"\n").rpartition(b"\n")[0].partition(b"\n")
        header = json.loads(line)
        change(header)
        body = json.dumps(header).encode() + b"\n" + rest
        return body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n"

    return damage


MODELS = {
    "one bit flipped": (flip, ("checksum", "Copy it again")),
    "cut short": (lambda c: c[: len(c) // 2], ("checksum",)),
    "of no bytes": (lambda c: b"", ("not a model file",)),
    "text": (lambda c: b"not a model", ("not a model file",)),
    "a pickle": (lambda c: b"\x80\x04K\x01.", ("not a model file",)),
    "a later schema": (
        signed(lambda h: h.update(schema="rapi.model-file/9")),
        ("rapi.model-file/9",),
    ),
    "another operator": (
        signed(lambda h: h["operator"].update({"class": "Preisach"})),
        ("Preisach", "newer version"),
    ),
    "another effect": (
        signed(lambda h: h.update(effects=[{"class": "os", "shapes": {}}])),
        ("effect os",),
    ),
    "leaves that do not fit": (
        signed(lambda h: h["operator"]["shapes"].update(lam=[3])),
        ("not a model this version reads",),
    ),
    "leaves too large": (signed(lambda h: h["operator"]["shapes"].update(d=[10**9])), ("million",)),
    "no operator": (
        signed(lambda h: h.pop("operator")),
        ("not a model this version reads", "operator"),
    ),
}


@pytest.mark.parametrize("name", MODELS)
def test_model(name, rapi, fitted, tmp_path):
    damage, words = MODELS[name]
    path = tmp_path / "model.rapi"
    path.write_bytes(damage((fitted / "model.rapi").read_bytes()))
    for given in (path, tmp_path):
        code, out, err = rapi("predict", given, fitted / "recording", "-o", tmp_path / "o")
        assert (code, out) == (3, "") and not (tmp_path / "o").exists()
        assert_one_line(err, str(path), *words)


def test_no_model(rapi, fitted, tmp_path):
    for place in (tmp_path, tmp_path / "nowhere", fitted / "recording"):
        code, _, err = rapi("predict", place, fitted / "recording", "-o", tmp_path / "o")
        assert code == 3
        assert_one_line(err, "no such model", "`rapi fit` wrote")


def test_model_of_another_unit(rapi, fitted, tmp_path):
    for key, unit in (("response_unit", "um"), ("drive_unit", "um")):
        data(head(**{key: unit}))(tmp_path / key)
        code, _, err = rapi("predict", fitted, tmp_path / key, "-o", tmp_path / "o")
        assert code == 3
        assert_one_line(err, f"{key} is", unit, "Use a model identified in the same unit")


def test_predict_refuses_bad_data_and_masks_on_request(rapi, fitted, tmp_path):
    data(put(1, 2, 57, NAN))(tmp_path / "r")
    arguments = ("predict", fitted, tmp_path / "r", "-o", tmp_path / "o", "--no-plots", "--json")
    code, out, err = rapi(*arguments)
    assert (code, out) == (3, "")
    assert_one_line(err, "run01.csv", "sample 57")
    code, out, err = rapi(*arguments, "--nan", "mask")
    report = json.loads(out)
    assert (code, err, report["schema"]) == (0, "", "rapi.prediction/1")
    assert report["runs"][1]["samples"] == 199 and report["runs"][1]["rmse_fraction"] < 1e-3


def test_redundant_parameters_are_named(tmp_path):
    """One run fixes r (1 + eta) and b r, not their factors: all that take part are named."""
    recording = first_run()
    options = {"free": lambda e: e.operator, "starts": 2, "hold_out": False}
    with pytest.raises(UntrustedFit, match="unidentifiable") as caught:
        fit(ECDL(RAPI.guess(recording)), recording, **options)
    verdict = caught.value.result.verdict
    assert {"alpha", "zeta", "eta"} <= set(verdict.unidentifiable)
    assert not {"d_1", "d_2", "lam"} & set(verdict.unidentifiable)
    saved = caught.value.result.to_dict()
    assert saved["parameters"]["eta"]["stderr"] is None
    json.dumps(saved, allow_nan=False)


def test_dead_parameters_are_named():
    """Without a scan rate, nothing depends on `zeta`."""
    one = first_run().runs[0]
    drive = Drive(one.drive.time, one.drive.value)
    recording = Recording.of([drive], [one.response])
    options = {"starts": 2, "hold_out": False, "history": False, "throw": False}
    got = fit(ECDL(RAPI.guess(recording)), recording, free=lambda e: e.operator, **options)
    assert "zeta" in got.verdict.unidentifiable and not np.isfinite(got["zeta"].stderr)
    assert got.to_dict()["parameters"]["zeta"]["stderr"] is None


def test_constant_drive_has_no_standard_errors(rapi, tmp_path):
    data(constant(1, 3.0))(tmp_path / "r")
    code, out, _ = rapi("fit", tmp_path / "r", "-o", tmp_path / "o", "--json", *FAST)
    model = assert_model(tmp_path / "o", out)
    assert code == 4
    for name in model["verdict"]["unidentifiable"]:
        assert model["parameters"][name]["stderr"] is None
    assert {"lam", "a", "d_1"} <= set(model["verdict"]["unidentifiable"])


@pytest.mark.parametrize(
    "command", ["fit", pytest.param("demo", marks=pytest.mark.slow), "predict"]
)
def test_interrupt(command, rapi, monkeypatch, fitted, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("fitting.identification._identify.identify", interrupt)
    monkeypatch.setattr("rapi_jax.io.read_model", interrupt)
    inputs = {"fit": [fitted / "recording"], "demo": [], "predict": [fitted, fitted / "recording"]}
    code, out, err = rapi(command, *inputs[command], "-o", tmp_path / "o")
    assert code == 130
    assert_one_line(err, "interrupted")


def process(*arguments: object, **options) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "fitting.cli", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL}
    return subprocess.Popen(command, text=True, **pipes, **options)


@pytest.mark.process
def test_as_a_process(fitted, tmp_path):
    """Exit codes and streams as a shell sees them."""
    data(put(0, 1, 3, NAN))(tmp_path / "bad")
    begun = {
        0: process(
            "predict", fitted, fitted / "recording", "-o", tmp_path / "o", "--json", "--no-plots"
        ),
        2: process("fit", fitted, "-o", tmp_path / "n", "--strats", "2"),
        3: process("fit", tmp_path / "bad", "-o", tmp_path / "p"),
        4: process(
            "fit",
            fitted / "recording",
            "-o",
            tmp_path / "q",
            "--json",
            *FAST[:2],
            "--starts",
            "1",
            "--no-plots",
        ),
    }
    said = {code: one.communicate(timeout=240) for code, one in begun.items()}
    assert [one.returncode for one in begun.values()] == list(begun)
    assert json.loads(said[0][0])["schema"] == "rapi.prediction/1" and said[0][1] == ""
    assert said[2][0] == said[3][0] == ""
    assert_one_line(said[2][1], "--starts")
    assert_one_line(said[3][1], "run00.csv", "sample 3")
    assert_model(tmp_path / "q", said[4][0])
    assert said[4][1] == ""


@pytest.mark.process
@pytest.mark.skipif(os.name == "nt", reason="no such signal")
@pytest.mark.parametrize("delay", [0.1, 1.3, 1.9, 2.8])
def test_a_real_interrupt(fitted, tmp_path, delay):
    """While JAX is loading, tracing, compiling or running."""
    options = ("--starts", "100", "--each", "lam,eta")
    one = process("fit", fitted / "recording", "-o", tmp_path / "o", *options)
    deadline = time.monotonic() + 120
    while not (tmp_path / "o").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(delay)
    one.send_signal(signal.SIGINT)
    _, err = one.communicate(timeout=240)
    assert one.returncode == 130 and not list((tmp_path / "o").iterdir()), err
    assert_one_line(err, "interrupted")


HELP = """
import sys
from fitting.commands.run import run
from fitting.cli import app
for arguments in ([], ["--help"], ["fit", "--help"], ["predict", "--help"], ["demo", "--help"]):
    assert run(app, arguments) == 0
    assert "jax" not in sys.modules and "numpy" not in sys.modules, arguments
assert run(app, ["fit", "--strats"]) == 2
assert "jax" not in sys.modules
"""


def test_help_and_usage_load_nothing_heavy():
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "RECORDING" in done.stdout
