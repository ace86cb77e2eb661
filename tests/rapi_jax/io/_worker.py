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
    {"kill": kill, "compete": compete, "full": full}[sys.argv[1]](sys.argv[2], int(sys.argv[3]))
