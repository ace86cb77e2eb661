"""Compiled programs kept between processes: private, quiet where damaged, off where told."""

import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from fitting.compile_cache import (
    DIRECTORY,
    SWITCH,
    cache_root,
    cache_state,
    clear_entries,
    count_entries,
    drop_oldest,
    machine_folder,
    worker_variables,
)

ROOT = Path(__file__).resolve().parents[3]
POSIX = pytest.mark.skipif(os.name == "nt", reason="owners and modes of POSIX")
SETTINGS = ("JAX_", "RAPI_", "PYTHONWARNINGS", "TF_CPP")
# Two small programs, as a command would run them; hits and misses of the cache.
PROGRAM = """
import sys
from fitting.compile_cache import compiled_programs_kept
with compiled_programs_kept(lambda line: print(line, file=sys.stderr)):
    import jax, jax.numpy as jnp, numpy as np
    seen = []
    jax.monitoring.register_event_listener(lambda name, **_: seen.append(name.rpartition("/")[2]))
    def slope(x): return jax.grad(lambda y: jnp.sin(y) @ y)(x)
    print(float(jax.jit(slope)(np.ones(50))[0]))
    print(float(jax.jit(jnp.sum)(np.ones(50))))
    print(seen.count("cache_hits"), seen.count("cache_misses"))
"""


@pytest.fixture(autouse=True)
def place(monkeypatch, tmp_path):
    """The environment of a user, whose cache is in a folder of the test."""
    for name in [name for name in os.environ if name.startswith(SETTINGS)]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("RAPI_CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path / "kept"


def started(*arguments):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, *arguments], cwd=ROOT, **pipes)


def ended(process, code=0):
    out, err = process.communicate(timeout=120)
    assert process.returncode == code, err
    return out, err


def rapi(*arguments):
    return ended(started("-m", "fitting.cli", *arguments))


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def entry(root, name="jit_f-0-cache", size=10, used=1000.0):
    folder = machine_folder(root)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(b"x" * size)
    os.utime(folder / name, (used, used))
    return folder / name


