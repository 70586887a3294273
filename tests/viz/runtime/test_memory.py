"""Unused memory is returned."""

import gc
import threading
import weakref
from collections.abc import Iterator

import pyarrow as pa
import pytest

from odeform_viz.runtime.memory import Tidier, share_memory


class _Cycle:
    """Refers to itself, as motions and their curves do."""

    def __init__(self, gone: threading.Event) -> None:
        self.itself = self
        weakref.finalize(self, gone.set)


@pytest.fixture
def tidier(monkeypatch: pytest.MonkeyPatch) -> Iterator[Tidier]:
    monkeypatch.setattr("odeform_viz.runtime.memory.DELAY", 0.01)
    gc.disable()
    yield Tidier()
    gc.enable()
    gc.unfreeze()


def test_garbage_is_collected_each_time_it_is_asked_to(tidier: Tidier) -> None:
    for _ in range(3):
        gone = threading.Event()
        _Cycle(gone)
        assert not gone.is_set()
        tidier()
        tidier()
        assert gone.wait(60.0)


def test_arrow_shares_the_memory_of_everything_else() -> None:
    before = pa.default_memory_pool()
    try:
        share_memory()
        assert pa.default_memory_pool().backend_name == "system"
    finally:
        pa.set_memory_pool(before)
