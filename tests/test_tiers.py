"""The lists of tests that shorter tiers leave to the others."""

import ast
from pathlib import Path

import pytest
from tiers import mark_listed

TESTS = Path(__file__).parent
SLOW, RELEASE = (
    (TESTS / f"{name}.txt").read_text(encoding="utf-8").splitlines() for name in ("slow", "release")
)
LISTED = sorted({*SLOW, *RELEASE})


@pytest.mark.parametrize("file", sorted({one.split("::")[0] for one in LISTED}))
def test_all_that_is_listed_exists(file):
    tree = ast.parse((TESTS.parent / file).read_text(encoding="utf-8"))
    there = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert {one.split("::")[1] for one in LISTED if one.startswith(f"{file}::")} <= there


def test_what_is_listed_is_marked(request):
    items = {item.nodeid.split("[")[0]: item for item in request.session.items}
    assert all(items[one].get_closest_marker("slow") for one in SLOW if one in items)
    own = items["tests/test_tiers.py::test_what_is_listed_is_marked"]
    assert own.get_closest_marker("slow") is None


class Item:
    """As much of a collected test as its tier is told by."""

    def __init__(self, name, *marks):
        self.originalname, self.path, self.marks = name, TESTS / "test_a.py", list(marks)

    def get_closest_marker(self, name):
        return name if name in self.marks else None

    def add_marker(self, mark):
        self.marks.append(mark.name)


def test_the_longest_are_left_to_a_release():
    items = [
        Item("test_long"),
        Item("test_cases"),
        Item("test_cases", "process"),
        Item("test_by_hand", "calibration"),
        Item("test_other"),
    ]
    release = {f"test_a.py::test_{name}" for name in ("long", "cases", "by_hand")}
    mark_listed(items, {"test_a.py::test_long", "test_a.py::test_by_hand"}, release, TESTS)
    assert [item.marks for item in items] == [
        ["slow", "release"],
        [],
        ["process", "release"],
        ["calibration"],
        [],
    ]


@pytest.mark.parametrize("listed", [SLOW, RELEASE], ids=["slow", "release"])
def test_a_list_is_sorted_and_says_nothing_twice(listed):
    assert sorted(set(listed)) == listed
