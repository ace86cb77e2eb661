"""Layers without circles, and folders that can be read at a glance."""

import collections
import re
import tomllib
from pathlib import Path

import grimp
import pytest

from rapi_jax.internal import install_extra

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("rapi_jax", "fitting", "hardware")
FILES = 14  # in a folder
# A table with a row a file: `rapi_jax.effects` holds one file an effect, and their thresholds.
TABLES = ("rapi_jax/effects",)


def components(graph: grimp.ImportGraph) -> list[list[str]]:
    """Strongly connected components of more than one module, by Tarjan's algorithm."""
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(module: str) -> None:
        number[module] = low[module] = len(number)
        stack.append(module)
        for other in sorted(graph.find_modules_directly_imported_by(module)):
            if other not in number:
                visit(other)
            if other in stack:
                low[module] = min(low[module], low[other])
        if low[module] == number[module]:
            at = stack.index(module)
            if len(stack) - at > 1:
                found.append(sorted(stack[at:]))
            del stack[at:]

    for module in sorted(graph.modules):
        if module not in number:
            visit(module)
    return found


def test_no_module_imports_itself_by_way_of_others():
    # Imports for annotations alone, under `if TYPE_CHECKING`, are left out: none is made at run
    # time. Imports within functions count.
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True, cache_dir=None)
    assert components(graph) == []


def test_a_circle_would_be_found():
    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("c", "b"), ("c", "d"), ("d", "a")):
        graph.add_import(importer=importer, imported=imported)
    graph.add_import(importer="e", imported="a")
    assert components(graph) == [["a", "b", "c", "d"]]
    graph.remove_import(importer="d", imported="a")
    assert components(graph) == [["b", "c"]]


@pytest.mark.parametrize("package", PACKAGES)
def test_folders_are_small(package):
    counts = collections.Counter(
        path.parent.relative_to(ROOT).as_posix() for path in (ROOT / package).rglob("*.py")
    )
    assert {name: n for name, n in counts.items() if n > FILES and name not in TABLES} == {}


def test_extras_that_errors_name_exist():
    """`install_extra("x")` says how to install the extra `x`."""
    named = {
        name
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        for name in re.findall(r'install_extra\("(\w+)"\)', path.read_text())
    }
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {"lab", "batch"} <= named <= project["optional-dependencies"].keys()
    assert "'rapi-jax[lab]'" in install_extra("lab") and "--extra lab" in install_extra("lab")
