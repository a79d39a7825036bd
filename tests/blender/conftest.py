"""The extension in Blender, and Blender's first scene."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture(scope="module")
def registered() -> Iterator[None]:
    """The extension is registered while a module's tests run."""
    blender: Any = importlib.import_module("blender")
    blender.register()
    yield
    blender.unregister()


@pytest.fixture
def first_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blender shows its first scene, and clpt is found in this Python."""
    monkeypatch.setenv("CLPT_PYTHON", sys.executable)
    bpy: Any = importlib.import_module("bpy")
    bpy.ops.wm.read_factory_settings()
