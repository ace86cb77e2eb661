"""Killed writers and full disks leave results that are whole, or refused by name when read.

`tests/benchmarks/torn_results.py` does the same 200 times, and at more bytes.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.fault(
    name="SIGKILL at a random moment, and a full disk, while results are written",
    promise="the first result, the second, or refused by name",
    trials=34,
    seed=0,
)
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("kind", ["fit", "diagnose", "compensate"])
@pytest.mark.process
def test_what_is_left_is_whole_or_refused(kind):
    command = [sys.executable, "-m", "tests.benchmarks.torn_results", "--kind", kind]
    options = ["--kills", "10", "--positions", "12", "--part", "kills", "quota", "limit"]
    done = subprocess.run([*command, *options], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[1] for line in lines] == ["kills", "quota", "limit"]
    assert all("refused" in line and "TORN" not in line for line in lines[1:])
