"""Every notebook runs from top to bottom, in any folder, without a warning of ours."""

import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))
SHORT = "01_identify"  # runs in the short tier

# Runs before the notebook's own cells. Warnings of other packages, such as those of the kernel, are
# not ours to fix.
SETUP = f"""
import sys, warnings
assert sys.executable == {sys.executable!r}, sys.executable
warnings.filterwarnings("error", module=r"(__main__|rapi_jax|fitting|hardware)(\\.|$)")
"""


def text_of(cell: nbformat.NotebookNode) -> str:
    """What a cell printed."""
    return "".join(out.text for out in cell.outputs if out.output_type == "stream")


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An empty folder, with the kernel of this interpreter and nobody's settings."""
    monkeypatch.setenv("JUPYTER_PREFER_ENV_PATH", "1")
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", str(tmp_path / "jupyter"))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    (tmp_path / "work").mkdir()
    return tmp_path / "work"


def test_there_are_notebooks():
    assert NOTEBOOKS


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=() if path.stem == SHORT else pytest.mark.notebook)
        for path in NOTEBOOKS
    ],
)
def test_notebook_runs(path, folder):
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(SETUP))
    NotebookClient(
        notebook,
        timeout=600,
        kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
    ).execute()  # raises `CellExecutionError` where a cell does
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not [out for cell in code for out in cell.outputs if out.output_type == "error"]
    assert not [out for cell in code for out in cell.outputs if out.get("name") == "stderr"]
    assert list(folder.iterdir()) == []  # nothing is left where it ran
    verdicts = [cell for cell in code if "verdict" in cell.metadata.get("tags", ())]
    assert verdicts
    for cell in verdicts:
        assert text_of(cell).startswith("trusted\n")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_stored_executed_and_small(path):
    assert path.stat().st_size < 1_000_000
    notebook = nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    outputs = [out for cell in code for out in cell.outputs]
    assert any("image/png" in out.get("data", {}) for out in outputs)
