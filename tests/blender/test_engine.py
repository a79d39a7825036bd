"""The render engine of Blender, beside Cycles in the same process (`pip install bpy`)."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt import images
from clpt.images import exr_files

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered")]
SIZE = 48, 36


@pytest.fixture(autouse=True)
def empty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLPT_PYTHON", sys.executable)
    bpy.ops.wm.read_factory_settings(use_empty=True)


def picture(engine: str, folder: Path, samples: int = 256, bounces: int = 0) -> np.ndarray:
    """Return the picture of Blender's scene (h, w, 3) by an engine, without tone curves."""
    scene = bpy.context.scene
    scene.render.engine = engine
    if engine == "CYCLES":
        scene.cycles.samples, scene.cycles.device = samples, "CPU"
        scene.cycles.use_denoising, scene.cycles.max_bounces = False, bounces
    else:
        scene.clpt.samples, scene.clpt.mode = samples, "rgb"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(folder / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    return np.asarray(images.read(scene.render.filepath))[..., :3]


def link(name: str, data: Any, place: tuple[float, ...], turn: tuple[float, ...]) -> Any:
    thing = bpy.data.objects.new(name, data)
    thing.location, thing.rotation_euler = place, turn
    bpy.context.scene.collection.objects.link(thing)
    return thing


def floor_and_camera() -> None:
    bpy.ops.mesh.primitive_plane_add(size=20)
    material = bpy.data.materials.new("floor")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs[0].default_value = (0.5, 0.4, 0.2, 1.0)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.cameras.new("camera")
    camera.shift_x, camera.shift_y = 0.1, 0.05
    bpy.context.scene.camera = link("camera", camera, (0.0, -6.0, 5.0), (0.88, 0.0, 0.0))


LAMPS = {
    "sun": ("SUN", {"energy": 3.0, "angle": 0.0}),
    "point": ("POINT", {"energy": 100.0, "shadow_soft_size": 0.0}),
    "warm": (
        "POINT",
        {"energy": 50.0, "shadow_soft_size": 0.0, "use_temperature": True, "temperature": 3000.0,
         "exposure": 1.0},
    ),
    "spot": (
        "SPOT", {"energy": 100.0, "shadow_soft_size": 0.0, "spot_size": 1.2, "spot_blend": 0.4}
    ),
    "square": ("AREA", {"energy": 100.0, "size": 1.5}),
    "rectangle": ("AREA", {"energy": 100.0, "shape": "RECTANGLE", "size": 1.5, "size_y": 0.7}),
    "disk": ("AREA", {"energy": 100.0, "shape": "DISK", "size": 1.5}),
}  # fmt: skip


@pytest.mark.parametrize("name", LAMPS)
def test_lamps_shine_as_in_cycles(name: str, tmp_path: Path) -> None:
    """Means within .2 %: both have noise of less than .1 %."""
    kind, settings = LAMPS[name]
    floor_and_camera()
    lamp = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(lamp, key, value)
    link(name, lamp, (0.5, 0.0, 3.0), (0.3, 0.2, 0.0))
    ours, cycles = (picture(engine, tmp_path) for engine in ("CLPT", "CYCLES"))
    assert ours.mean(axis=(0, 1)) == pytest.approx(cycles.mean(axis=(0, 1)), rel=2e-3)
    left, right = (half.mean() for half in np.split(ours, 2, axis=1))
    assert left / right == pytest.approx(
        np.divide(*(half.mean() for half in np.split(cycles, 2, axis=1))), rel=5e-3
    )


def test_the_first_scene_of_blender(tmp_path: Path) -> None:
    """Each quarter of the picture of the cube within 2 % of Cycles'."""
    bpy.ops.wm.read_factory_settings()
    ours, cycles = (picture(engine, tmp_path, 128, 4) for engine in ("CLPT", "CYCLES"))
    for rows in np.split(np.stack([ours, cycles]), 2, axis=1):
        for quarter in np.split(rows, 2, axis=2):
            mine, theirs = quarter.mean(axis=(1, 2, 3))
            assert mine == pytest.approx(theirs, rel=0.02)


def test_a_turned_dome(tmp_path: Path) -> None:
    """A bright spot in the surroundings lies where Cycles has it, turned by a Mapping node."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    image = bpy.data.images.new("sky", 128, 64, float_buffer=True)
    pixels = np.full((64, 128, 4), 0.1, np.float32)
    pixels[28:36, 80:88, :3] = (5.0, 2.0, 1.0)
    image.pixels = pixels.ravel()
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    mapping, where = nodes.new("ShaderNodeMapping"), nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.6)
    links.new(where.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    nodes["Background"].inputs["Strength"].default_value = 2.0
    camera = bpy.data.cameras.new("camera")
    camera.angle = 2.6
    bpy.context.scene.camera = link("camera", camera, (0.0, 0.0, 0.0), (1.5708, 0.0, -2.0))
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(0.0, 0.0, -50.0))
    ours, cycles = (picture(engine, tmp_path, 16) for engine in ("CLPT", "CYCLES"))
    bright = [np.argwhere(shown[..., 0] > 5.0).mean(axis=0) for shown in (ours, cycles)]
    assert np.allclose(bright[0], bright[1], atol=0.7)
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.02)


def test_a_fault_is_a_line_and_blender_lives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    floor_and_camera()
    monkeypatch.setenv("CLPT_PYTHON", "/bin/false")
    with pytest.raises(RuntimeError, match="clpt does not start"):
        picture("CLPT", tmp_path)
    monkeypatch.setenv("CLPT_PYTHON", sys.executable)
    assert picture("CLPT", tmp_path, 4).shape == (SIZE[1], SIZE[0], 3)


def test_measured_surfaces_and_standard_lamps(tmp_path: Path) -> None:
    """Gold is yellow, a sodium lamp orange, a prism's light has colors, and a sky is blue."""
    floor_and_camera()
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy = 200.0
    link("lamp", lamp, (0.5, 0.0, 3.0), (0.0, 0.0, 0.0))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=(0.0, 0.0, 1.0))
    ball = bpy.data.materials.new("ball")
    ball.clpt.kind, ball.clpt.metal, ball.clpt.roughness = "METAL", "gold", 0.3
    bpy.context.object.data.materials.append(ball)
    shown = picture("CLPT", tmp_path, 32)
    white = shown.mean(axis=(0, 1))
    middle = shown[10:16, 18:26].mean(axis=(0, 1))
    assert middle[0] > 1.3 * middle[2]
    lamp.clpt.spectrum = "sodium"
    orange = picture("CLPT", tmp_path, 32).mean(axis=(0, 1))
    assert orange[2] < 0.1 * orange[0] and white[2] > 0.15 * white[0]
    ball.clpt.kind, ball.clpt.glass = "GLASS", "n-sf11"
    ball.clpt.film_thickness, ball.clpt.roughness = 300.0, 0.0
    world = bpy.data.worlds.new("world")
    world.clpt.use_sky, world.clpt.strength = True, 1.0
    bpy.context.scene.world = world
    lamp.energy = 0.0
    bpy.context.scene.camera.rotation_euler = (2.2, 0.0, 0.0)
    sky = picture("CLPT", tmp_path, 32).mean(axis=(0, 1))
    assert sky[2] > 1.2 * sky[0] > 0.0


