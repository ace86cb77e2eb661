"""What was computed of late is found by the identity of what it was computed from."""

import numpy as np

from fitting.diagnosis.refit._recent import Recent


def test_the_last_few_are_kept_and_the_one_unused_longest_goes_first():
    made = []

    def make(name):
        made.append(name)
        return name

    a, b, c = object(), object(), object()
    recent = Recent(2)
    for key, name in ((a, "a"), (b, "b"), (a, "a"), (c, "c"), (a, "a"), (b, "b")):
        assert recent.get((key,), lambda name=name: make(name)) == name
    assert made == ["a", "b", "c", "b"]


def test_equal_objects_are_not_the_same_and_a_longer_key_is_another():
    recent, one, other = Recent(4), [1], [1]
    assert recent.get((one,), lambda: 1) == 1
    assert recent.get((other,), lambda: 2) == 2
    assert recent.get((one, other), lambda: 3) == 3
    assert recent.get((one,), lambda: 4) == 1


def test_numbers_changed_in_place_are_others():
    recent, numbers = Recent(4), np.zeros(2)
    assert recent.get((numbers.tobytes(),), lambda: 1) == 1
    assert recent.get((numbers.tobytes(),), lambda: 2) == 1  # other bytes, the same content
    numbers[0] = 1.0
    assert recent.get((numbers.tobytes(),), lambda: 3) == 3
