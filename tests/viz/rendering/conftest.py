"""A server without a page."""

from collections.abc import Iterator

import pytest
import viser


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = viser.ViserServer(port=0, verbose=False)
    yield server
    server.stop()
