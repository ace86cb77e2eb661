"""A driver is one file: with its table and its `open` it is used from the command line."""

import contextlib
import json

import pytest
from benches import Served, bench_file

from fitting.cli import app
from fitting.commands.run import run
from hardware import ReplayDigitizer, TcpServer, open_bench, read_bench
from rapi_jax import DataError, triangle
from rapi_jax.io import read_recording, write_drive

pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")

GENERATOR = '''
"""A generator that speaks as an AFG31052 does, under a table of its own."""

from hardware import AFG31000, AbstractGenerator, AbstractGeneratorTable, Scpi


class OwnTable(AbstractGeneratorTable):
    address: str

    @property
    def resources(self):
        return (self.address,)


class OwnGenerator(AbstractGenerator):
    kind = "own-generator"
    Table = OwnTable
    supports_dry_run = True

    def __init__(self, inner):
        self._inner = inner

    @classmethod
    def open(cls, table, connector):
        return cls(AFG31000(Scpi(connector.connect(table.address, backend="@py"))))

    @property
    def identity(self):
        return "OWN GENERATOR"

    def set_trigger(self):
        self._inner.set_trigger()

    def channel(self, number, *, limits, load_ohm, park_v):
        return self._inner.channel(number, limits=limits, load_ohm=load_ohm, park_v=park_v)

    def close(self):
        self._inner.close()
'''

DIGITIZER = '''
"""An oscilloscope behind a voltage divider."""

import dataclasses

from hardware import AbstractDigitizer, AbstractDigitizerTable, InfiniiVision, Scpi


class OwnTable(AbstractDigitizerTable):
    address: str
    divider: float = 1.0

    @property
    def resources(self):
        return (self.address,)


class OwnDigitizer(AbstractDigitizer):
    kind = "own-digitizer"
    Table = OwnTable
    supports_dry_run = True

    def __init__(self, inner, divider):
        self._inner, self._divider = inner, divider

    @classmethod
    def open(cls, table, connector):
        link = connector.connect(table.address, backend="@py")
        return cls(InfiniiVision(Scpi(link, timeout_s=10.0)), table.divider)

    @property
    def identity(self):
        return "OWN DIGITIZER"

    def configure(self, asked):
        self._inner.configure(asked)

    def arm(self):
        self._inner.arm()

    def fetch(self, timeout_s):
        samples = self._inner.fetch(timeout_s)
        scale = {name: one * self._divider for name, one in samples.volts_per_code.items()}
        return dataclasses.replace(samples, volts_per_code=scale)

    def snapshot(self):
        return self._inner.snapshot()

    def close(self):
        self._inner.close()
'''

LASER = '''
"""A laser without a remote control: its settings are noted by hand."""

from hardware import AbstractLaser, AbstractLaserTable


class OwnTable(AbstractLaserTable):
    name: str
    current_ma: float

    @property
    def resources(self):
        return ()


class OwnLaser(AbstractLaser):
    kind = "own-laser"
    Table = OwnTable

    def __init__(self, table):
        self._table = table

    @classmethod
    def open(cls, table, connector):
        return cls(table)

    @property
    def identity(self):
        return self._table.name

    def check(self):
        pass

    def check_emission(self):
        pass

    def snapshot(self):
        return {"identity": self.identity, "current_ma": f"{self._table.current_ma:g}"}

    def close(self):
        pass
'''

FILES = {"generator": GENERATOR, "digitizer": DIGITIZER, "laser": LASER}


def rapi(*arguments):
    return run(app, [str(a) for a in arguments])


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Notes on what is in use, of this test alone."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def plugins(tmp_path):
    """The option that names the three files."""
    given = []
    for name, text in FILES.items():
        path = tmp_path / f"own_{name}.py"
        path.write_text(text)
        given += ["--plugin", path]
    return given


@pytest.fixture
def drive(tmp_path):
    path = tmp_path / "drive.csv"
    write_drive(triangle([40.0], amplitude=3.0, bias=3.0, samples=2000)[0], path)
    return path


def write_own(path):
    """Change a bench file to the tables of the drivers from outside."""
    text = path.read_text()
    at = {
        key: text[text.index(f"[{key}]") :].split('resource = "')[1].split('"')[0] for key in FILES
    }
    for name, keys in {
        "generator": f'kind = "own-generator"\naddress = "{at["generator"]}"',
        "laser": 'kind = "own-laser"\nname = "DL-7"\ncurrent_ma = 90',
        "digitizer": f'kind = "own-digitizer"\naddress = "{at["digitizer"]}"\ndivider = 2.0',
    }.items():
        text = text.replace(f'resource = "{at[name]}"', keys)
    limits = text[text.index("[laser.limits]") : text.index("[digitizer]")]
    path.write_text(text.replace(limits, ""))
    return path


