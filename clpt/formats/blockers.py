"""All that keeps a scene from being read, at once: readers go on behind each error."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

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


def collect(path: Path, **variables: Any) -> list[SceneError]:
    """Return the errors of a file, in the order in which they are met, each once.

    path: of a scene of any format; of Mitsuba's and PBRT's materials, textures, shapes, lights and
    parameters each have their own. variables: see clpt.load.
    """
    from clpt.formats import load

    errors: list[SceneError] = []
    token = _found.set(errors)
    try:
        load(path, **variables)
    except SceneError as error:
        errors.append(error)
    finally:
        _found.reset(token)
    return list({str(error): error for error in errors}.values())
