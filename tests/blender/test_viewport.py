"""The viewport, by a stand-in for its window: Blender's own depsgraph drives it (needs bpy)."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")
engine: Any = pytest.importorskip("blender.engine")
viewports: Any = pytest.importorskip("blender.viewport")
mathutils: Any = pytest.importorskip("mathutils")

pytestmark = pytest.mark.slow
SIZE = 64, 48


class Window:
    """What Blender has for a viewport: the engine's object, the context, and when it calls what."""

    def __init__(self, size: tuple[int, int] = SIZE):
        self.lines: list[str] = []
        self.drawn = 0
        self.width, self.height = size
        self.region_data = SimpleNamespace(
            is_perspective=True, view_perspective="PERSP", view_matrix=mathutils.Matrix(),
            window_matrix=mathutils.Matrix(),
        )  # fmt: skip
        self.engine: Any = SimpleNamespace(
            viewport=None, is_preview=False, update_stats=self._stats, tag_redraw=lambda: None,
            report=lambda _, text: self.lines.append(text),
        )  # fmt: skip
        self.look((7.0, -7.0, 5.0), (0.0, 0.0, 0.0))
        bpy.app.handlers.depsgraph_update_post.append(self._updated)

    def _stats(self, _: str, text: str) -> None:
        self.lines.append(text)

    @property
    def context(self) -> Any:
        return SimpleNamespace(
            scene=bpy.context.scene, region_data=self.region_data,
            region=SimpleNamespace(width=self.width, height=self.height),
            space_data=SimpleNamespace(clip_start=0.1, clip_end=1000.0),
        )  # fmt: skip

    def _updated(self, _: Any, depsgraph: Any) -> None:
        engine.ClptEngine.view_update(self.engine, self.context, depsgraph)

    def look(self, origin: Any, target: Any, angle: float = 0.7) -> None:
        """Look from a place to another, with a field of view [rad]."""
        forward = mathutils.Vector(target) - mathutils.Vector(origin)
        turn = forward.to_track_quat("-Z", "Y").to_matrix().to_4x4()
        self.region_data.view_matrix = (mathutils.Matrix.Translation(origin) @ turn).inverted()
        scale = 1.0 / math.tan(0.5 * angle)
        self.region_data.window_matrix = mathutils.Matrix(
            ((scale, 0, 0, 0), (0, scale * self.width / self.height, 0, 0),
             (0, 0, -1.0002, -0.20002), (0, 0, -1, 0))
        )  # fmt: skip

    def open(self) -> None:
        """Show the viewport for the first time."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        engine.ClptEngine.view_update(self.engine, self.context, depsgraph)

    @property
    def viewport(self) -> Any:
        return self.engine.viewport

    def draw(self) -> None:
        bpy.context.view_layer.update()
        engine.ClptEngine.view_draw(self.engine, self.context, None)

    def until(self, ready: Callable[[], bool], limit: float = 60.0) -> float:
        """Draw until something is there; return the seconds."""
        began = time.perf_counter()
        while not ready():
            self.draw()
            assert time.perf_counter() - began < limit, self.lines
            time.sleep(0.002)
        return time.perf_counter() - began

    def picture(self, samples: int = 1) -> np.ndarray:
        """Return the picture (h, w, 4) of the present scene with so many samples."""
        self.draw()
        viewport = self.viewport
        self.until(lambda: viewport.shown == viewport.serial and viewport.samples >= samples)
        return np.array(viewport.picture)

    def close(self) -> None:
        bpy.app.handlers.depsgraph_update_post.remove(self._updated)
        if self.viewport is not None:
            self.viewport.close()


@pytest.fixture(autouse=True, scope="module")
def registered() -> Any:
    blender.register()
    yield
    blender.unregister()


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[Window]:
    """A viewport of Blender's first scene; what it draws is kept from the graphics card."""
    monkeypatch.setenv("CLPT_PYTHON", sys.executable)
    monkeypatch.setattr(viewports.Viewport, "_draw", lambda *_: None)
    bpy.ops.wm.read_factory_settings()
    bpy.context.scene.clpt.mode = "rgb"
    bpy.context.scene.clpt.viewport_samples = 64
    there = Window()
    yield there
    there.close()


def test_it_shows_the_scene_and_follows_changes(window: Window) -> None:
    """Views, lamps, materials, places, geometry, new and deleted objects."""
    window.open()
    first = window.picture(64)
    assert first.shape == (SIZE[1], SIZE[0], 4) and first[..., :3].mean() > 0.01
    window.look((-7.0, 7.0, 5.0), (0.0, 0.0, 0.0))
    other = window.picture(64)
    assert np.abs(other - first).mean() > 0.005
    window.look((7.0, -7.0, 5.0), (0.0, 0.0, 0.0))
    assert np.allclose(window.picture(64), first, atol=1e-5)
    bpy.data.lights["Light"].energy *= 2.0
    bright = window.picture(64)
    assert bright[..., :3].mean() > 1.2 * first[..., :3].mean()
    bpy.data.lights["Light"].energy *= 0.5
    paint = bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"]
    paint.inputs["Base Color"].default_value = (0.0, 0.0, 0.8, 1.0)
    blue = window.picture(64)[20:28, 28:36].mean(axis=(0, 1))
    assert blue[2] > 2.0 * blue[0]
    cube = bpy.data.objects["Cube"]
    cube.location.z = 100.0
    gone = window.picture(64)
    assert gone[20:28, 28:36, :3].std() < 1e-3
    cube.location.z = 0.0
    cube.modifiers.new("bend", "SUBSURF").levels = 2
    ball = window.picture(64)
    assert np.abs(ball - first).mean() > 0.001
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 2.0))
    added = window.picture(64)
    assert np.abs(added - ball).mean() > 0.001
    bpy.data.objects.remove(bpy.context.object)
    assert np.allclose(window.picture(64), ball, atol=1e-5)
    for each in list(bpy.data.objects):
        bpy.data.objects.remove(each)
    assert window.picture(64)[..., :3].std() < 1e-3
    assert not [line for line in window.lines if line and not line.startswith("sample")]
