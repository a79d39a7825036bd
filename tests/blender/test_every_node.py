"""One scene with every node that the page says is read: a tile or a ball of each, beside Cycles."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy: Any = pytest.importorskip("bpy")

from tests.blender.test_engine import table  # noqa: E402
from tests.blender.test_nodes import CASES, LOOSE, LOST, documented, kinds, moved  # noqa: E402
from tests.blender.test_shaders import COLOR, SHADERS, mixed, one  # noqa: E402
from tests.blender.test_surfaces import material, painted, pictures, stage  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered")]
__all__ = ["stage"]
COLUMNS, SIDE = 10, 24  # tiles of a row, pixels of a tile
ALONE = {"Sky Texture", "Reroute"}  # a sky is a whole world of its own: test_surfaces.py
Build = Callable[[Any], Any]


def place(tree: Any) -> Any:
    """Return the coordinates of an object's own space: all tiles have the same."""
    return tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]


def shown(kind: str, output: str, **settings: Any) -> Build:
    """Return a builder of a node's output, moved to about [0, 1]."""
    return lambda tree: moved(tree, (kind, output, settings, ""), place(tree))


def colors() -> dict[str, tuple[Build, float]]:
    """Nodes that are no shaders: what emits their output, and how far means may be off."""
    usual: dict[str, Any] = {}
    for case in CASES:
        if case[0] not in usual or "3D" in case[2].values():
            usual.setdefault(case[0], case)
    found: dict[str, tuple[Build, float]] = {
        kind: (lambda tree, case=case: moved(tree, case, place(tree)), LOOSE.get(kind, 0.01))
        for kind, case in usual.items()
    }
    old = (space for space in ("RGB", "HSV") if hasattr(bpy.types, f"ShaderNodeCombine{space}"))
    for space in old:  # of Blender 4
        of_color = (f"Separate{space}", {"RGB": "G", "HSV": "S"}[space], {}, "color")
        of_parts = (f"Combine{space}", {"RGB": "Image", "HSV": "Color"}[space], {}, "shares")
        for case in (of_color, of_parts):
            found[case[0]] = (lambda tree, case=case: moved(tree, case, place(tree))), 0.01
    if bpy.app.version < (5, 0):  # its cells lie elsewhere, which is told
        found["TexVoronoi"] = found["TexVoronoi"][0], 0.1
    others: dict[str, Build] = {
        "Value": value, "RGB": shown("RGB", "Color"), "TexCoord": shown("TexCoord", "UV"),
        "UVMap": shown("UVMap", "UV"), "ObjectInfo": shown("ObjectInfo", "Random"),
        "Attribute": shown("Attribute", "Color", attribute_name="number"),
        "VertexColor": shown("VertexColor", "Color", layer_name="paint"),
        "TexImage": lambda tree: seen(tree, "TexImage"), "Group": grouped,
        "TexEnvironment": lambda tree: seen(tree, "TexEnvironment"),
    }  # fmt: skip
    return found | {name: (build, 0.01) for name, build in others.items()}


def value(tree: Any) -> Any:
    """A number; its material writes to a pass of Cycles as well, which is left out."""
    tree.nodes.new("ShaderNodeOutputAOV")
    node = tree.nodes.new("ShaderNodeValue")
    node.outputs[0].default_value = 0.4
    return node.outputs[0]


