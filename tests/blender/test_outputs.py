"""Parts of pictures, mattes, layers, previews, frames, and colors on screens (needs bpy)."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clpt import images
from clpt.images import exr_files

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")
engine: Any = pytest.importorskip("blender.engine")
panels: Any = pytest.importorskip("blender.panels")
passes: Any = pytest.importorskip("blender.passes")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered", "first_scene")]
SIZE = 47, 35


def rendered(name: str, folder: Path, samples: int = 64, form: str = "OPEN_EXR") -> Path:
    """Render with an engine; return the file."""
    scene = bpy.context.scene
    scene.render.engine = name
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.clpt.samples, scene.clpt.mode = samples, "rgb"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    kind = "MULTI_LAYER_IMAGE" if form == "OPEN_EXR_MULTILAYER" else "IMAGE"
    if hasattr(scene.render.image_settings, "media_type"):  # since Blender 5.0
        scene.render.image_settings.media_type = kind
    scene.render.image_settings.file_format = form
    scene.render.image_settings.color_depth = "8" if form == "PNG" else "32"
    scene.render.filepath = str(folder / f"{name}{scene.render.file_extension}")
    bpy.ops.render.render(write_still=True)
    return Path(scene.render.filepath)


def channels(file: Path) -> dict[str, np.ndarray]:
    """Return all channels of a file of several layers, by their names."""
    parts = range(len(images.part_names(file)))
    return {
        name: values
        for part in parts
        for name, values in exr_files.read_channels(file, part=part).items()
    }


@pytest.mark.parametrize("crop", [False, True])
def test_a_border_is_that_of_cycles(crop: bool, tmp_path: Path) -> None:
    frames = bpy.context.scene.render
    frames.use_border, frames.use_crop_to_border = True, crop
    frames.border_min_x, frames.border_max_x = 0.21, 0.73
    frames.border_min_y, frames.border_max_y = 0.33, 0.87
    ours, cycles = (np.asarray(images.read(rendered(n, tmp_path))) for n in ("CLPT", "CYCLES"))
    assert ours.shape == cycles.shape
    lit = [shown[..., :3].sum(axis=2) > 0.0 for shown in (ours, cycles)]
    assert np.array_equal(*lit)
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.02)


def test_mattes_are_those_of_cycles(tmp_path: Path) -> None:
    """The same names' hashes, and shares of pixels within noise; instances have their own names."""
    bpy.ops.mesh.primitive_uv_sphere_add(location=(1.5, -1.5, 0.5))
    copy = bpy.context.object.copy()
    copy.location, copy.name = (-1.5, 1.0, 0.5), "another"
    bpy.context.scene.collection.objects.link(copy)
    layer = bpy.context.scene.view_layers[0]
    layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_material = True
    layer.pass_cryptomatte_depth = 4
    found = []
    for name in ("CLPT", "CYCLES"):
        shown = channels(rendered(name, tmp_path, 64, "OPEN_EXR_MULTILAYER"))
        mattes = [channel for channel in shown if "Crypto" in channel]
        found.append(sorted(mattes))
        for kind in ("CryptoObject", "CryptoMaterial"):
            pairs = [
                [shown[f"ViewLayer.{kind}{level:02d}.{letter}"] for letter in two]
                for level in range(2)
                for two in ("rg", "ba")
            ]
            ids = np.stack([pair[0] for pair in pairs]).view(np.uint32)
            shares = np.stack([pair[1] for pair in pairs])
            covered = {int(i): float(shares[ids == i].sum()) for i in np.unique(ids[shares > 0.0])}
            found.append(covered)
    assert found[0] == found[3]
    for ours, cycles in (found[1:3], found[4:6]), (found[4:6], found[1:3]):
        for mine, theirs in zip(ours, cycles, strict=True):
            assert {i for i, share in mine.items() if share > 5.0} <= set(theirs)
            for i, share in mine.items():
                assert share == pytest.approx(theirs.get(i, 0.0), rel=0.05, abs=3.0)
    assert len(found[1]) >= 3


def test_a_limit_of_noise_ends_the_render(tmp_path: Path) -> None:
    whole = np.asarray(images.read(rendered("CLPT", tmp_path)))
    bpy.context.scene.clpt.noise = 0.1
    began = time.monotonic()
    limited = np.asarray(images.read(rendered("CLPT", tmp_path, 1 << 20)))
    assert time.monotonic() - began < 600.0
    assert limited.mean() == pytest.approx(whole.mean(), rel=0.05)


