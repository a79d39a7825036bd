"""Blender lives, and one line tells why: cancels, crashes, lost files, odd scenes (needs bpy)."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.blender.finals import final

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")
engine: Any = pytest.importorskip("blender.engine")
process: Any = pytest.importorskip("blender.process")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered", "first_scene")]
SIZE = 32, 24


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The lines that the engine tells Blender."""
    lines: list[str] = []
    tell = engine.ClptEngine.tell

    def note(self: Any, line: str, kind: str = "WARNING") -> None:
        lines.append(line)
        tell(self, line, kind)

    monkeypatch.setattr(engine.ClptEngine, "tell", note)
    return lines


def picture(folder: Path, samples: int = 8) -> np.ndarray:
    """Return the picture (h, w, 3) of Blender's scene."""
    return final(folder, SIZE, samples)


def paint_of_an_image(image: Any) -> None:
    """Let the cube's color be an image."""
    tree = bpy.data.materials["Material"].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    color = tree.nodes["Principled BSDF"].inputs["Base Color"]
    tree.links.new(texture.outputs["Color"], color)


def red_file(folder: Path) -> Path:
    image = bpy.data.images.new("red", 4, 4)
    image.pixels = [1.0, 0.0, 0.0, 1.0] * 16
    image.filepath_raw, image.file_format = str(folder / "red.png"), "PNG"
    image.save()
    bpy.data.images.remove(image)
    return folder / "red.png"


def is_red(shown: np.ndarray) -> bool:
    middle = shown[10:14, 14:18].mean(axis=(0, 1))
    return bool(middle[0] > 3.0 * middle[2])


def test_images_are_packed_renamed_moved_and_lost(tmp_path: Path, told: list[str]) -> None:
    file = red_file(tmp_path)
    image = bpy.data.images.load(str(file))
    paint_of_an_image(image)
    assert is_red(picture(tmp_path))
    image.name = "another name, with / and é"
    assert is_red(picture(tmp_path))
    image.pack()
    file.unlink()
    assert is_red(picture(tmp_path))
    image.unpack(method="REMOVE")
    image.reload()
    lost = picture(tmp_path)
    assert not is_red(lost) and lost.mean() > 0.01
    assert any("missing" in line for line in told)
    file.write_text("no image")
    with pytest.raises(RuntimeError, match=r"red\.png"):
        picture(tmp_path)
    bpy.data.images.remove(image)
    assert picture(tmp_path).mean() > 0.01


def test_linked_libraries_and_overrides(tmp_path: Path) -> None:
    """An object of another file, of the same name as one that is here; then its file is gone."""
    bpy.data.objects["Cube"].data.materials[0].diffuse_color = (1.0, 0.0, 0.0, 1.0)
    first = picture(tmp_path, 32)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"), copy=True)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Cube"]
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(0.0, 0.0, -50.0))
    bpy.context.object.name = "Cube"
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    assert np.allclose(picture(tmp_path, 32), first, atol=1e-4)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "user.blend"))
    (tmp_path / "library.blend").unlink()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "user.blend"))
    assert np.isfinite(picture(tmp_path)).all()


def nothing() -> None:
    for each in list(bpy.data.objects):
        if each.type != "CAMERA":
            bpy.data.objects.remove(each)


def no_world() -> None:
    bpy.context.scene.world = None


def empty_mesh() -> None:
    bpy.data.objects["Cube"].data.clear_geometry()


def no_material() -> None:
    bpy.data.objects["Cube"].data.materials.clear()
    bpy.data.materials.remove(bpy.data.materials["Material"])


def flat() -> None:
    bpy.data.objects["Cube"].scale = (0.0, 1.0, 1.0)


def mirrored() -> None:
    bpy.data.objects["Cube"].scale = (-1.0, 1.0, 1.0)


def not_a_number() -> None:
    bpy.data.objects["Cube"].data.vertices[0].co.x = float("nan")


def far_away() -> None:
    bpy.data.objects["Cube"].location.x = 1e20


def edited() -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    bpy.ops.object.mode_set(mode="EDIT")


def names() -> None:
    for number, each in enumerate(("\N{SNOWMAN}", 'a"b', "c/../d", " ", "x" * 60)):
        copy = bpy.data.objects["Cube"].copy()
        copy.data = copy.data.copy()
        copy.name, copy.location.x = each, 3.0 * number
        copy.data.materials[0] = copy.data.materials[0].copy()
        copy.data.materials[0].name = each
        bpy.context.scene.collection.objects.link(copy)


def curve_without_surface() -> None:
    curve = bpy.data.curves.new("line", "CURVE")
    curve.splines.new("POLY")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("line", curve))


SCENES: tuple[Callable[[], None], ...] = (
    nothing, no_world, empty_mesh, no_material, flat, mirrored, not_a_number, far_away, edited,
    names, curve_without_surface,
)  # fmt: skip


@pytest.mark.parametrize("change", SCENES)
def test_odd_scenes_are_pictures_or_a_line(
    change: Callable[[], None], tmp_path: Path, told: list[str]
) -> None:
    """What can be drawn is drawn; else one line of Blender's tells what is wrong."""
    change()
    try:
        assert np.isfinite(picture(tmp_path)).all()
    except RuntimeError as error:
        assert "clpt: " in str(error) and len(str(error).strip().splitlines()) == 1, error
        assert "Traceback" not in str(error)
    bpy.ops.wm.read_factory_settings()
    assert picture(tmp_path).mean() > 0.01


def test_hundred_cancels_at_random_moments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each ends soon, the process goes on with the next one, and the picture after is whole."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    whole = picture(tmp_path)
    random = np.random.default_rng(7)
    end = [0.0]
    monkeypatch.setattr(engine.ClptEngine, "is_cancelled", lambda _: time.monotonic() > end[0])
    bpy.context.scene.render.filepath = str(tmp_path / "cancelled.exr")
    bpy.context.scene.clpt.samples = 1 << 20
    slowest = 0.0
    for _ in range(100):
        end[0] = time.monotonic() + random.exponential(0.1)
        bpy.ops.render.render()
        slowest = max(slowest, time.monotonic() - end[0])
    assert slowest < 30.0
    end[0] = float("inf")
    assert np.array_equal(picture(tmp_path), whole)
    assert not list(tmp_path.glob("clpt_*"))


def test_a_process_that_is_killed_at_random_moments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: list[str]
) -> None:
    whole, random = picture(tmp_path), np.random.default_rng(8)
    receive = process.Process.receive
    for _ in range(10):
        end = time.monotonic() + random.exponential(0.2)

        def dying(self: Any, wait: float, end: float = end) -> Any:
            if time.monotonic() > end:
                self.child.kill()
            return receive(self, wait)

        monkeypatch.setattr(process.Process, "receive", dying)
        bpy.context.scene.clpt.samples = 1 << 20
        with pytest.raises(RuntimeError, match="clpt has ended"):
            bpy.ops.render.render()
        monkeypatch.setattr(process.Process, "receive", receive)
        assert np.array_equal(picture(tmp_path), whole)
