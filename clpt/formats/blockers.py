"""All that keeps a scene from being read, at once: readers go on behind each error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from clpt.errors import SceneError

T = TypeVar("T")
MOST = 200  # errors that are kept
_found: ContextVar[list[SceneError] | None] = ContextVar("blockers", default=None)


def attempt(make: Callable[[], T], grey: T) -> T:
    """Return make(). While errors are collected, return `grey` in place of a SceneError."""
    try:
        return make()
    except SceneError as error:
        if not note(error):
            raise
        return grey


def note(error: SceneError) -> bool:
    """Keep an error while errors are collected; else return False."""
    errors = _found.get()
    if errors is None or len(errors) >= MOST:
        return False
    errors.append(error)
    return True


@contextmanager
def collecting() -> Iterator[list[SceneError]]:
    """Collect the errors of what is read inside; the list grows as they are met."""
    errors: list[SceneError] = []
    token = _found.set(errors)
    try:
        yield errors
    finally:
        _found.reset(token)
