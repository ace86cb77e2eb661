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


def test_public_names_are_listed_before_they_are_loaded():
    """For the Tab key and `from fitting import *`, while nothing heavy is imported."""
    code = """
import sys
import fitting
assert {"identify", "diagnose", "FitResult"} <= set(dir(fitting)) >= set(fitting.__all__)
assert not {"importlib", "Any", "_HOME"} & set(dir(fitting))
assert "jax" not in sys.modules
from fitting import identify
assert dir(fitting).count("identify") == 1
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
