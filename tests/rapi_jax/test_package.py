"""What is imported is this project, from wherever it is imported."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("package", ["rapi_jax", "fitting", "hardware"])
def test_the_package_is_this_projects(package, tmp_path):
    """The names are common words: another installed package must not answer to them."""
    code = f"import {package}; print({package}.__file__)"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    found = Path(done.stdout.strip()).resolve()
    assert found == ROOT / package / "__init__.py"
