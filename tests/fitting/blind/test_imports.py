"""The generator of worlds shares no code with what it examines."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
HOME = ROOT / "fitting" / "blind"
ALLOWED = {"numpy", "scipy", "numba"} | set(sys.stdlib_module_names)


def followed(name: str, seen: dict[str, set[str]]) -> dict[str, set[str]]:
    """Modules of the generator reached from one, each with the packages that it imports."""
    if name in seen:
        return seen
    outside, inside = set(), set()
    for node in ast.walk(ast.parse((HOME / f"{name}.py").read_text())):
        if isinstance(node, ast.Import):
            outside |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            outside.add(str(node.module).split(".")[0])
        elif isinstance(node, ast.ImportFrom) and node.level == 1:
            inside |= {node.module} if node.module else {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            outside.add("." * node.level)
    seen[name] = outside
    for module in inside:
        followed(str(module), seen)
    return seen


def reached() -> dict[str, set[str]]:
    return followed("_bank", followed("_world", {}))


def test_only_the_standard_library_and_numpy_and_scipy():
    foreign = {name: found - ALLOWED for name, found in reached().items() if found - ALLOWED}
    assert foreign == {}
    assert not any("import_module" in (HOME / f"{name}.py").read_text() for name in reached())


def test_the_contract_names_every_module_of_the_generator():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (contract,) = [c for c in contracts["contracts"] if "never scored" in c["name"]]
    assert contract["source_modules"] == sorted(f"fitting.blind.{name}" for name in reached())


def test_a_world_is_drawn_without_loading_the_model():
    code = (
        "import sys; from fitting.blind._world import draw; draw(1, 'null');"
        "print([m for m in sys.modules if m.split('.')[0] in ('jax', 'rapi_jax', 'equinox')"
        " or m.startswith('fitting.') and not m.startswith('fitting.blind')])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (done.stdout.strip(), done.returncode) == ("[]", 0), done.stderr