def test_hair_lies_where_cycles_has_it(tmp_path: Path) -> None:
    """Thick strands before a bright world, in rgb: shares of the picture that are dark, to 5 %."""
    floor_and_camera()
    bpy.data.objects["Plane"].location = (0.0, 0.0, -200.0)
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    hair = bpy.data.hair_curves.new("hair")
    hair.add_curves([5, 4, 6])
    places = np.random.default_rng(3).uniform(-1.0, 1.0, (15, 3)).astype(np.float32)
    hair.points.foreach_set("position", places.ravel())
    radius = hair.attributes.get("radius") or hair.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(15, 0.15, np.float32))
    black = bpy.data.materials.new("black")
    black.use_nodes = True
    black.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0, 0, 0, 1)
    black.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"].default_value = 0.0
    hair.materials.append(black)
    link("hair", hair, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    bpy.context.scene.camera.data.angle = 0.5
    bpy.context.scene.cycles_curves.shape = "THICK"
    ours, cycles = (picture(engine, tmp_path, 64) for engine in ("CLPT", "CYCLES"))
    dark = [(shown.mean(axis=2) < 0.5 * shown.max()).mean() for shown in (ours, cycles)]
    assert 0.03 < dark[1] < 0.7 and dark[0] == pytest.approx(dark[1], rel=0.05)


def test_passes_are_those_of_cycles(tmp_path: Path) -> None:
    """Depth, normals, positions of a cube: medians of the differences are rounding."""
    bpy.ops.wm.read_factory_settings()
    layer = bpy.context.scene.view_layers[0]
    for option in ("use_pass_z", "use_pass_normal", "use_pass_position"):
        setattr(layer, option, True)
    if bpy.app.version >= (5, 0, 0):
        bpy.context.scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    shown = {}
    for engine in ("CLPT", "CYCLES"):
        scene = bpy.context.scene
        scene.render.engine = engine
        scene.cycles.samples = scene.clpt.samples = 16
        scene.render.resolution_x, scene.render.resolution_y = SIZE
        scene.render.resolution_percentage = 100
        scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
        scene.render.image_settings.color_depth = "32"
        scene.render.filepath = str(tmp_path / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        file = Path(scene.render.filepath)
        parts = range(len(images.part_names(file)))
        shown[engine] = {
            name: values
            for part in parts
            for name, values in exr_files.read_channels(file, part=part).items()
        }
    names = [f"{name}.{axis}" for name in ("Normal", "Position") for axis in "XYZ"]
    for name in ("Depth.Z", *names):
        ours, cycles = (shown[engine][f"ViewLayer.{name}"] for engine in ("CLPT", "CYCLES"))
        assert np.median(np.abs(ours - cycles)) < 1e-3, name
        assert np.mean(np.abs(ours - cycles) < 0.02) > 0.8, name


def test_what_moves_is_blurred_as_in_cycles(tmp_path: Path) -> None:
    """A glowing square that crosses the picture while the shutter is open: its row of pixels."""
    floor_and_camera()
    bpy.data.objects["Plane"].location = (0.0, 0.0, -200.0)
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    square = bpy.context.object
    glow = bpy.data.materials.new("glow")
    glow.use_nodes = True
    surface = glow.node_tree.nodes["Principled BSDF"]
    surface.inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    surface.inputs["Emission Strength"].default_value = 2.0
    square.data.materials.append(glow)
    for frame, x in ((0, -2.0), (2, 2.0)):
        square.location = (x, 0.0, 0.0)
        square.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.render.motion_blur_shutter = 1.0
    ours, cycles = (picture(engine, tmp_path, 256) for engine in ("CLPT", "CYCLES"))
    rows = [shown[..., 0].sum(axis=0) for shown in (ours, cycles)]
    assert rows[0].sum() == pytest.approx(rows[1].sum(), rel=0.02)
    assert np.abs(rows[0] - rows[1]).max() < 0.1 * rows[1].max()


def test_a_transparent_film_has_alpha(tmp_path: Path) -> None:
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"
    alphas = []
    for engine in ("CLPT", "CYCLES"):
        picture(engine, tmp_path, 32)
        channels = images.read_channels(scene.render.filepath)
        alphas.append(next(v for name, v in channels.items() if name.endswith("A")).mean())
    assert 0.05 < alphas[1] < 0.5 and alphas[0] == pytest.approx(alphas[1], abs=0.005)


def table() -> str:
    """An IES file whose intensity differs by direction, smooth: engines blend it differently."""
    down, around = np.arange(0, 181, 5), np.arange(0, 361, 15)
    turn = np.radians(around)[:, None]
    candela = 400.0 + 300.0 * np.cos(np.radians(down)) + 100.0 * np.sin(np.radians(down)) * (
        np.cos(turn) + np.sin(2.0 * turn)
    )  # fmt: skip
    lines = [down, around, *np.round(candela, 2)]
    head = "IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 37 25 1 2 0 0 0\n1 1 10\n"
    return head + "\n".join(" ".join(map(str, line)) for line in lines) + "\n"


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_ies_textures_are_those_of_cycles(kind: str, tmp_path: Path) -> None:
    """A turned lamp of other light to all sides, from a text and from a file; quarters to 2 %."""
    floor_and_camera()
    lamp = bpy.data.lights.new("lamp", kind)
    lamp.energy, lamp.shadow_soft_size, lamp.use_nodes = 3.0, 0.0, True
    if kind == "SPOT":
        lamp.spot_size, lamp.spot_blend = 1.6, 0.5
    node = lamp.node_tree.nodes.new("ShaderNodeTexIES")
    node.inputs["Strength"].default_value = 2.0
    glow = lamp.node_tree.nodes["Emission"]
    glow.inputs["Color"].default_value = (1.0, 0.6, 0.3, 1.0)
    lamp.node_tree.links.new(node.outputs[0], glow.inputs["Strength"])
    link("lamp", lamp, (0.3, 0.2, 2.0), (0.2, 0.1, 0.5))
    if kind == "POINT":
        node.ies = bpy.data.texts.new("lamp.ies")
        node.ies.write(table())
    else:
        (tmp_path / "lamp.ies").write_text(table())
        node.mode, node.filepath = "EXTERNAL", str(tmp_path / "lamp.ies")
    ours, cycles = (picture(engine, tmp_path) for engine in ("CLPT", "CYCLES"))
    for rows in np.split(np.stack([ours, cycles]), 2, axis=1):
        for quarter in np.split(rows, 2, axis=2):
            mine, theirs = quarter.mean(axis=(1, 2))
            assert mine == pytest.approx(theirs, rel=0.02)


def test_a_panorama_is_that_of_cycles(tmp_path: Path) -> None:
    """All directions in latitude and longitude, from a turned camera: means of quarters to 2 %."""
    floor_and_camera()
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size = 100.0, 0.0
    link("lamp", lamp, (1.5, -4.0, 3.0), (0.0, 0.0, 0.0))
    camera = bpy.context.scene.camera
    camera.data.type, camera.rotation_euler = "PANO", (1.2, 0.2, 0.6)
    camera.data.shift_x = camera.data.shift_y = 0.0
    camera.data.panorama_type = "EQUIRECTANGULAR"
    ours, cycles = (picture(engine, tmp_path) for engine in ("CLPT", "CYCLES"))
    for rows in np.split(np.stack([ours, cycles]), 2, axis=1):
        for quarter in np.split(rows, 2, axis=2):
            mine, theirs = quarter.mean(axis=(1, 2, 3))
            assert mine == pytest.approx(theirs, rel=0.02, abs=1e-3)


def test_a_bad_ies_file_is_a_line(tmp_path: Path) -> None:
    """One that is missing counts as 1; a damaged one is an error that names it."""
    floor_and_camera()
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.shadow_soft_size, lamp.use_nodes = 0.0, True
    node = lamp.node_tree.nodes.new("ShaderNodeTexIES")
    lamp.node_tree.links.new(node.outputs[0], lamp.node_tree.nodes["Emission"].inputs["Strength"])
    link("lamp", lamp, (0.3, 0.2, 2.0), (0.0, 0.0, 0.0))
    file = tmp_path / "lamp.ies"
    node.mode, node.filepath = "EXTERNAL", str(file)
    assert picture("CLPT", tmp_path, 4).mean() > 0.0
    file.write_text("no table")
    with pytest.raises(RuntimeError, match=r"lamp\.ies"):
        picture("CLPT", tmp_path, 4)