def test_denoised_pictures_are_nearer_to_the_truth(tmp_path: Path) -> None:
    """A lit floor in the light of a large lamp: noise of 8 samples, less than .7 of it after."""
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    bpy.data.lights["Light"].type = "AREA"
    bpy.data.lights["Light"].size = 3.0
    truth, noisy = (np.asarray(images.read(rendered("CLPT", tmp_path, n))) for n in (1024, 8))
    bpy.context.scene.clpt.denoise = True
    clean = np.asarray(images.read(rendered("CLPT", tmp_path, 8)))
    assert clean.mean() == pytest.approx(truth.mean(), rel=0.02)
    errors = [np.median(np.abs(shown - truth)[..., :3]) for shown in (clean, noisy)]
    assert errors[0] < 0.7 * errors[1]


def test_view_layers_have_pictures_of_their_own(tmp_path: Path) -> None:
    """The second layer shows no cube; each has its passes."""
    scene = bpy.context.scene
    second = scene.view_layers.new("second")
    second.use_pass_z = True
    cubes = bpy.data.collections.new("cubes")
    scene.collection.children.link(cubes)
    cube = bpy.data.objects["Cube"]
    cube.users_collection[0].objects.unlink(cube)
    cubes.objects.link(cube)
    second.layer_collection.children["cubes"].exclude = True
    shown = channels(rendered("CLPT", tmp_path, 8, "OPEN_EXR_MULTILAYER"))
    middle = SIZE[1] // 2, SIZE[0] // 2
    first, other = (shown[f"{name}.Combined.R"] for name in ("ViewLayer", "second"))
    assert first.std() > 0.01 and other.std() < 0.01
    assert first.shape == other.shape == SIZE[::-1]
    assert shown["second.Depth.Z"][middle] > 1e9


def test_frames_of_an_animation(tmp_path: Path) -> None:
    """A cube that leaves: each frame is a picture of its own time."""
    cube, scene = bpy.data.objects["Cube"], bpy.context.scene
    for frame, height in ((1, 0.0), (3, 20.0)):
        cube.location.z = height
        cube.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, 3
    rendered("CLPT", tmp_path, 8)
    scene.render.filepath = str(tmp_path / "frame")
    bpy.ops.render.render(animation=True)
    shown = [np.asarray(images.read(file))[..., :3] for file in sorted(tmp_path.glob("frame*.exr"))]
    assert len(shown) == 3
    assert shown[0].std() > 2.0 * shown[2].std()


def test_screens_get_the_view_transform_of_blender(tmp_path: Path) -> None:
    """AgX, Filmic and Standard: a .png is what Blender makes of our linear values, to 1/255."""
    scene = bpy.context.scene
    for transform in ("AgX", "Filmic", "Standard"):
        scene.view_settings.view_transform = transform
        scene.render.dither_intensity = 0.0
        linear = rendered("CLPT", tmp_path, 8)
        screen = np.asarray(images.read(rendered("CLPT", tmp_path, 8, "PNG")))
        again = bpy.data.images.load(str(linear))
        again.save_render(str(tmp_path / "again.png"), scene=scene)
        wanted = np.asarray(images.read(tmp_path / "again.png"))
        to_bytes = [
            np.round(255.0 * images.to_srgb8(a).astype(float) / 255.0) for a in (screen, wanted)
        ]
        assert np.abs(to_bytes[0] - to_bytes[1]).max() <= 1.0, transform
        bpy.data.images.remove(again)


PREVIEW = """
import os, sys, threading
import bpy, numpy as np
import blender
from blender import engine

rendered, shown = threading.Event(), []
show, render = engine.ClptEngine._show, engine.ClptEngine.render

def note(self, layers, size, *more):
    shown.append(np.frombuffer(layers[""], np.float32).reshape(size[1], size[0], 4))
    show(self, layers, size, *more)

def whole(self, depsgraph):
    render(self, depsgraph)
    rendered.set()

engine.ClptEngine._show, engine.ClptEngine.render = note, whole
blender.register()
bpy.ops.wm.read_factory_settings()
bpy.context.scene.render.engine = "CLPT"
material = bpy.data.materials["Material"]
color = material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
color.default_value = (0.8, 0.02, 0.02, 1.0)
with bpy.context.temp_override(id=material):
    bpy.ops.ed.lib_id_generate_preview()
rendered.wait(300.0)
height, width, _ = shown[-1].shape
np.save(sys.argv[1], shown[-1])
os._exit(0)
"""


