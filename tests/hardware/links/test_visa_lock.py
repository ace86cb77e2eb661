"""The VISA lock: taken where library and instrument have one, refused where another holds it."""

import pytest

from hardware import LinkError, VisaLink

pyvisa = pytest.importorskip("pyvisa", reason="pyvisa is not installed (extra `lab`)")


class Resource:
    """What pyvisa opens, with a lock that behaves as given."""

    def __init__(self, outcome):
        self._outcome = outcome
        self.asked_ms = None

    def lock_excl(self, timeout):
        self.asked_ms = timeout
        if self._outcome is not None:
            raise self._outcome


def locked(outcome):
    link = VisaLink.__new__(VisaLink)
    link._visa = Resource(outcome)
    link._lock(0.5)
    return link._visa.asked_ms


def visa_error(name):
    return pyvisa.VisaIOError(getattr(pyvisa.constants.StatusCode, name))


@pytest.mark.fault(name="a VISA lock that another holds", promise="refused")
@pytest.mark.parametrize("name", ["error_resource_locked", "error_timeout"])
def test_a_lock_that_another_holds_is_refused(name):
    with pytest.raises(LinkError, match="holds the VISA lock"):
        locked(visa_error(name))


@pytest.mark.parametrize(
    "outcome",
    [None, visa_error("error_nonsupported_operation"), NotImplementedError(), AttributeError()],
)
def test_a_library_without_locks_is_no_obstacle(outcome):
    assert locked(outcome) == 500
