"""What a recording says its response was read from."""

from collections.abc import Mapping

RESPONSE_FROM = "response_from"  # a key of the provenance
FRINGES = "fringes"


def is_read_from_fringes(provenance: Mapping[str, str]) -> bool:
    """Whether the response is an optical frequency that was read from an interferometer's fringes.

    Such a reading is smooth from sample to sample, and no other column of its file can be it.
    """
    return provenance.get(RESPONSE_FROM) == FRINGES
