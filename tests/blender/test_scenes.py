"""Whole scenes beside Cycles: that of Blender's exporters, and ten frames of an arm that bends."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.blender.test_surfaces import pictures, stage

bpy: Any = pytest.importorskip("bpy")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered")]
__all__ = ["stage"]


def quarters(picture: np.ndarray) -> np.ndarray:
    """Return the means of the quarters of a square picture (2, 2)."""
    half = len(picture) // 2
    return picture.reshape(2, half, 2, half, 3).mean(axis=(1, 3, 4))


def plain(name: str, color: tuple[float, float, float], shine: float) -> Any:
    """Return a Principled BSDF of a color; shine: its level of reflection."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Specular IOR Level"].default_value = shine
    return material


def bent_arm(shine: float) -> None:
    """A post on a floor whose upper half a bone bends, from frame 1 to 10."""
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    bpy.context.object.data.materials.append(plain("floor", (0.8, 0.8, 0.8), shine))
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.75))
    arm = bpy.context.object
    arm.scale = (0.2, 0.2, 1.5)
    bpy.ops.object.transform_apply(location=True, scale=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=8)
    bpy.ops.object.mode_set(mode="OBJECT")
    arm.data.materials.append(plain("arm", (0.8, 0.3, 0.1), shine))
    bpy.ops.object.armature_add(location=(0.0, 0.0, 0.0))
    bones = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    lower = bones.data.edit_bones[0]
    lower.tail = (0.0, 0.0, 0.75)
    upper = bones.data.edit_bones.new("upper")
    upper.head, upper.tail, upper.parent = lower.tail, (0.0, 0.0, 1.5), lower
    bpy.ops.object.mode_set(mode="OBJECT")
    groups = [arm.vertex_groups.new(name=name) for name in ("Bone", "upper")]
    for vertex in arm.data.vertices:
        share = min(max(2.0 * vertex.co.z - 1.0, 0.0), 1.0)
        for group, weight in zip(groups, (1.0 - share, share), strict=True):
            group.add([vertex.index], weight, "REPLACE")
    arm.modifiers.new("armature", "ARMATURE").object = bones
    bone = bones.pose.bones["upper"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, -1.2), (10, 1.2)):
        bone.rotation_euler = (angle, 0.0, 0.0)
        bone.keyframe_insert("rotation_euler", frame=frame)


def lit(strength: float) -> Any:
    """Let a square lamp and a sky light the scene; return the scene."""
    scene = bpy.context.scene
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "AREA"))
    lamp.data.energy, lamp.data.size = strength, 1.0
    lamp.location, lamp.rotation_euler = (1.5, -1.5, 3.0), (0.55, 0.0, 0.785)
    scene.collection.objects.link(lamp)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.3, 0.4, 0.6, 1.0)
    return scene


@pytest.mark.parametrize(("shine", "frames"), [(0.0, range(1, 11)), (0.5, [5])])
def test_ten_frames_of_a_bent_arm(shine: float, frames: Sequence[int], tmp_path: Path) -> None:
    """With motion blur. Matte they agree; colors below a shine are up to 2 % brighter, see docs."""
    bent_arm(shine)
    scene = lit(150.0)
    scene.render.use_motion_blur = True
    for frame in frames:
        scene.frame_set(frame)
        ours, cycles = (quarters(shown) for shown in pictures(tmp_path, 128, 12))
        assert ours == pytest.approx(cycles, rel=0.02), frame
        assert ours.mean() == pytest.approx(cycles.mean(), rel=0.02 if shine else 0.005), frame


def test_the_scene_of_the_exporters(assets: Path, tmp_path: Path) -> None:
    """Shaders, hair, instances, four lamps, a dome and motion of Blender's own USD file.

    Without what Cycles does in another way: it blends texels before it decodes sRGB, clamps light,
    blurs caustics, and loses light of the blurred border of a small sun.
    """
    if bpy.app.version < (5, 0):
        pytest.skip("its dome says that it is in sRGB, which Blender 4 does not read")
    folder, scene = assets / "blender", bpy.context.scene
    bpy.ops.wm.usd_import(filepath=str(folder / "materialx.usdc"))
    scene.camera = bpy.data.objects["Cam"]
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    sky.interpolation = "Closest"
    sky.image = bpy.data.images.load(str(folder / "sky.exr"))
    tree.links.new(sky.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    for node in bpy.data.materials["floor"].node_tree.nodes:
        if node.type == "TEX_IMAGE":
            node.interpolation = "Closest"
    scene.cycles.sample_clamp_indirect = scene.cycles.blur_glossy = 0.0
    ours, cycles = pictures(tmp_path, 256, 12)
    assert quarters(ours) == pytest.approx(quarters(cycles), rel=0.03)
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.02)
