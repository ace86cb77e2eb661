"""Verdicts that are no effect's name, and the verdict that is correct for a given truth."""

from collections.abc import Iterable

NONE, UNLISTED, FAILED = "none", "unlisted", "error"


def correct_verdict(truth: Iterable[str]) -> str:
    """The verdict that names the effects of an answer: `none`, `unlisted` or names joined by +."""
    names = sorted(truth)
    if any(name.startswith("unlisted:") for name in names):
        return UNLISTED
    return "+".join(names) or NONE