def seen(tree: Any, kind: str) -> Any:
    """An image, at a tile's own coordinates."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    node.image = painted()
    tree.links.new(place(tree), node.inputs["Vector"])
    return node.outputs["Color"]


def grouped(tree: Any) -> Any:
    """A group that returns where it is looked up."""
    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    inner.interface.new_socket("Shade", in_out="OUTPUT", socket_type="NodeSocketColor")
    end, node = inner.nodes.new("NodeGroupOutput"), tree.nodes.new("ShaderNodeGroup")
    inner.links.new(shown("TexCoord", "Generated")(inner), end.inputs[0])
    node.node_tree = inner
    return node.outputs[0]


def weighted(tree: Any) -> Any:
    """A matte base and a glossy layer, mixed by Layer Weight."""
    node = mixed("MixShader", 0.5, one("BsdfDiffuse", Color=COLOR),
                 one("BsdfAnisotropic", Roughness=0.2))(tree)  # fmt: skip
    share = tree.nodes.new("ShaderNodeLayerWeight")
    share.inputs["Blend"].default_value = 1.0 / 3.0
    tree.links.new(share.outputs["Fresnel"], node.inputs[0])
    return node


def seen_alone(tree: Any) -> Any:
    """What the camera sees in place of what lights others."""
    node = mixed("MixShader", 0.5, one("Emission"), one("BsdfDiffuse", Color=COLOR))(tree)
    path = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], node.inputs[0])
    return node


def bent(kind: str) -> Build:
    """Return a builder of a matte surface with waves, as heights or as normals."""

    def build(tree: Any) -> Any:
        node, bend = one("BsdfDiffuse", Color=COLOR)(tree), tree.nodes.new(f"ShaderNode{kind}")
        waves = shown("TexWave", "Color", Distortion=1.0)(tree)
        if kind == "NormalMap":
            scale = tree.nodes.new("ShaderNodeVectorMath")
            scale.operation = "MULTIPLY_ADD"
            scale.inputs[1].default_value = (0.3, 0.2, 0.0)
            scale.inputs[2].default_value = (0.3, 0.4, 1.0)
            tree.links.new(waves, scale.inputs[0])
            tree.links.new(scale.outputs[0], bend.inputs["Color"])
        else:
            bend.inputs["Distance"].default_value = 0.1
            tree.links.new(waves, bend.inputs["Height"])
        tree.links.new(bend.outputs[0], node.inputs["Normal"])
        return node

    return build


def striped(tree: Any) -> Any:
    """Matte strands whose color changes from their roots to their tips."""
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    tree.links.new(shown("HairInfo", "Intercept")(tree), node.inputs["Color"])
    return node


BALLS: dict[str, tuple[Build, float]] = {
    **SHADERS, "film": (SHADERS["film"][0], 0.07), "weighted": (weighted, 0.04),
    "glass": (SHADERS["glass"][0], 0.05),  # a small bright image of the lamp
    "camera alone": (seen_alone, 0.02), "bump": (bent("Bump"), 0.03),
    "normal map": (bent("NormalMap"), 0.03),
    "subsurface": (one("SubsurfaceScattering", Scale=0.002), 0.05),
}  # fmt: skip
STRANDS = {
    "hair": (one("BsdfHair"), 0.3), "principled hair": (one("BsdfHairPrincipled"), 0.1),
    "striped": (striped, 0.05),
}  # fmt: skip
FOGS = {
    "absorbs": (one("VolumeAbsorption", Color=(0.2, 0.6, 0.9, 1.0), Density=3.0), 0.05),
    "scatters": (one("VolumeScatter", Color=(0.9, 0.5, 0.3, 1.0), Density=4.0), 0.05),
    "smoke": (one("VolumePrincipled", Color=(0.5, 0.6, 0.7, 1.0), Density=3.0), 0.05),
    "coefficients": (one("VolumeCoefficients", Absorption_Coefficients=(1.0, 0.5, 0.2),
                         Scatter_Coefficients=(1.0, 2.0, 3.0)), 0.05),
}  # fmt: skip


class Board:
    """Tiles of a metre, in rows from above; each has an object with a material of its own."""

    def __init__(self, rows: int):
        self.rows = rows
        self.names: dict[str, float] = {}  # how far means may be off
        bpy.ops.mesh.primitive_plane_add(size=1.8)
        self.flat = bpy.context.object.data
        random = np.random.default_rng(4)
        number = self.flat.attributes.new("number", "FLOAT", "POINT")
        number.data.foreach_set("value", random.random(4).astype(np.float32))
        paint = self.flat.attributes.new("paint", "FLOAT_COLOR", "CORNER")
        paint.data.foreach_set("color", random.random(16).astype(np.float32))
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.9, segments=48, ring_count=24)
        self.round = bpy.context.object.data
        for polygon in self.round.polygons:
            polygon.use_smooth = True
        for mesh in (self.flat, self.round):
            mesh.materials.append(None)
        for pattern in ("Plane", "Sphere"):
            bpy.data.objects.remove(bpy.data.objects[pattern])

    def corner(self) -> tuple[float, float]:
        """Where the next tile is."""
        number = len(self.names)
        return number % COLUMNS + 0.5, self.rows - number // COLUMNS - 0.5

    def put(self, name: str, data: Any, paint: Any, off: float) -> None:
        """Put an object of a size of 2 into the next tile."""
        put = bpy.data.objects.new(name, data)
        put.location, put.scale = (*self.corner(), 0.0), (0.45,) * 3
        bpy.context.scene.collection.objects.link(put)
        put.material_slots[0].link, put.material_slots[0].material = "OBJECT", paint
        self.names[name] = off

    def of_shader(self, build: Build, socket: str = "Surface") -> Any:
        """Return a material of a shader."""
        paint = bpy.data.materials.new("m")
        paint.use_nodes = True
        tree = paint.node_tree
        tree.nodes.clear()
        end = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(build(tree).outputs[0], end.inputs[socket])
        return paint

    def strands(self) -> Any:
        """Return a fan of thick hair."""
        hair, turns = bpy.data.hair_curves.new("hair"), np.linspace(0.0, 2.0 * np.pi, 24, False)
        hair.add_curves([4] * len(turns))
        along = np.linspace(0.1, 1.0, 4)[None, :, None]
        ways = np.stack([np.cos(turns), np.sin(turns), 0.3 * np.cos(3.0 * turns)], axis=-1)
        points = (along * ways[:, None]).astype(np.float32)
        hair.points.foreach_set("position", points.ravel())
        radius = hair.attributes.get("radius") or hair.attributes.new("radius", "FLOAT", "POINT")
        radius.data.foreach_set("value", np.full(4 * len(turns), 0.08, np.float32))
        hair.materials.append(None)
        return hair

    def lamp(self) -> None:
        """Put a lamp of an IES file into a box without a lid."""
        x, y = self.corner()
        bpy.ops.mesh.primitive_cube_add(size=2.0)
        box = bpy.context.object.data
        top = max(box.polygons, key=lambda polygon: polygon.center.z)
        kept = [list(p.vertices) for p in box.polygons if p.index != top.index]
        cup = bpy.data.meshes.new("cup")
        cup.from_pydata([v.co[:] for v in box.vertices], [], kept)
        cup.shade_flat()
        cup.materials.append(None)
        bpy.data.objects.remove(bpy.context.object)
        lamp = bpy.data.lights.new("lamp", "POINT")
        lamp.energy, lamp.shadow_soft_size, lamp.use_nodes = 0.5, 0.0, True
        tree = lamp.node_tree
        node, glow = tree.nodes.new("ShaderNodeTexIES"), tree.nodes["Emission"]
        node.ies = bpy.data.texts.new("lamp.ies")
        node.ies.write(table())
        tree.links.new(node.outputs[0], glow.inputs["Strength"])
        put = bpy.data.objects.new("lamp", lamp)
        put.location = (x, y, 0.2)
        bpy.context.scene.collection.objects.link(put)
        self.put("lamp of a file", cup, self.of_shader(one("BsdfDiffuse")), 0.05)


def sky() -> Any:
    """Return a smooth image of all directions, whose poles and sides are alike: Cycles wraps it."""
    image = bpy.data.images.new("sky", 128, 64, float_buffer=True)
    x, y = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 128, False), np.linspace(0.0, np.pi, 64))
    parts = [0.5 + 0.4 * np.cos(x) * np.sin(y), 0.3 + 0.4 * np.sin(y), 0.6 + 0.3 * np.sin(y) ** 2]
    pixels = np.stack([*parts, np.ones_like(x)], axis=-1)
    image.pixels = pixels.astype(np.float32).ravel()
    return image


def lit(rows: int) -> None:
    """See all tiles from above, in a world of an image and the light of a lamp."""
    scene = bpy.context.scene
    camera = scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", float(max(COLUMNS, rows))
    camera.location, camera.rotation_euler = (0.5 * COLUMNS, 0.5 * rows, 6.0), (0.0, 0.0, 0.0)
    world = bpy.data.worlds.new("world")
    scene.world, world.use_nodes = world, True
    tree = world.node_tree
    dome = tree.nodes.new("ShaderNodeTexEnvironment")
    dome.image = sky()
    tree.links.new(dome.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    lamp = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "AREA"))
    lamp.data.energy, lamp.data.size = 3000.0, 4.0
    lamp.location, lamp.rotation_euler = (-4.0, 0.5 * rows, 12.0), (0.0, -0.64, 0.0)
    scene.collection.objects.link(lamp)
    scene.cycles_curves.shape = "THICK"
    scene.cycles.sample_clamp_indirect = scene.cycles.blur_glossy = 0.0
    scene.cycles.light_sampling_threshold = 0.0
    scene.cycles.transmission_bounces = scene.cycles.transparent_max_bounces = 16


def labels() -> set[str]:
    """Return the nodes of all trees."""
    holders = (bpy.data.materials, bpy.data.worlds, bpy.data.lights)
    trees = [data.node_tree for kind in holders for data in kind if data.node_tree is not None]
    return {node.bl_label for tree in [*trees, *bpy.data.node_groups] for node in tree.nodes}


def test_a_scene_with_every_node(tmp_path: Path) -> None:
    """Means of the middle of each tile; how far they may be off is that of the node alone."""
    flat = colors()
    rows = -(-(len(flat) + len(BALLS) + len(STRANDS) + len(FOGS) + 1) // COLUMNS)
    board = Board(rows)
    for name, (build, off) in flat.items():
        board.put(name, board.flat, material(build), off)
    for name, (build, off) in BALLS.items():
        board.put(name, board.round, board.of_shader(build), off)
    for name, (build, off) in STRANDS.items():
        board.put(name, board.strands(), board.of_shader(build), off)
    for name, (build, off) in FOGS.items():
        board.put(name, board.round, board.of_shader(build, "Volume"), off)
    board.lamp()
    lit(rows)
    read = {name for name, text in documented().items() if text != LOST and "Output" not in name}
    assert read & set(kinds()) - ALONE <= labels()
    both = pictures(tmp_path, 128, 12, (COLUMNS * SIDE, rows * SIDE))
    wrong = {}
    for number, (name, off) in enumerate(board.names.items()):
        y, x = (SIDE * n + SIDE // 4 for n in divmod(number, COLUMNS))
        middles = (shown[y : y + SIDE // 2, x : x + SIDE // 2] for shown in both)
        ours, cycles = (middle.mean(axis=(0, 1)) for middle in middles)
        ratio = np.abs(ours - cycles).max() / cycles.max()
        if not ratio < off:
            wrong[name] = (ratio, ours, cycles)
    assert not wrong
