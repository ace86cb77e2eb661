"""Commands in this process."""

from collections.abc import Callable

import pytest

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
