"""Files that are not trusted: other files stay unread, memory and time bounded, one line said."""

import ast
import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rapi_jax.io
from rapi_jax._errors import DataError
from rapi_jax.io import printable, read_recording, write_recording
from rapi_jax.io._safe import bytes_on_disk, inside, open_regular, read_text

SECRET = "not-for-you"


@given(st.text())
def test_printable_is_one_line_safe_on_a_terminal_and_short(text):
    safe = printable(text)
    assert safe.isprintable() and len(safe) <= 203
    assert safe == text or not text.isprintable() or len(text) > 200


def test_printable_shows_what_was_there():
    assert printable("a\x1b[2J\r\n\u202e\x9b\udc80") == "a\\x1b[2J\\r\\n\\u202e\\x9b\\udc80"


@pytest.mark.fault(name="paths out of the folder", promise="refused")
@pytest.mark.parametrize(
    "file",
    ["/etc/passwd", "../x.csv", "a/../../x.csv", "..", "", ".", "C:\\x", "\\x", "a\\..\\b", "a\0b"],
)
def test_paths_out_of_the_folder_are_refused(tmp_path, file):
    with pytest.raises(DataError, match="must be a plain path"):
        inside(tmp_path, file)


@pytest.mark.fault(name="a name in a manifest that is too long", promise="refused")
@pytest.mark.parametrize("file", ["a" * 300, "b/" * 30 + "a" * 300, "a/" * 3000])
def test_a_name_that_is_too_long_is_refused_when_it_is_opened_at_the_latest(tmp_path, file):
    with pytest.raises(DataError) as caught:
        with open_regular(inside(tmp_path, file)):
            pass
    assert str(caught.value).isprintable() and len(str(caught.value)) < 600


@pytest.mark.fault(name="links out of the folder", promise="refused")
def test_links_out_of_the_folder_are_refused_and_links_within_followed(tmp_path):
    folder = tmp_path / "r"
    folder.mkdir()
    (tmp_path / "secret.csv").write_text(SECRET)
    (folder / "a.csv").write_text("")
    for name, target in [
        ("out.csv", "../secret.csv"),
        ("up", ".."),
        ("in.csv", "a.csv"),
        ("o", "o"),
    ]:
        (folder / name).symlink_to(target)
    for file in ("out.csv", "up/secret.csv"):
        with pytest.raises(DataError, match="a link out of"):
            inside(folder, file)
    assert inside(folder, "in.csv") == folder / "in.csv"
    (tmp_path / "link").symlink_to("r")  # the folder itself may be one
    assert inside(tmp_path / "link", "a.csv")
    with pytest.raises(DataError):
        with open_regular(inside(folder, "o")):
            pass


@pytest.mark.fault(name="a manifest that points elsewhere", promise="refused")
@pytest.mark.parametrize("file", ["/etc/passwd", "../secret.csv", "out.csv", "pipe", "sub", "../r"])
def test_a_manifest_cannot_point_elsewhere(tmp_path, file):
    folder = tmp_path / "r"
    (folder / "sub").mkdir(parents=True)
    (tmp_path / "secret.csv").write_text(SECRET)
    (folder / "out.csv").symlink_to("../secret.csv")
    os.mkfifo(folder / "pipe")
    (folder / "manifest.toml").write_text(
        'schema = "rapi.recording/1"\nresponse_unit = "GHz"\ndrive_unit = "V"\n'
        f'[[run]]\nfile = "{file}"\n'
    )
    assert SECRET not in refused(folder)


def test_a_manifest_that_is_a_link_out_is_not_read(tmp_path):
    (tmp_path / "secret").write_text(SECRET)
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "manifest.toml").symlink_to("../secret")
    assert "a link out of" in refused(tmp_path / "r")


def refused(path: Path) -> str:
    """The line with which a recording is refused, within a second or so of work and 200 MB."""
    import resource

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    with pytest.raises(DataError) as caught:
        read_recording(path)
    assert time.process_time() - start < 5
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 * 1024
    said = str(caught.value)
    assert said.isprintable() and SECRET not in said and len(said) < 600
    return said


def _external_link(file, where):
    del file["run01/response"]
    file["run01/response"] = h5py.ExternalLink(str(where / "other.nc"), "/run01/response")


def _external_group(file, where):
    file["run02"] = h5py.ExternalLink("other.nc", "/run01")


def _soft_link(file, where):
    file["run01/more"] = h5py.SoftLink("/run00/drive")


def _dangling_link(file, where):
    file["run02"] = h5py.SoftLink("/\x1b[2Jnowhere")


def _external_storage(file, where):
    del file["run01/response"]
    file["run01"].create_dataset(
        "response", (400,), "f8", external=[(str(where / "secret"), 0, 3200)]
    )


def _virtual(file, where):
    layout = h5py.VirtualLayout((400,), "f8")
    layout[:] = h5py.VirtualSource(str(where / "other.nc"), "run01/response", (400,))
    del file["run01/response"]
    file["run01"].create_virtual_dataset("response", layout)


def _endless_virtual(file, where):
    layout = h5py.VirtualLayout((1,), "f8", maxshape=(None,))
    source = h5py.VirtualSource(str(where / "pipe"), "x", (1,), maxshape=(None,))
    unlimited = h5py.h5s.UNLIMITED
    layout[:unlimited] = source[:unlimited]
    file["run01"].create_virtual_dataset("more", layout)


def _filter(file, where):
    file["run01"].create_dataset("more", data=np.arange(400.0), compression="lzf")


def _huge(file, where):
    file["run01"].create_dataset("more", (10**12,), "f8", chunks=(1000,))


