"""Faults as lines: said once where runs differ by name and numbers alone."""

from fitting.identification.data_checks._fault import Fault
from fitting.report._alike import fold_faults


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