def test_previews_of_materials(tmp_path: Path) -> None:
    """Blender asks for a picture of its ball in a thread; it is of the material's color.

    In a process of its own: a script that renders while a preview is being made hangs, because
    Blender's main thread waits for the preview's and keeps Python's lock.
    """
    file = tmp_path / "ball.npy"
    environment = {**os.environ, "PYTHONPATH": str(Path(blender.__file__).parents[1])}
    subprocess.run([sys.executable, "-c", PREVIEW, str(file)], check=True, env=environment)
    ball = np.load(file)
    middle = ball[ball.shape[0] // 2, ball.shape[1] // 2]
    assert middle[0] > 3.0 * middle[2] > 0.0


def test_panels_show_what_the_engine_reads() -> None:
    """Blender's own ones for lamps, materials, worlds and cameras, and the engine's."""
    scene = bpy.context.scene
    scene.render.engine = "CLPT"
    shown = {
        panel.__name__
        for panel in bpy.types.Panel.__subclasses__()
        if "CLPT" in getattr(panel, "COMPAT_ENGINES", ())
    }
    wanted = {"DATA_PT_lens", "DATA_PT_camera_dof", "DATA_PT_EEVEE_light", "MATERIAL_PT_preview"}
    wanted |= {"EEVEE_MATERIAL_PT_surface", "RENDER_PT_format", "RENDER_PT_color_management"}
    assert wanted <= shown
    assert any("WORLD_PT" in name for name in shown)
    context = SimpleNamespace(
        engine="CLPT", scene=scene, view_layer=scene.view_layers[0], light=bpy.data.lights[0],
        material=bpy.data.materials[0], world=bpy.data.worlds[0], camera=bpy.data.cameras[0],
        object=bpy.data.objects[0],
    )  # fmt: skip
    for panel in panels.PANELS:
        assert panel.poll(context)
        settings, names = panel.shown(context)
        assert names and all(name in settings.bl_rna.properties for name in names), panel


def test_groups_of_lights_are_passes(tmp_path: Path) -> None:
    """A lamp, a ball that glows and the world, each in a group; a group without lights is dark.

    Means within 2 %, of noise of less than .5 %.
    """
    scene, lamp = bpy.context.scene, bpy.data.objects["Light"]
    bpy.ops.mesh.primitive_uv_sphere_add(location=(-2.0, -2.0, 1.0))
    ball = bpy.context.object
    glow = bpy.data.materials.new("glow")
    glow.use_nodes = True
    glow.node_tree.nodes["Principled BSDF"].inputs["Emission Color"].default_value = (1, 0.5, 0, 1)
    glow.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 3.0
    ball.data.materials.append(glow)
    for group in ("key", "ball", "none"):
        scene.view_layers[0].lightgroups.add(name=group)
    lamp.lightgroup, ball.lightgroup = "key", "ball"
    shown = [
        channels(rendered(name, tmp_path, 256, "OPEN_EXR_MULTILAYER"))
        for name in ("CLPT", "CYCLES")
    ]
    for name in ("Combined_key", "Combined_ball", "Combined_none"):
        ours, cycles = (
            [group[f"ViewLayer.{name}.{letter}"].mean() for letter in "RGB"] for group in shown
        )
        assert ours == pytest.approx(cycles, rel=0.02, abs=1e-4), name
    assert not shown[0]["ViewLayer.Combined_none.R"].any()


def test_bands_are_passes(tmp_path: Path) -> None:
    """Four bands of 50 nm before a reddish world: they rise as its light does; in RGB are none."""
    scene = bpy.context.scene
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 0.4, 0.1, 1.0)
    settings = scene.clpt
    settings.bands, settings.first_band, settings.last_band = 4, 450.0, 650.0
    settings.mode = "rgb"
    assert not passes.centers(settings)
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage, scene.render.engine = 100, "CLPT"
    settings.samples, settings.mode = 16, "spectral"
    if hasattr(scene.render.image_settings, "media_type"):  # since Blender 5.0
        scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.filepath = str(tmp_path / "bands.exr")
    bpy.ops.render.render(write_still=True)
    shown = channels(tmp_path / "bands.exr")
    bands = [shown[f"ViewLayer.{nm} nm.X"][0].mean() for nm in (475, 525, 575, 625)]
    assert bands == sorted(bands) and bands[3] > 3.0 * bands[0] > 0.0


def test_direct_and_indirect_light_are_the_picture(tmp_path: Path) -> None:
    """And what the compositor denoises by: the albedo of a grey box, the normal of a floor."""
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    settings = bpy.context.scene.clpt
    settings.light_passes = settings.denoising_passes = True
    shown = channels(rendered("CLPT", tmp_path, 16, "OPEN_EXR_MULTILAYER"))

    def of(name: str, letters: str) -> np.ndarray:
        return np.stack([shown[f"ViewLayer.{name}.{letter}"] for letter in letters], axis=-1)

    whole, direct, indirect = (of(name, "RGB") for name in ("Combined", "Direct", "Indirect"))
    assert np.allclose(direct + indirect, whole, rtol=1e-4, atol=1e-5) and indirect.any()
    middle = SIZE[1] // 2, SIZE[0] // 2
    assert of("Denoising Albedo", "RGB")[middle] == pytest.approx([0.8] * 3, abs=0.06)
    assert of("Denoising Normal", "XYZ")[-2, 2] == pytest.approx((0.0, 0.0, 1.0), abs=0.01)
