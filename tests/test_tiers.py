"""The list of tests that the short tier leaves to the others."""

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
LISTED = (TESTS / "slow.txt").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("file", sorted({one.split("::")[0] for one in LISTED}))
def test_all_that_is_listed_exists(file):
    tree = ast.parse((TESTS.parent / file).read_text(encoding="utf-8"))
    there = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert {one.split("::")[1] for one in LISTED if one.startswith(f"{file}::")} <= there


def test_what_is_listed_is_marked(request):
    items = {item.nodeid.split("[")[0]: item for item in request.session.items}
    assert all(items[one].get_closest_marker("slow") for one in LISTED if one in items)
    own = items["tests/test_tiers.py::test_what_is_listed_is_marked"]
    assert own.get_closest_marker("slow") is None


def test_the_list_is_sorted_and_says_nothing_twice():
    assert sorted(set(LISTED)) == LISTED