def test_measured_and_checked_with_drivers_from_outside(tmp_path, plugins, drive, capsys):
    with contextlib.ExitStack() as stack:
        served = Served(stack, tmp_path, TcpServer)
        bench = write_own(served.bench)
        assert rapi("measure", bench, drive, "-o", tmp_path / "own", *plugins) == 0
        assert served.parked()
        capsys.readouterr()
        assert rapi("bench", "check", bench, "--json", *plugins) == 0
        found = json.loads(capsys.readouterr().out)
    assert found["generator"] == "OWN GENERATOR" and found["digitizer"] == "OWN DIGITIZER"
    assert found["laser_identity"] == "DL-7" and "2000 V/s" in found["limits"]
    recording = read_recording(tmp_path / "own")
    assert recording.provenance["laser_current_ma"] == "90"
    assert json.loads(recording.provenance["file"])["digitizer"]["divider"] == 2.0
    assert recording.runs[0].response.size == 3 * 2000  # three periods unless told otherwise


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({'"own-laser"': '"other-laser"'}, "no driver 'other-laser', only 'tlb6700', 'own-laser'"),
        (
            {"divider = 2.0": "divisor = 2.0"},
            "`digitizer.own-digitizer.divisor`: no such key; is `divider` meant?",
        ),
        ({'address = "GEN"': ""}, "`generator.own-generator.address`: Field required"),
        ({"step_v = 0.1": ""}, "`limits.step_v`: Field required"),
    ],
)
def test_their_tables_are_as_strict(tmp_path, plugins, drive, capsys, change, says):
    bench = write_own(bench_file(tmp_path))
    text = bench.read_text()
    for old, new in change.items():
        assert old in text
        text = text.replace(old, new)
    bench.write_text(text)
    assert rapi("measure", bench, drive, "-o", tmp_path / "own", *plugins) == 3
    assert says in " ".join(capsys.readouterr().err.split())


def test_without_the_files_the_kinds_are_unknown(tmp_path, drive, capsys):
    bench = write_own(bench_file(tmp_path))
    assert rapi("bench", "check", bench) == 3
    assert "no driver 'own-generator', only 'afg31000'" in capsys.readouterr().err


def test_a_dry_run_refuses_a_driver_that_does_not_support_it(tmp_path, plugins, drive, capsys):
    bench = write_own(bench_file(tmp_path))
    line = ("measure", bench, drive, "-o", tmp_path / "bytes", "--dry-run", *plugins)
    assert rapi(*line) == 3
    assert "A laser of kind 'own-laser' does not support a dry run" in capsys.readouterr().err
    laser = tmp_path / "own_laser.py"
    laser.write_text(LASER.replace("Table = OwnTable", "Table = OwnTable; supports_dry_run = True"))
    assert rapi(*line) == 0
    assert (tmp_path / "bytes" / "generator.bytes").read_bytes().startswith(b"*IDN?\n")


@pytest.mark.fault(
    name="a driver from outside with other limits or load", promise="refused before output"
)
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("limits=limits,", "limits=dataclasses.replace(limits, high_v=9.0),", "has wider limits"),
        (
            "load_ohm=load_ohm,",
            "load_ohm=1000.0,",
            "reckons with 1000 ohm, but the load is inf ohm",
        ),
    ],
)
def test_limits_and_load_are_the_benchs(tmp_path, drive, capsys, old, new, says):
    """A generator's driver that takes others is refused before anything is switched on."""
    path = tmp_path / "own_generator.py"
    path.write_text("import dataclasses\n" + GENERATOR.replace(old, new))
    change = {'resource = "GEN"': 'kind = "own-generator"\naddress = "GEN"'}
    bench = bench_file(tmp_path, change=change)
    line = ("measure", bench, drive, "-o", tmp_path / "bytes", "--dry-run", "--plugin", path)
    assert rapi(*line) == 3
    assert says in " ".join(capsys.readouterr().err.split())


def test_a_kind_is_given_once(tmp_path):
    class Second(ReplayDigitizer):
        """Another of the same kind."""

    for call in (read_bench, open_bench):
        with pytest.raises(DataError, match="two drivers of kind 'replay'"):
            call(bench_file(tmp_path), drivers=[Second])
