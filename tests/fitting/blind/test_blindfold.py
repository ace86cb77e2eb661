"""The blindfold refuses every way to an answer; each attempt is a process of its own."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
BLINDFOLDED = """
import os, sys
from pathlib import Path
bank = Path(sys.argv[1])
{before}
if sys.argv[2] == "blind":
    from fitting.blind.prediction._blindfold import BlindfoldError, install
    refused = install(bank / "answers")
else:
    class BlindfoldError(Exception): ...
    refused = []
try:
    {attempt}
except BlindfoldError as error:
    assert isinstance(error, PermissionError) and refused
    print("refused")
except BaseException as error:
    print(type(error).__name__, error)
else:
    print("done")
"""
FILE = 'str(bank / "answers" / "world-1.json")'
ATTEMPTS = {
    "open": f"open({FILE}).read()",
    "bytes": f"open(os.fsencode({FILE})).read()",
    "os.open": f"os.read(os.open({FILE}, os.O_RDONLY), 9)",
    "write": f"open({FILE}, 'a')",
    "link": "(bank / 'recordings' / 'link.json').read_text()",
    "linked folder": "(bank / 'recordings' / 'folder' / 'world-1.json').read_text()",
    "through the parent": "(bank / 'recordings' / '..' / 'answers' / 'world-1.json').read_text()",
    "relative": "open('answers/world-1.json').read()",
    "folder's handle": "os.open('answers/world-1.json', os.O_RDONLY,"
    " dir_fd=os.open(bank, os.O_RDONLY))",
    "handle of the answers": "os.open(bank / 'answers', os.O_RDONLY)",
    "root of a process": f"open('/proc/self/root' + {FILE}).read()",
    "change of folder": "os.chdir(bank / 'answers')",
    "listdir": "os.listdir(bank / 'answers')",
    "scandir": "list(os.scandir(bank / 'answers'))",
    "walk": "[entry for entry in (bank / 'answers').iterdir()]",
    "rename": "os.rename(bank / 'answers', bank / 'recordings' / 'mine')",
    "hard link": f"os.link({FILE}, bank / 'recordings' / 'mine')",
    "symbolic link": "os.symlink(bank / 'answers', bank / 'recordings' / 'mine')",
    "copy": f"__import__('shutil').copy({FILE}, bank / 'recordings' / 'mine')",
    "chmod": "os.chmod(bank / 'answers', 0o777)",
    "remove": f"os.remove({FILE})",
    "loadtxt": f"__import__('numpy').loadtxt({FILE}, dtype=str)",
    "fromfile": f"__import__('numpy').fromfile({FILE}, dtype='u1')",
    "memory map": f"__import__('numpy').memmap({FILE})",
    "h5py": "__import__('h5py').File(bank / 'answers' / 'world-1.h5')",
    "h5py otherwise": "__import__('importlib').import_module('h5py')",
    "sqlite3": "__import__('importlib').import_module('sqlite3')",
    "another program": f"__import__('subprocess').run(['cat', {FILE}])",
    "shell": "os.system('true')",
    "popen": "os.popen('true').read()",
    "spawn": "os.posix_spawn('/bin/true', ['true'], {})",
    "fork": "os.fork() or os._exit(0)",
    "exec": "os.execv('/bin/true', ['true'])",
    "unreported program": "__import__('multiprocessing.util').util.spawnv_passfds("
    "b'/bin/true', ['true'], [])",
    "ctypes": "__import__('ctypes').CDLL(None).getpid()",
    "world": "from fitting.blind.simulator._simulated_device import draw_device",
    "bank": "import fitting.blind.simulator._bank",
    "kinds": "__import__('importlib').import_module('fitting.blind.simulator.effects._kinds')",
    "source": "open(__import__('fitting.blind').blind.__path__[0]"
    " + '/simulator/_simulated_device.py').read()",
}


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    """Files as a bank has them."""
    root = tmp_path_factory.mktemp("blindfold") / "bank"
    for name in ("answers", "answers_of_others", "recordings", "predictions"):
        (root / name).mkdir(parents=True)
    (root / "answers" / "world-1.json").write_text("12345678")
    (root / "recordings" / "link.json").symlink_to(root / "answers" / "world-1.json")
    (root / "recordings" / "folder").symlink_to("../answers")
    (root / "bank.json").write_text("{}")
    return root


def attempt(bank, what, how="blind", before=""):
    """What a process prints that tries it, in the bank's folder."""
    code = BLINDFOLDED.format(attempt=what, before=before)
    done = subprocess.run(
        [sys.executable, "-c", code, str(bank), how],
        cwd=bank, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    return done.stdout.strip() or done.stderr.strip().split("\n")[-1]


@pytest.mark.parametrize("what", ATTEMPTS.values(), ids=ATTEMPTS)
def test_refused(bank, what):
    before = sorted(path.name for path in bank.rglob("*"))
    assert attempt(bank, what) == "refused"
    assert sorted(path.name for path in bank.rglob("*")) == before
    assert (bank / "answers" / "world-1.json").read_text() == "12345678"


HARMLESS = ("open", "os.open", "link", "linked folder", "relative", "folder's handle", "listdir",
            "loadtxt", "fromfile", "memory map", "spawn", "world", "source")  # fmt: skip


@pytest.mark.parametrize("name", HARMLESS)
def test_what_is_refused_works_without(bank, name):
    """So the refusals are the blindfold's and not the attempts' own errors."""
    assert attempt(bank, ATTEMPTS[name], "sighted") == "done"


@pytest.mark.parametrize(
    "what",
    [
        "open(bank / 'bank.json').read()",
        "os.listdir(bank)",
        "os.listdir(bank / 'answers_of_others')",
        "(bank / 'predictions' / 'world-1.json').write_text('mine')",
        "__import__('fitting.blind.prediction._predict')",
        "__import__('fitting.blind.simulator._scan')",
        "os.putenv('HERE', 'answers')",
    ],
)
def test_what_a_diagnosis_needs_is_allowed(bank, what):
    assert attempt(bank, what) == "done"


@pytest.mark.parametrize("module", ["h5py", "fitting.blind.simulator.effects._kinds"])
def test_it_does_not_go_on_too_late(bank, module):
    said = attempt(bank, "pass", before=f"import {module}")
    assert "too late" in said and module in said


def test_a_name_that_is_replaced_changes_nothing(bank):
    what = f"setattr(os.path, 'realpath', lambda path: '/'); open({FILE})"
    assert attempt(bank, f"exec({what!r})") == "refused"
