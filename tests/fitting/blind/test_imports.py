"""The simulator of the withheld-effect check shares no code with what it examines."""

import ast
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
HOME = ROOT / "fitting" / "blind" / "simulator"
ALLOWED = {"numpy", "scipy"} | set(sys.stdlib_module_names)
OWN = "fitting.blind.simulator"


def imported(path: Path) -> set[str]:
    """Modules that a file names in its imports; relative ones stay in its own folder."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            folder = path.parent.relative_to(ROOT).parts[: 1 - node.level or None]
            parts = [*folder, node.module] if node.level else [node.module]
            names.add(".".join(str(part) for part in parts if part))
    return names


def foreign(name: str) -> bool:
    return name.split(".")[0] not in ALLOWED and name != OWN and not name.startswith(OWN + ".")


def test_only_the_standard_library_and_numpy_and_scipy():
    files = sorted(HOME.rglob("*.py"))
    assert len(files) > 20
    found = {path.name: [name for name in imported(path) if foreign(name)] for path in files}
    assert {name: names for name, names in found.items() if names} == {}
    assert not any("import_module" in path.read_text() for path in files)


def test_a_foreign_import_would_be_found():
    path = HOME / "effects" / "_kinds.py"
    assert any(name.startswith(OWN + ".effects") for name in imported(path))
    assert foreign("rapi_jax.recording._recording") and foreign("fitting.blind.protocol._folder")
    assert foreign("fitting.blind.simulator_of_ours") and not foreign(OWN + "._scan")


def test_a_world_is_drawn_without_loading_the_model():
    code = (
        "import sys; from fitting.blind.simulator._simulated_device import draw_device;"
        "draw_device(1, 'null');"
        "print([m for m in sys.modules if m.split('.')[0] in ('jax', 'rapi_jax', 'equinox')"
        " or m.startswith('fitting.') and not m.startswith('fitting.blind')])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (done.stdout.strip(), done.returncode) == ("[]", 0), done.stderr
