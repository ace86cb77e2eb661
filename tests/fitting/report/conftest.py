"""One browser for all pages, where this machine has one."""

from collections.abc import Iterator

import chromium
import pytest


@pytest.fixture(scope="session")
def browser(tmp_path_factory) -> Iterator[chromium.Chromium]:
    binary = chromium.find()
    if binary is None:
        pytest.skip(f"no Chromium on this machine under the names {', '.join(chromium.NAMES)}")
    started = chromium.Chromium(binary, tmp_path_factory.mktemp("profile"))
    yield started
    started.close()
