"""Batches ended by SIGKILL leave nothing torn, and end as if nobody had ended them.

`tests/benchmarks/batch.py` does the same 200 times, and ends workers and schedulers, too.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.process
def test_a_few_kills():
    command = [sys.executable, "-m", "tests.benchmarks.batch", "--kills", "4", "--jobs", "6"]
    done = subprocess.run([*command, "--part", "process"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "4 kills" in done.stdout and "nothing torn, none twice" in done.stdout