def _ratio(file, where):
    file["run01"].create_dataset("more", (4 * 10**7,), "f8", chunks=(1000,))


def _chunk(file, where):
    file["run01"].create_dataset(
        "more", (3,), "f8", chunks=(10**8,), maxshape=(None,), compression=9
    )


def _strings(file, where):
    file["run01"].create_dataset("more", data=["a", "b"], dtype=h5py.string_dtype())


def _named_type(file, where):
    file["run01/more"] = np.dtype("f8")


def _attributes(file, where):
    for i in range(1001):
        file["run01"].attrs[f"a{i}"] = i


HOSTILE = {
    _external_link: "'/run01/response' is an external link",
    _external_group: "'/run02' is an external link",
    _soft_link: "'/run01/more' is a soft link",
    _dangling_link: "'/run02' is a soft link",
    _external_storage: "'/run01/response' keeps its data in another file",
    _virtual: "'/run01/response' is a virtual dataset",
    _endless_virtual: "'/run01/more' is a virtual dataset",
    _filter: "'/run01/more' uses filter 32000; only deflate, shuffle, fletcher32 are read",
    _huge: "at most 4294967296 bytes",
    _ratio: "and 1000 times are read",
    _chunk: "and 1000 times are read",
    _strings: "'/run01/more' does not hold plain numbers",
    _named_type: "'/run01/more' is neither group nor dataset",
    _attributes: "'/run01' has 100",
}


@pytest.mark.fault(name="hostile HDF5", promise="refused in one line")
@pytest.mark.parametrize(
    ("change", "said"), HOSTILE.items(), ids=[change.__name__ for change in HOSTILE]
)
def test_hostile_hdf5_is_refused(tmp_path, recording, change, said):
    for name in ("r.nc", "other.nc"):
        write_recording(recording, tmp_path / name)
    (tmp_path / "secret").write_text(SECRET * 1000)
    os.mkfifo(tmp_path / "pipe")
    with h5py.File(tmp_path / "r.nc", "r+") as file:
        change(file, tmp_path)
    assert said in refused(tmp_path / "r.nc")


def test_a_circle_of_groups_ends(tmp_path, recording):
    write_recording(recording, tmp_path / "r.nc")
    with h5py.File(tmp_path / "r.nc", "r+") as file:
        file["run01/again"] = file["/"]
    assert read_recording(tmp_path / "r.nc").sha256() == recording.sha256()


@pytest.mark.process
def test_a_heap_that_never_ends_is_given_up(tmp_path, recording):
    path = tmp_path / "r.nc"
    write_recording(recording, path)
    content = bytearray(path.read_bytes())
    heap = content.index(b"GCOL") + 16
    content[heap : heap + 16] = bytes(16)  # an object of no size: libhdf5 reads it for ever
    path.write_bytes(content)
    assert "did not end" in refused(path)


def test_holes_do_not_count_as_stored(tmp_path):
    path = tmp_path / "r.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("a/drive", (10**8,), "f8")
        file["a/drive"][-1] = 1.0  # 800 MB, almost all of it a hole
    with open_regular(path) as file:
        if bytes_on_disk(file) > 8e5:
            pytest.skip("this file system keeps no holes")
    assert "1000 times are read" in refused(path)


@pytest.mark.fault(
    name="large files, pipes, devices and folders in a file's place", promise="refused"
)
def test_large_files_pipes_devices_and_folders_are_refused(tmp_path):
    (tmp_path / "large").touch()
    os.truncate(tmp_path / "large", 5 * 2**30)
    os.mkfifo(tmp_path / "pipe")
    assert "at most 4294967296 are read" in refused(tmp_path / "large")
    assert "not a regular file" in refused(tmp_path / "pipe")
    assert "not a regular file" in refused(Path("/dev/zero"))
    os.truncate(tmp_path / "large", 3 * 2**30)
    with pytest.raises(DataError, match="NUL bytes"):
        read_text(tmp_path / "large")
    with pytest.raises(DataError, match="at most 10 are read"):
        (tmp_path / "text").write_text("x" * 11)
        read_text(tmp_path / "text", 10)


def test_no_pickle_yaml_or_eval_and_no_jax_for_recordings():
    folder = Path(rapi_jax.io.__file__).parent
    for path in folder.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imported = {
            name.name.split(".")[0]
            for node in ast.walk(tree)
            if isinstance(node, ast.Import)
            for name in node.names
        } | {
            str(node.module).split(".")[0]
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.level == 0
        }
        assert not imported & {"pickle", "yaml", "shelve", "marshal"}, path
        assert path.name == "_model_file.py" or not imported & {"jax", "equinox"}, path
        called = {
            n.func.id for n in ast.walk(tree) if isinstance(n, ast.Call) and hasattr(n.func, "id")
        }
        assert not called & {"eval", "exec", "compile", "__import__"}, path


def test_reading_recordings_loads_nothing_heavy():
    code = (
        "import sys, types\n"
        "for name, folder in (('rapi_jax', sys.argv[1]), ('rapi_jax.io', sys.argv[1] + '/io')):\n"
        "    sys.modules[name] = types.ModuleType(name); sys.modules[name].__path__ = [folder]\n"
        "import rapi_jax.io.recordings._read_write, rapi_jax.io.recordings._oscilloscope\n"
        "print(sorted({'jax', 'xarray', 'h5py', 'pydantic', 'pandas'} & set(sys.modules)))"
    )
    folder = str(Path(rapi_jax.io.__file__).parents[1])
    done = subprocess.run([sys.executable, "-c", code, folder], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr
