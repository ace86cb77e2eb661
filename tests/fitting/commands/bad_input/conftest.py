"""A fit that commands may read."""

from pathlib import Path

import pytest
from bad_input import FAST, data

from fitting.cli import app
from fitting.commands.run import run


@pytest.fixture(scope="session")
def fitted(tmp_path_factory) -> Path:
    """A folder that `rapi fit` wrote."""
    folder = tmp_path_factory.mktemp("fitted")
    data(lambda recording: None)(folder / "recording")
    assert run(app, ["fit", str(folder / "recording"), "-o", str(folder), *FAST]) == 0
    return folder
