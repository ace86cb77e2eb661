"""The README and the guide do what they say, as they stand."""

import ast
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scope_files import MAKERS, put, scanned

from fitting.cli import app
from fitting.commands.run import run
from rapi_jax.io import ImportOptions, import_recording, read_recording, write_import

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
PAGES = (README, *sorted((ROOT / ".github/guide").glob("*.md")))
GHZ_PER_V = 4.5


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)


def marked(name: str, language: str) -> str:
    found = re.search(rf"<!-- {name} -->\n```{language}\n(.*?)```", README.read_text("utf-8"), re.S)
    assert found is not None
    return found[1]


def commands(text: str) -> list[list[str]]:
    """The arguments of each `rapi` in a block."""
    words = [shlex.split(line, comments=True) for line in text.splitlines() if "rapi " in line]
    lines = [
        " ".join(shlex.quote(w) if w not in ("&&", "&") else "&&" for w in one) for one in words
    ]
    parts = [shlex.split(part) for line in lines for part in line.split("&&")]
    return [part[1:] for part in parts if part[:1] == ["rapi"]]


def executed(text: str, page: Path, names: dict) -> dict:
    exec(compile(text, str(page), "exec"), names)
    return names


@pytest.fixture
def scope(tmp_path, monkeypatch) -> Path:
    """A folder with a scope's file: a detector of 4.5 GHz/V."""
    t, u, y = scanned((10.0, 3, 4.5), (20.0, 3, 4.5), (40.0, 3, 4.5), sample_hz=8000.0)
    put(tmp_path / "scope.csv", MAKERS["Tektronix"][0](t, u, y / GHZ_PER_V))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def imported(folder: Path) -> None:
    options = ImportOptions(
        drive="CH1", response="CH2", response_scale=GHZ_PER_V, response_unit="GHz"
    )
    write_import(import_recording("scope.csv", options), folder / "my-recording")


def test_readme_is_short_and_its_links_lead_somewhere():
    assert len(README.read_text("utf-8").splitlines()) < 150
    for page in PAGES:
        for link in re.findall(r"\]\(([^)#\s]+)", page.read_text("utf-8")):
            assert link.startswith("https://") or (page.parent / link).exists(), (page.name, link)


def test_every_command_line_is_one_that_rapi_takes():
    seen = 0
    for page in PAGES:
        for text in blocks(page, "bash"):
            for words in commands(text):
                app.parse_args(words, exit_on_error=False, print_error=False)
                seen += 1
    assert seen > 40


def test_every_table_is_toml_and_every_import_works():
    for page in PAGES:
        for text in blocks(page, "toml"):
            assert tomllib.loads(text)
        for text in blocks(page, "python"):
            tree = ast.parse(text)
            tree.body = [
                node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)
            ]
            exec(compile(tree, page.name, "exec"), {})


def test_own_data_to_a_straight_scan(scope, capsys):
    for words in commands(marked("own data", "bash")):
        assert run(app, words) == 0, capsys.readouterr()
    assert Path("result/model.json").is_file() and Path("my-recording/preview.png").is_file()
    assert {path.name for path in Path("drives").glob("*.csv")} == {
        "drive_10Hz.csv", "drive_20Hz.csv", "drive_40Hz.csv",
    }  # fmt: skip


def test_own_data_to_a_straight_scan_in_python(scope):
    imported(scope)
    text = marked("own data in Python", "python")
    names = executed(text, README, {})
    assert names["result"].verdict.trusted
    assert Path("drive.csv").is_file()
    run = names["another"].runs[0]
    off = names["predicted"] - run.response
    assert np.std(off) < 1e-2 * run.span
    assert sum(1 for line in text.splitlines() if line and " import " not in line) == 8


def test_own_data_page(scope):
    (text,) = blocks(ROOT / ".github/guide/own-data.md", "python")
    names = executed(text, README, {})
    assert names["imported"].notes
    assert Path("my-recording/manifest.toml").is_file()


@pytest.mark.slow
def test_diagnosis_of_the_readme_and_its_page(scope, capsys):
    imported(scope)
    capsys.readouterr()
    assert run(app, ["fit", "my-recording", "-o", "result", "--no-plots"]) == 0
    shown = capsys.readouterr().out
    assert len(shown.splitlines()) < 40 and "Starts" not in shown
    assert "and the notes in full are in model.json." in shown
    assert "`rapi compensate result --span SPAN --frequency HZ -o drives`" in shown
    for words in commands(marked("diagnosis", "bash")):
        assert run(app, words) == 0, capsys.readouterr()
    assert Path("diagnosis/report.html").is_file()
    page = ROOT / ".github/guide/diagnose.md"
    for text in blocks(page, "python"):
        names = executed(text, page, {})
    assert names["report"].verdict.name == "none"


@pytest.mark.slow
def test_fit_page(scope):
    imported(scope)
    page = ROOT / ".github/guide/fit.md"
    drive = read_recording("my-recording").runs[0].drive
    names = {"paths": ["my-recording"], "drive": drive}
    for text in blocks(page, "python"):
        text = text.replace("nonlinearity_band(result, made)", "None")  # of another page
        names = executed(text, page, names)
    assert names["results"][0].verdict.trusted and names["zeta"].low < names["zeta"].high


@pytest.mark.slow
def test_compensate_page():
    page = ROOT / ".github/guide/compensate.md"
    names: dict = {}
    for text in blocks(page, "python"):
        names = executed(text, page, names)
    up, down = names["linearity"](names["bench"].measure(names["made"].drive).runs[0]).rms_ghz
    assert max(up, down) < 1e-3
    assert np.ptp(names["drive"]) > 0
