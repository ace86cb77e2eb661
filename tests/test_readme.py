"""The README's section on one's own data does what it says, as it stands."""

import re
import shlex
from pathlib import Path

import pytest
from scope_files import MAKERS, put, scanned

from fitting.cli import app
from fitting.commands.run import run

README = Path(__file__).resolve().parents[1] / "README.md"
SECTION = r"<!-- own data -->\n```bash\n(.*?)```(.*?)```python\n(.*?)```"
GHZ_PER_V = 4.5


@pytest.fixture
def section(tmp_path, monkeypatch) -> tuple[str, str]:
    """The commands and the code, in a folder with a scope's file: a detector of 4.5 GHz/V."""
    t, u, y = scanned((10.0, 3, 4.5), (20.0, 3, 4.5), (40.0, 3, 4.5), sample_hz=8000.0)
    put(tmp_path / "scope.csv", MAKERS["Tektronix"][0](t, u, y / GHZ_PER_V))
    monkeypatch.chdir(tmp_path)
    found = re.search(SECTION, README.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1], found[3]


def test_commands_on_own_data(section, capsys):
    commands = [shlex.split(line, comments=True) for line in section[0].splitlines()]
    assert [words[:2] for words in commands] == [
        ["rapi", "import"], ["rapi", "check"], ["rapi", "fit"],
    ]  # fmt: skip
    for words in commands:
        assert run(app, words[1:]) == 0, capsys.readouterr()
    assert Path("result/model.json").is_file() and Path("my-recording/preview.png").is_file()


def test_python_on_own_data(section):
    names: dict = {}
    exec(compile(section[1], str(README), "exec"), names)
    assert names["imported"].notes
    assert Path("my-recording/manifest.toml").is_file()
