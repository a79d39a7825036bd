"""Shaders of Cycles on a ball: means of the ball beside Cycles, near ones within what is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.blender.test_surfaces import pictures, stage

bpy: Any = pytest.importorskip("bpy")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered")]
__all__ = ["stage"]
COLOR = (0.8, 0.3, 0.1, 1.0)


def one(kind: str, **inputs: Any) -> Callable[[Any], Any]:
    """Return a builder of a shader node; attributes of nodes are inputs too."""

    def build(tree: Any) -> Any:
        node = tree.nodes.new(f"ShaderNode{kind}")
        for key, value in inputs.items():
            if key in node.bl_rna.properties:
                setattr(node, key, value)
        for key, value in inputs.items():
            if key not in node.bl_rna.properties:
                node.inputs[key.replace("_", " ")].default_value = value
        return node

    return build


def mixed(kind: str, factor: float, *parts: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def build(tree: Any) -> Any:
        node = tree.nodes.new(f"ShaderNode{kind}")
        first = 1 if kind == "MixShader" else 0
        if first:
            node.inputs[0].default_value = factor
        for i, part in enumerate(parts):
            tree.links.new(part(tree).outputs[0], node.inputs[first + i])
        return node

    return build


def facing(tree: Any) -> Any:
    """A red front and a blue back, seen through a hole of the ball."""
    node = mixed("MixShader", 0.5, one("BsdfDiffuse", Color=(0.9, 0.1, 0.1, 1.0)),
                 one("BsdfDiffuse", Color=(0.1, 0.1, 0.9, 1.0)))(tree)  # fmt: skip
    side = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(side.outputs["Backfacing"], node.inputs[0])
    return node


def coated(tree: Any) -> Any:
    """The old way to plastic: a matte base and a glossy layer, mixed by Fresnel."""
    node = mixed("MixShader", 0.5, one("BsdfDiffuse", Color=COLOR),
                 one("BsdfAnisotropic", Roughness=0.2))(tree)  # fmt: skip
    share = tree.nodes.new("ShaderNodeFresnel")
    tree.links.new(share.outputs[0], node.inputs[0])
    return node


GLOW = one("Emission", Color=(0.2, 0.4, 0.9, 1.0), Strength=0.7)
SHADERS: dict[str, tuple[Callable[[Any], Any], float]] = {
    "diffuse": (one("BsdfDiffuse", Color=COLOR), 0.01),
    "rough diffuse": (one("BsdfDiffuse", Color=COLOR, Roughness=0.8), 0.04),
    "glossy": (one("BsdfAnisotropic", Color=COLOR, Roughness=0.3), 0.05),
    "stretched": (one("BsdfAnisotropic", Color=COLOR, Roughness=0.4, Anisotropy=0.5), 0.06),
    "brushed": (one("BsdfPrincipled", Metallic=1.0, Roughness=0.4, Anisotropic=0.8), 0.06),
    "metallic": (one("BsdfMetallic", Base_Color=COLOR, Roughness=0.3), 0.05),
    "conductor": (one("BsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR", Roughness=0.4), 0.06),
    "sheen": (one("BsdfSheen", Color=COLOR), 0.06),
    "glass": (one("BsdfGlass", Color=(0.9, 0.6, 0.9, 1.0)), 0.02),
    "rough glass": (one("BsdfGlass", Roughness=0.4), 0.06),
    "refraction": (one("BsdfRefraction", IOR=1.3), 0.06),
    "translucent": (one("BsdfTranslucent", Color=COLOR), 0.05),
    "transparent": (one("BsdfTransparent", Color=(0.9, 0.5, 0.4, 1.0)), 0.02),
    "emission": (GLOW, 0.01),
    "principled": (one("BsdfPrincipled", Base_Color=COLOR, Roughness=0.4), 0.03),
    "metal": (one("BsdfPrincipled", Base_Color=COLOR, Metallic=1.0, Roughness=0.4), 0.05),
    "coat": (one("BsdfPrincipled", Base_Color=COLOR, Coat_Weight=1.0), 0.05),
    "alpha": (one("BsdfPrincipled", Base_Color=COLOR, Alpha=0.4), 0.03),
    "film": (one("BsdfPrincipled", Base_Color=COLOR, Metallic=1, Thin_Film_Thickness=300.0), 0.06),
    "mixture": (mixed("MixShader", 0.3, one("BsdfDiffuse"), one("BsdfAnisotropic")), 0.04),
    "half there": (mixed("MixShader", 0.3, one("BsdfDiffuse"), one("BsdfTransparent")), 0.03),
    "glows too": (mixed("AddShader", 0.0, one("BsdfDiffuse"), GLOW), 0.02),
    "two sides": (facing, 0.03),
    "coated": (coated, 0.03),
}  # fmt: skip


@pytest.mark.parametrize("name", SHADERS)
def test_a_ball_is_that_of_cycles(name: str, tmp_path: Path, stage: Any) -> None:
    """A ball with a hole toward the camera, in a world of two halves and a lamp."""
    build, allowed = SHADERS[name]
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.2, segments=48, ring_count=24)
    ball = bpy.context.object
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    paint = bpy.data.materials.new("paint")
    paint.use_nodes = True
    tree = paint.node_tree
    tree.nodes.clear()
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree).outputs[0], end.inputs["Surface"])
    ball.data.materials.append(paint)
    world = bpy.data.worlds.new("world")
    stage.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.6, 0.8, 1.0)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "AREA"))
    lamp.data.energy, lamp.data.size, lamp.location = 150.0, 2.0, (-1.0, -1.0, 4.0)
    stage.collection.objects.link(lamp)
    stage.cycles.transmission_bounces = stage.cycles.transparent_max_bounces = 16
    ours, cycles = pictures(tmp_path, 128, 12)
    middle = slice(12, 28)
    mine, theirs = (shown[middle, middle].mean(axis=(0, 1)) for shown in (ours, cycles))
    assert np.abs(mine - theirs).max() < allowed * theirs.max(), (mine, theirs)
