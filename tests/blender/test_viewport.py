"""The viewport, by a stand-in for its window: Blender's own depsgraph drives it (needs bpy)."""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.blender.finals import final

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")
engine: Any = pytest.importorskip("blender.engine")
viewports: Any = pytest.importorskip("blender.viewport")
mathutils: Any = pytest.importorskip("mathutils")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered")]
SIZE = 64, 48


def view_3d() -> tuple[dict[str, Any], Any]:
    """Return a 3D view of Blender's first screen: what operators need to know, and its space."""
    screen = bpy.data.screens["Layout"]
    area = next(area for area in screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    window = bpy.context.window_manager.windows[0]
    space = area.spaces.active
    return {"window": window, "screen": screen, "area": area, "region": region}, space


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
            scene=bpy.context.scene, region_data=self.region_data, space_data=view_3d()[1],
            region=SimpleNamespace(width=self.width, height=self.height),
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
        depsgraph = bpy.context.evaluated_depsgraph_get()
        engine.ClptEngine.view_draw(self.engine, self.context, depsgraph)

    def until(self, ready: Callable[[], bool], limit: float = 600.0) -> float:
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
    assert not [
        line for line in window.lines if line and not line.startswith(("sample", "prepares"))
    ]


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_through_the_camera_it_is_the_final_picture(
    window: Window, kind: str, tmp_path: Path
) -> None:
    """The matrices of a region that shows just the camera's frame, with shifts."""
    camera = bpy.context.scene.camera
    camera.data.type, camera.data.shift_x, camera.data.shift_y = kind, 0.1, -0.05
    bpy.context.scene.clpt.viewport_samples = 256
    wanted = final(tmp_path, SIZE, 256)[::-1]
    view = window.region_data
    view.view_perspective, view.is_perspective = "CAMERA", kind == "PERSP"
    view.view_matrix = camera.matrix_world.inverted()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view.window_matrix = camera.calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
    window.open()
    shown = window.picture(256)[..., :3]
    assert shown.mean() == pytest.approx(wanted.mean(), rel=5e-3)
    assert np.median(np.abs(shown - wanted)) < 0.02 * wanted.mean()


@pytest.mark.parametrize("through", [False, True])
def test_a_border_is_rendered_alone(window: Window, through: bool) -> None:
    """Of a view, and of a camera's frame that is half as wide as the region."""
    scene, space = bpy.context.scene, view_3d()[1]
    holder, name = (scene.render, "border") if through else (space, "render_border")
    view = window.region_data
    if through:
        scene.render.resolution_x, scene.render.resolution_y = SIZE
        view.view_perspective, view.view_matrix = "CAMERA", scene.camera.matrix_world.inverted()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        view.window_matrix = scene.camera.calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
        for row in (0, 1):
            view.window_matrix[row][row] *= 0.5
    window.open()
    whole = window.picture(64)
    setattr(holder, "use_border" if through else "use_render_border", True)
    for end, value in (("min_x", 0.25), ("max_x", 0.75), ("min_y", 0.5), ("max_y", 1.0)):
        setattr(holder, f"{name}_{end}", value)
    part = window.picture(64)
    setattr(holder, "use_border" if through else "use_render_border", False)
    corner = (24, 24) if through else (24, 16)  # row from below, column
    assert part.shape == ((12, 16, 4) if through else (24, 32, 4))
    wanted = whole[corner[0] : corner[0] + part.shape[0], corner[1] : corner[1] + part.shape[1]]
    assert part.mean() == pytest.approx(wanted.mean(), rel=0.02)
    place = window.viewport.corner[::-1] * np.array([SIZE[1], SIZE[0]])
    assert np.allclose(place, corner)
    assert np.allclose(window.viewport.extent, np.divide(part.shape[1::-1], SIZE))


def test_denoised_pictures_are_nearer_to_the_truth(window: Window) -> None:
    """A lamp with a size over a floor: noise of 8 samples, less than .7 of it after."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    bpy.data.lights["Light"].shadow_soft_size = 2.0
    scene.clpt.viewport_samples = 512
    window.open()
    truth = window.picture(512)
    scene.clpt.viewport_samples = 8
    window.open()
    noisy = window.picture(8)
    scene.clpt.viewport_denoise = True
    window.open()
    clean = window.picture(8)
    assert clean.mean() == pytest.approx(truth.mean(), rel=0.03)
    errors = [np.median(np.abs(shown - truth)[..., :3]) for shown in (clean, noisy)]
    assert errors[0] < 0.7 * errors[1]


def test_bounces_are_counted(window: Window) -> None:
    """Over a floor direct light alone is darker; with the former number all is as before."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    window.open()
    many = window.picture(64)
    scene.clpt.bounces = 0
    window.open()
    assert window.picture(64)[..., :3].mean() < 0.98 * many[..., :3].mean()
    scene.clpt.bounces = 12
    window.open()
    assert np.allclose(window.picture(64), many, atol=1e-5)


def test_a_real_lens_is_seen_through_the_camera(window: Window, tmp_path: Path) -> None:
    """Its picture is the final one, where the region shows just the camera's frame."""
    camera = bpy.context.scene.camera
    camera.data.clpt.lens = "double_gauss"
    wanted = final(tmp_path, SIZE, 64)[::-1]
    view = window.region_data
    view.view_perspective, view.view_matrix = "CAMERA", camera.matrix_world.inverted()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view.window_matrix = camera.calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
    window.open()
    shown = window.picture(64)[..., :3]
    assert shown.mean() == pytest.approx(wanted.mean(), rel=0.01)
    assert np.median(np.abs(shown - wanted)) < 0.05 * wanted.mean()


def test_the_film_is_that_of_the_scene(window: Window) -> None:
    """Alpha, another size, and another mode are other films, while the view stays."""
    window.open()
    first = window.picture(64)
    scene = bpy.context.scene
    scene.render.film_transparent = True
    window.open()
    clear = window.picture(64)
    assert clear[2, 2, 3] == 0.0 and clear[24, 32, 3] == 1.0
    scene.render.film_transparent = False
    scene.clpt.white_balance = "A"
    window.open()
    balanced = window.picture(64)[..., :3].mean(axis=(0, 1)) / first[..., :3].mean(axis=(0, 1))
    assert balanced[2] > 1.3 * balanced[0]
    scene.clpt.white_balance, scene.clpt.mode = "none", "spectral"
    window.width, window.height = 32, 24
    window.open()
    small = window.picture(64)
    assert small.shape == (24, 32, 4)
    assert small[..., :3].mean() == pytest.approx(first[..., :3].mean(), rel=0.05)


def test_places_and_colors_are_no_loads(window: Window) -> None:
    """Files of geometry are written once, and again only for what changes."""
    written = []
    write = viewports.scenes.meshes.write

    def counted(mesh: Any, *where: Any) -> Any:
        written.append(mesh.name)
        return write(mesh, *where)

    viewports.scenes.meshes.write = counted
    try:
        window.open()
        bpy.ops.mesh.primitive_monkey_add(location=(2.0, 0.0, 0.0))
        monkey = bpy.context.object
        window.picture()
        assert sorted(written) == ["Cube", "Suzanne"]
        for step in range(5):
            monkey.location.x += 0.1
            bpy.data.objects["Light"].location.z -= 0.1
            bpy.data.materials["Material"].diffuse_color[0] = 0.1 * step
            bpy.context.scene.camera.location.x += 0.1
            window.picture()
        assert len(written) == 2
        monkey.data.vertices[0].co.x += 0.1
        monkey.data.update()
        window.picture()
        assert written[2:] == ["Suzanne"]
        assert len(list(window.viewport.folder.glob("mesh*"))) == 2
    finally:
        viewports.scenes.meshes.write = write


def test_a_local_view_shows_its_objects_alone(window: Window) -> None:
    window.open()
    first = window.picture(64)
    where, space = view_3d()
    with bpy.context.temp_override(**where):
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["Light"].select_set(True)
        bpy.ops.view3d.localview(frame_selected=False)
        window.open()
        assert window.picture(64)[20:28, 28:36, :3].std() < 1e-3
        bpy.ops.view3d.localview(frame_selected=False)
        assert space.local_view is None
        window.open()
        assert np.allclose(window.picture(64), first, atol=1e-5)


def test_undo_brings_back_what_was(window: Window) -> None:
    bpy.context.preferences.edit.use_global_undo = True
    window.open()
    first = window.picture(64)
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.ed.undo_push(message="after")
    without = window.picture(64)
    assert np.abs(without - first).mean() > 0.01
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    if "Cube" not in bpy.data.objects:
        pytest.skip("this Blender does not undo without a window")
    engine.ClptEngine.view_update(
        window.engine, window.context, bpy.context.evaluated_depsgraph_get()
    )
    assert np.allclose(window.picture(64), first, atol=1e-5)


def test_a_killed_process_is_a_line_and_the_next_change_starts_another(window: Window) -> None:
    window.open()
    first = window.picture(64)
    window.viewport.process.child.kill()
    window.until(lambda: window.viewport.process is None)
    assert any("clpt has ended" in line for line in window.lines)
    window.look((7.0, -7.0, 5.1), (0.0, 0.0, 0.0))
    window.draw()
    bpy.data.objects["Light"].location.x += 0.0
    bpy.context.view_layer.update()
    window.look((7.0, -7.0, 5.0), (0.0, 0.0, 0.0))
    assert np.allclose(window.picture(64), first, atol=1e-5)


def test_a_fault_of_the_writer_is_a_line(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    window.open()
    first = window.picture(64)
    monkeypatch.setattr(viewports.LiveWriter, "describe", lambda _: 1 / 0)
    window.open()
    assert any("ZeroDivisionError" in line for line in window.lines)
    monkeypatch.undo()
    monkeypatch.setattr(viewports.Viewport, "_draw", lambda *_: None)
    bpy.data.objects["Cube"].location.x = 0.0
    window.open()
    assert np.allclose(window.picture(64), first, atol=1e-5)


def test_a_closed_viewport_ends_its_process(window: Window) -> None:
    window.open()
    window.picture()
    viewport, child = window.viewport, window.viewport.process.child

    class Freed:
        @property
        def is_preview(self) -> bool:
            raise ReferenceError("StructRNA of type CLPT has been removed")

    viewport.engine = Freed()
    assert viewport.listen() is None
    assert child.poll() is not None and not viewport.folder.exists()


def test_thousand_updates_keep_the_memory(window: Window) -> None:
    """Views, places, colors, lamps and geometry in turn: both processes grow by less than 30 MB."""
    window.open()
    window.picture(1)
    random = np.random.default_rng(5)
    cube, lamp = bpy.data.objects["Cube"], bpy.data.objects["Light"]
    paint = bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"]
    child = window.viewport.process.child.pid
    sizes = []
    for step in range(1000):
        a, b, c = random.uniform(-1.0, 1.0, 3)
        match step % 5:
            case 0:
                window.look((7.0 + a, -7.0 + b, 5.0 + c), (0.0, 0.0, 0.0))
            case 1:
                cube.location = a, b, c
            case 2:
                paint.inputs["Base Color"].default_value = (abs(a), abs(b), abs(c), 1.0)
            case 3:
                lamp.location.x = 4.0 + a
            case 4:
                cube.data.vertices[0].co.z = 1.0 + a
                cube.data.update()
        window.draw()
        if step % 5 == 0 or random.random() < 0.3:
            window.until(lambda: window.viewport.shown == window.viewport.serial)
        if step in (300, 999):
            sizes.append([resident(process) for process in (os.getpid(), child)])
    window.picture(64)
    grown = np.subtract(sizes[1], sizes[0])
    assert (grown < 30e6).all(), grown
    assert window.viewport.process.child.pid == child


def resident(process: int) -> int:
    """Return the memory of a process [bytes]."""
    statm = Path(f"/proc/{process}/statm")
    if not statm.exists():
        pytest.skip("no /proc")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
