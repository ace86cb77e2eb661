"""Faults and notes as lines: said once where runs differ by name and numbers alone."""

from fitting.identification.data_checks._fault import Fault
from fitting.report._alike import fold_faults, fold_notes, fold_reasons


def test_what_is_said_of_several_runs_is_said_once():
    faults = [
        Fault("unsettled start", "a", "run 'a' ends 1.2e-3 um from its start. Cut it", ((0, 9),)),
        Fault("clipped", "a", "run 'a' is clipped.", ((0, 9),)),
        Fault("unsettled start", "b", "run 'b' ends 31 um from its start. Cut it", ((0, 9),)),
        Fault("unsettled start", "c", "run 'c' ends -2 um from its start. Cut it", ((0, 9),)),
    ]
    assert fold_faults(faults) == [
        "unsettled start: run 'a' ends 1.2e-3 um from its start. Cut it. The same in b, c.",
        "clipped: run 'a' is clipped.",
    ]
    assert fold_faults([]) == []


def test_of_many_notes_in_the_same_words_two_are_shown():
    runs = [f"a.dat, table {k + 1}: run{k:02d}: 1 period at {0.1 * k:g} Hz" for k in range(10)]
    told = fold_notes(["a.dat: text", *runs, "time assumed"])
    counted = "and 8 more like these; the manifest has them all"
    assert told == ["a.dat: text", *runs[:2], counted, "time assumed"]
    assert fold_notes(runs[:4]) == runs[:4]


def test_reasons_are_said_once_and_the_decisive_one_first():
    jump = "jump: run '{}': the response jumps by {} um. Leave that part out."
    reasons = (
        "single sweep: nothing tests it.",
        *(jump.format(run, size) for run, size in (("a", 0.03), ("b", 0.031), ("c", 4e-2))),
        "nothing explained: the model leaves 80 % of the variance.",
        "does not generalise: last third: rmse 7 nm.",
        "not predicted: rate 20 Hz: rmse 7 nm.",
        "not predicted: rate 30 Hz: rmse 7 nm.",
    )
    folded = fold_reasons(reasons)
    assert folded[:3] == [reasons[4], reasons[0], f"{reasons[1]} The same in b, c."]
    assert folded[3:] == list(reasons[5:])  # other rates are other reasons
    assert fold_reasons(folded) == folded and fold_reasons(()) == []
