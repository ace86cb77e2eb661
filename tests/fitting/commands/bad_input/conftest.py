"""Commands in this process, and a fit that they may read."""

from collections.abc import Callable
from pathlib import Path

import pytest
from bad_input import FAST, data

from fitting.cli import app
from fitting.commands.run import run


@pytest.fixture
def rapi(capfd) -> Callable[..., tuple[int, str, str]]:
    """`rapi` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, [str(a) for a in arguments])
        said = capfd.readouterr()
        return code, said.out, said.err

    return call


@pytest.fixture(scope="session")
def fitted(tmp_path_factory) -> Path:
    """A folder that `rapi fit` wrote."""
    folder = tmp_path_factory.mktemp("fitted")
    data(lambda recording: None)(folder / "recording")
    assert run(app, ["fit", str(folder / "recording"), "-o", str(folder), *FAST]) == 0
    return folder
