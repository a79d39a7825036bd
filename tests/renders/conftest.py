"""Renderers of these tests share a context, and so the programs that are built there."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import pyopencl as cl
import pytest

from clpt import device


@cache
def _first() -> device.Device:
    return device.choose()


@pytest.fixture(scope="module", autouse=True)
def one_context() -> Iterator[None]:
    """A renderer that is given no device gets a queue of its own in one context."""
    first, opened = _first(), device.choose

    def choose(which: str | int | None = None, *, profiling: bool = False) -> device.Device:
        if which is not None or profiling:
            return opened(which, profiling=profiling)
        queue = cl.CommandQueue(first.context, first.info.cl_device)
        return device.Device(first.context, queue, first.info)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device, "choose", choose)
        yield