def test_two_processes_at_once_and_entries_that_are_damaged(place):
    both = [started("-W", "error", "-c", PROGRAM) for _ in range(2)]
    (*values, first), (*others, _) = (ended(one) for one in both)
    assert (first, values[0].split()[:2]) == ("", others[0].split()[:2])
    folder = machine_folder(place)
    entries = sorted(folder.iterdir())
    assert len(entries) >= 2 and {p.name.rpartition("-")[2] for p in entries} == {"cache"}
    if os.name != "nt":
        assert mode(place) == mode(folder) == 0o700
    for k, path in enumerate(entries):  # cut short, empty, of other bytes
        whole = path.read_bytes()
        path.write_bytes((whole[: len(whole) // 2], b"", b"other" * 100)[k % 3])
    for hits, misses in ((0, len(entries)), (len(entries), 0)):  # written anew, and then read
        out, err = ended(started("-W", "error", "-c", PROGRAM))
        assert (out.split(), err) == (values[0].split()[:2] + [str(hits), str(misses)], "")


CONFIGURED = f"""
import os
before = {{*os.environ, "TF_CPP_MIN_LOG_LEVEL"}}  # JAX sets that one
import sys, fitting, rapi_jax, fitting.cli
from fitting import fit
import jax
assert jax.config.jax_compilation_cache_dir is None
assert jax.config.jax_persistent_cache_min_compile_time_secs == 1.0
assert not [name for name in os.environ if name.startswith({SETTINGS!r}) and name not in before]
heavy = {{"scipy", "matplotlib", "xarray", "h5py", "jinja2"}} & set(sys.modules)
assert not heavy, heavy
"""


def test_an_import_changes_no_setting_of_jax_and_loads_what_a_fit_needs(place):
    assert ended(started("-c", CONFIGURED)) == ("", "")
    assert not place.exists()


def test_the_command_shows_and_clears_it(place):
    assert rapi("fit", "--help")[1] == "" and not place.exists()
    other = place / "mine.txt"
    entry(place, size=1500)
    other.write_text("of the user")
    target = place.parent / "elsewhere"
    target.mkdir()
    (target / "jit_g-0-cache").write_text("of the user")
    linked = place / "jax-0123456789abcdef"
    linked.symlink_to(target, target_is_directory=True)
    place.chmod(0o700)
    about = json.loads(rapi("cache", "--json")[0])
    assert (about["schema"], about["folder"]) == ("rapi.cache/1", str(place))
    assert (about["on"], about["entries"], about["bytes"]) == (True, 1, 1500)
    out, err = rapi("cache", "--clear")
    assert err == "" and "removed  1, 0.0 MB" in out and "off" not in out
    assert sorted(place.iterdir()) == [linked, other]
    assert [p.name for p in target.iterdir()] == ["jit_g-0-cache"]
    assert "RAPI_COMPILE_CACHE is 0" in rapi("cache", "--no-compile-cache")[0]


@POSIX
def test_a_folder_that_others_can_write_is_refused_with_one_note(place):
    place.mkdir()
    place.chmod(0o770)
    out, err = rapi("cache")
    assert "can be written by other users" in out
    assert err.count("\n") == 1 and "not kept" in err and "RAPI_CACHE_DIR" in err
    assert list(place.iterdir()) == []


@POSIX
def test_what_is_not_private_is_refused(place, monkeypatch):
    place.mkdir(mode=0o755)  # others may read it
    machine_folder(place).mkdir(mode=0o755)
    assert cache_state().folder == machine_folder(place)
    machine_folder(place).chmod(0o702)
    assert cache_state().insecure
    machine_folder(place).rmdir()
    (place.parent / "link").symlink_to(place)
    monkeypatch.setenv("RAPI_CACHE_DIR", str(place.parent / "link"))
    assert "symbolic link" in cache_state().reason
    clear_entries(place.parent / "link")
    (place.parent / "open").mkdir()
    (place.parent / "open").chmod(0o777)
    monkeypatch.setenv("RAPI_CACHE_DIR", str(place.parent / "open" / "kept"))
    assert "by anybody" in cache_state().reason
    monkeypatch.setenv("RAPI_CACHE_DIR", str(place))
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert "another user" in cache_state().reason and cache_state().insecure


def test_where_no_folder_can_be_made_it_is_off_without_a_note(place, monkeypatch):
    place.write_text("a file")
    monkeypatch.setenv("RAPI_CACHE_DIR", str(place / "within"))
    assert (cache_state().folder, cache_state().insecure) == (None, False)
    monkeypatch.delenv("RAPI_CACHE_DIR")
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)

    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert (cache_root(), cache_state().insecure) == (None, False)


def test_variables_turn_it_off_and_processes_inherit_it(place, monkeypatch):
    assert worker_variables(place)[DIRECTORY] == str(machine_folder(place))
    for value in ("0", "off", "False"):
        monkeypatch.setenv(SWITCH, value)
        assert cache_state().folder is None and SWITCH in cache_state().reason
        assert worker_variables(place) == {}
    monkeypatch.setenv(SWITCH, "1")
    assert cache_state().folder == machine_folder(place)
    monkeypatch.setenv(DIRECTORY, str(machine_folder(place)))  # of a process that started this
    assert cache_state().folder == machine_folder(place) and worker_variables(place) == {}
    for own in ("", str(place.parent / "own")):
        monkeypatch.setenv(DIRECTORY, own)
        assert cache_state().folder is None and DIRECTORY in cache_state().reason
        assert worker_variables(place) == {}
    out, err = ended(started("-c", PROGRAM))
    assert (out.split()[2:], err) == (["0", "0"], "") and count_entries(place).count == 0


def test_the_oldest_entries_are_dropped_beyond_the_bound(place):
    paths = [entry(place, f"jit_{k}-0-cache", used=1000.0 + k) for k in range(5)]
    drop_oldest(place, 30)
    assert [path.exists() for path in paths] == [False, False, True, True, True]
    assert (count_entries(place).count, count_entries(place).size) == (3, 30)
    drop_oldest(place)
    assert clear_entries(place).count == 3 and not place.exists()
