"""Run as a script by `test_atomic.py`: writers that are killed, compete, or meet a full disk.

It imports what it needs without the packages' `__init__`, and so without JAX, to be able to fork.
"""

import os
import random
import signal
import sys
import time
import types
import warnings
from pathlib import Path

root = Path(__file__).resolve().parents[3]
for name in ("rapi_jax", "rapi_jax.io"):
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = [str(root / name.replace(".", "/"))]
sys.path.insert(0, str(Path(__file__).parent))
warnings.simplefilter("error")

from conftest import make_recording  # noqa: E402

from rapi_jax.io import _atomic  # noqa: E402
from rapi_jax.io.recordings import _read_write as io  # noqa: E402


def spawn(body, *args):
    """Fork a child that runs `body`; its process id."""
    child = os.fork()
    if child == 0:
        try:
            body(*args)
        finally:
            os._exit(0)
    return child


def write_forever(recordings, path):
    """Overwrite `path` with one recording after another."""
    while True:
        for recording in recordings:
            io.write_recording(recording, path)


def kill(path, trials):
    """SIGKILL a writer at random moments; every time `path` must hold one whole recording."""
    recordings = [make_recording(seed, 3000) for seed in (0, 1)]
    whole = {recording.sha256() for recording in recordings}
    moments = random.Random(0)
    io.write_recording(recordings[0], path)
    for _ in range(trials):
        child = spawn(write_forever, recordings, path)
        time.sleep(moments.uniform(0.0, 0.06))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        assert io.read_recording(path).sha256() in whole
    print("whole", trials)


def die_at(call):
    """End this process by SIGKILL at its `call`th call that changes what is on the disk."""
    calls = iter(range(call))

    def counted(original):
        def call(*args, **kwargs):
            if next(calls, None) is None:
                os.kill(os.getpid(), signal.SIGKILL)
            return original(*args, **kwargs)

        return call

    for name in ("open", "fsync", "rename", "replace", "unlink"):
        setattr(os, name, counted(getattr(os, name)))


def step(path, trials):
    """SIGKILL an update at each of its calls of the system; the next write removes what it left."""
    recordings = [make_recording(seed, 50) for seed in (0, 1)]
    whole = {recording.sha256() for recording in recordings}
    left = set()
    for call in range(trials):
        io.write_recording(recordings[0], path)
        mine = Path(path) / "run01-0123abcd.csv"
        mine.write_text("mine")

        def update(call=call):
            die_at(call)
            io.write_recording(recordings[1], path)

        status = os.waitpid(spawn(update), 0)[1]
        assert io.read_recording(path).sha256() in whole
        left |= {file.suffix for file in Path(path).iterdir()} - {".toml"}
        io.write_recording(recordings[0], path)
        assert len(list(Path(path).iterdir())) == 4, sorted(Path(path).iterdir())
        assert mine.read_text() == "mine"
        if status == 0:
            assert left == {".csv", ".update"}
            print("every", call)
            return


def compete(path, trials):
    """Two writers of one path; it must end as one of their recordings."""
    recordings = [make_recording(seed, 2000 + 500 * seed) for seed in (0, 1)]

    def write(recording):
        for _ in range(trials):
            io.write_recording(recording, path)

    children = [spawn(write, recording) for recording in recordings]
    for child in children:
        assert os.waitpid(child, 0)[1] == 0
    assert io.read_recording(path).sha256() in {r.sha256() for r in recordings}
    print("whole", trials)


def full(path, trials):
    """Overwrite on a full disk; the old recording stays, and nothing else."""
    del trials
    if str(path).startswith("rlimit:"):
        import resource

        path = path.removeprefix("rlimit:")
        io.write_recording(make_recording(0), path)
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
    else:
        io.write_recording(make_recording(0), path)
    before = sorted(Path(path).parent.rglob("*"))
    try:
        io.write_recording(make_recording(1, 200_000), path)
    except _atomic.OutputError as error:
        print(error)
    else:
        print("written")
    assert io.read_recording(path).sha256() == make_recording(0).sha256()
    assert sorted(Path(path).parent.rglob("*")) == before
    assert "jax" not in sys.modules
    print("whole 1")


if __name__ == "__main__":
    modes = {"kill": kill, "step": step, "compete": compete, "full": full}
    modes[sys.argv[1]](sys.argv[2], int(sys.argv[3]))
