"""Errors reach other processes whole, and whoever catches Python's own catches them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator

import pytest

from clpt import errors

PLACE = {"file": "scene.json", "line": 7, "where": "shapes[2].material"}
MADE = {
    errors.ClptError: errors.ClptError("wrong"),
    errors.SceneError: errors.SceneError("is wrong", **PLACE),
    errors.UnknownKindError: errors.UnknownKindError("light", "lamp", ["area", "lamb"], **PLACE),
    errors.UnusedParameterError: errors.UnusedParameterError("sphere", "size", ["radius"], **PLACE),
    errors.DeviceError: errors.DeviceError("no device"),
    errors.MemoryBudgetError: errors.MemoryBudgetError("film", 2**30, 2**20, "make it smaller"),
    errors.KernelBuildError: errors.KernelBuildError("shade", "shade.cl", 3, "error: x", "kept.cl"),
    errors.ClusterError: errors.ClusterError("no device is left"),
}


def subclasses(cls: type) -> Iterator[type]:
    yield cls
    for sub in cls.__subclasses__():
        yield from subclasses(sub)


def test_all_are_in_the_table():
    assert {cls for cls in subclasses(errors.ClptError) if cls.__module__ == "clpt.errors"} == {
        *MADE
    }


@pytest.mark.parametrize("error", MADE.values(), ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("again", [lambda e: pickle.loads(pickle.dumps(e)), copy.copy])
def test_pickled_errors_keep_all_that_they_say(error, again):
    found = again(error)
    assert type(found) is type(error)
    assert str(found) == str(error)
    assert vars(found) == vars(error)


@pytest.mark.parametrize(
    ("cls", "base"),
    [
        (errors.SceneError, ValueError),
        (errors.UnknownKindError, ValueError),
        (errors.UnusedParameterError, ValueError),
        (errors.DeviceError, RuntimeError),
        (errors.MemoryBudgetError, MemoryError),
        (errors.KernelBuildError, RuntimeError),
    ],
)
def test_they_are_errors_of_python(cls, base):
    with pytest.raises(base):
        raise MADE[cls]
