"""TOML that is not trusted: small text that would take all memory, depth or digits is refused."""

import pytest
from benches import bench_file

from fitting.batch.jobs._jobs_file import read_jobs_file
from hardware import read_bench
from rapi_jax import DataError
from rapi_jax.io import read_limits, read_recording

HOSTILE = {
    "deep": "x = " + "[" * 20_000 + "]" * 20_000,
    "deep tables": "x = " + "{a = " * 20_000 + "1" + "}" * 20_000,
    "dots": "a" + ".a" * 60_000 + " = 1",
    "a table of dots": "[a" + ".a" * 60_000 + "]",
    "digits": "x = " + "9" * 5000,
    "NUL": "x = 1\0",
    "no text": "x = 1\udcff",
}


@pytest.mark.fault(
    name="hostile TOML: deep, dotted, of long integers",
    promise="refused in one line by every reader",
)
@pytest.mark.parametrize("name", HOSTILE)
def test_every_reader_refuses_it_in_one_line(tmp_path, name):
    (tmp_path / "manifest.toml").write_bytes(HOSTILE[name].encode(errors="surrogateescape"))
    for read, path in (
        (read_recording, tmp_path),
        (read_limits, tmp_path / "manifest.toml"),
        (read_bench, tmp_path / "manifest.toml"),
        (read_jobs_file, tmp_path / "manifest.toml"),
    ):
        with pytest.raises(DataError, match="manifest") as caught:
            read(path)
        said = str(caught.value)
        assert said.isprintable() and len(said) < 400 and "set_int_max" not in said
        assert said.count("manifest.toml") == 1


NOT_NUMBERS = ("true", '"7.5"', "nan", "1" + "0" * 400, "2026-11-24", "[7.5]")


@pytest.mark.parametrize("text", NOT_NUMBERS)
@pytest.mark.parametrize(
    ("old", "key"),
    [
        ("high_v = 7.5", "limits.high_v"),
        ("wavelength_nm = [765.0,", "laser.limits.wavelength_nm"),
        ("sample_hz = 10e6", "digitizer.sample_hz"),
    ],
)
def test_what_is_not_a_number_is_none_in_a_bench_file(tmp_path, old, key, text):
    path = bench_file(tmp_path)
    read_bench(path)
    new = f"{old.partition('=')[0]}= {'[' * old.endswith(',')}{text}{',' * old.endswith(',')}"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(DataError, match=key):
        read_bench(path)
