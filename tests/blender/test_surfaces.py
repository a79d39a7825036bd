"""Coordinates, images, groups of nodes, volumes, hair and what deforms: pictures beside Cycles."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt import images

bpy: Any = pytest.importorskip("bpy")
blender: Any = pytest.importorskip("blender")

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("registered")]
SIZE = 40


@pytest.fixture(autouse=True)
def stage(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A camera that looks at the origin from (2.5, -3, 2.2), and a grey world."""
    monkeypatch.setenv("CLPT_PYTHON", sys.executable)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (2.5, -3.0, 2.2), (1.06, 0.0, 0.694)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.view_settings.view_transform = "Standard"
    return scene


def pictures(
    folder: Path, samples: int = 64, bounces: int = 4, size: tuple[int, int] = (SIZE, SIZE)
) -> list[np.ndarray]:
    """Return clpt's picture and Cycles' (h, w, 3); size: width and height."""
    scene, found = bpy.context.scene, []
    render, cycles = scene.render, scene.cycles
    render.resolution_x, render.resolution_y = size
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    for engine in ("CLPT", "CYCLES"):
        render.engine = engine
        cycles.samples, cycles.device, cycles.use_denoising = samples, "CPU", False
        cycles.max_bounces = cycles.volume_bounces = cycles.diffuse_bounces = bounces
        scene.clpt.samples, scene.clpt.mode, scene.clpt.bounces = samples, "rgb", bounces
        render.filepath = str(folder / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        found.append(np.asarray(images.read(render.filepath))[..., :3])
    return found


def assert_alike(shown: list[np.ndarray], mean: float = 0.02, off: float = 0.03) -> None:
    """Compare means, and pixels but for those at edges, whose filters differ."""
    ours, cycles = shown
    assert cycles.std() > 0.01
    assert ours.mean(axis=(0, 1)) == pytest.approx(cycles.mean(axis=(0, 1)), rel=mean, abs=2e-3)
    assert np.median(np.abs(ours - cycles)) < off * max(cycles.mean(), 0.1)


def material(build: Callable[[Any], Any], name: str = "m", *, glow: bool = True) -> Any:
    """Return a material whose color `build` makes; it glows, or is matte."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeEmission" if glow else "ShaderNodeBsdfDiffuse")
    tree.links.new(shader.outputs[0], end.inputs["Surface"])
    tree.links.new(build(tree), shader.inputs[0])
    return made


def output(kind: str, name: str, **settings: Any) -> Callable[[Any], Any]:
    """Return a builder of a node's output, made half as strong and moved to what shows."""

    def build(tree: Any) -> Any:
        node = tree.nodes.new(f"ShaderNode{kind}")
        for key, value in settings.items():
            setattr(node, key, value)
        moved = tree.nodes.new("ShaderNodeVectorMath")
        moved.operation = "MULTIPLY_ADD"
        moved.inputs[1].default_value, moved.inputs[2].default_value = (0.3,) * 3, (0.5,) * 3
        tree.links.new(next(s for s in node.outputs if s.name == name), moved.inputs[0])
        return moved.outputs[0]

    return build


COORDINATES: dict[str, Callable[[Any], Any]] = {
    **{name: output("TexCoord", name) for name in ("Generated", "Object", "UV", "Normal")},
    "world normal": output("NewGeometry", "Normal"),
    "position": output("NewGeometry", "Position"),
    "second uv": output("UVMap", "UV", uv_map="second"),
    "color": output("VertexColor", "Color", layer_name="paint"),
    "face": output("Attribute", "Color", attribute_name="number"),
    "location": output("ObjectInfo", "Location"),
    "random": output("ObjectInfo", "Random"),
}


@pytest.mark.parametrize("name", COORDINATES)
def test_coordinates(name: str, tmp_path: Path) -> None:
    """Two turned boxes that share a mesh with two UV maps, painted corners and numbered faces."""
    bpy.ops.mesh.primitive_cube_add(size=1.6, location=(0.2, 0.1, 0.0), rotation=(0.3, 0.2, 0.5))
    box = bpy.context.object
    mesh, random = box.data, np.random.default_rng(4)
    second = mesh.uv_layers.new(name="second")
    second.uv.foreach_set("vector", random.random(2 * len(mesh.loops)).astype(np.float32))
    paint = mesh.attributes.new("paint", "FLOAT_COLOR", "CORNER")
    paint.data.foreach_set("color", random.random(4 * len(mesh.loops)).astype(np.float32))
    number = mesh.attributes.new("number", "FLOAT", "FACE")
    number.data.foreach_set("value", np.linspace(0.0, 1.0, 6).astype(np.float32))
    mesh.materials.append(material(COORDINATES[name]))
    other = bpy.data.objects.new("other", mesh)
    other.location, other.scale = (-1.3, 0.6, 0.4), (0.5, 0.7, 0.5)
    bpy.context.scene.collection.objects.link(other)
    assert_alike(pictures(tmp_path, 32))


def test_groups_and_muted_nodes(tmp_path: Path) -> None:
    """A color from within two groups, past a muted node, with a value that the group asks for."""
    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    inner.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    inner.interface.new_socket("Shade", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = (inner.nodes.new(f"NodeGroup{side}") for side in ("Input", "Output"))
    scale = inner.nodes.new("ShaderNodeVectorMath")
    scale.operation = "SCALE"
    where = inner.nodes.new("ShaderNodeTexCoord")
    inner.links.new(where.outputs["Generated"], scale.inputs[0])
    inner.links.new(start.outputs["Amount"], scale.inputs["Scale"])
    inner.links.new(scale.outputs[0], end.inputs["Shade"])
    outer = bpy.data.node_groups.new("outer", "ShaderNodeTree")
    outer.interface.new_socket("Shade", in_out="OUTPUT", socket_type="NodeSocketColor")
    held, last = outer.nodes.new("ShaderNodeGroup"), outer.nodes.new("NodeGroupOutput")
    held.node_tree = inner
    held.inputs["Amount"].default_value = 0.6
    outer.links.new(held.outputs[0], last.inputs[0])

    def build(tree: Any) -> Any:
        group, gamma = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeGamma")
        group.node_tree = outer
        gamma.inputs[1].default_value, gamma.mute = 3.0, True
        tree.links.new(group.outputs[0], gamma.inputs[0])
        return gamma.outputs[0]

    bpy.ops.mesh.primitive_cube_add(size=1.8)
    bpy.context.object.data.materials.append(material(build))
    assert_alike(pictures(tmp_path, 32))


def painted(width: int = 64) -> Any:
    """Return a smooth float image of some colors."""
    image = bpy.data.images.new("painted", width, width, float_buffer=True)
    x, y = np.meshgrid(np.linspace(0.0, 1.0, width), np.linspace(0.0, 1.0, width))
    pixels = np.stack([x, y, 0.5 + 0.5 * np.sin(6.0 * x), np.ones_like(x)], axis=-1)
    image.pixels = pixels.astype(np.float32).ravel()
    return image


@pytest.mark.parametrize(
    "how", ["plain", "placed", "bent", "packed", "file", "encoded", "missing", "none"]
)
def test_images(how: str, tmp_path: Path) -> None:
    """Images in memory and in files, at coordinates that nodes compute, and those that are lost.

    Blender 5 writes an .exr as sRGB, and says so in it: Blender then has it in linear values.
    """
    image = painted()
    if how in ("packed", "file", "encoded", "missing"):
        image.filepath_raw, image.file_format = str(tmp_path / "painted.exr"), "OPEN_EXR"
        image.save()
        bpy.data.images.remove(image)
        image = bpy.data.images.load(str(tmp_path / "painted.exr"))
        if how != "encoded":
            image.colorspace_settings.name = "Linear Rec.709"
        if how == "packed":
            image.pack()
        if how not in ("file", "encoded"):
            (tmp_path / "painted.exr").unlink()
        image.name = "renamed"
        if how == "missing":
            image.reload()

    def build(tree: Any) -> Any:
        node, where = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexCoord")
        node.image = image if how != "none" else None
        if how == "placed":
            mapping = tree.nodes.new("ShaderNodeMapping")
            mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.4)
            mapping.inputs["Scale"].default_value = (0.5, 0.7, 1.0)
            tree.links.new(where.outputs["UV"], mapping.inputs[0])
            tree.links.new(mapping.outputs[0], node.inputs[0])
        elif how == "bent":
            bend = tree.nodes.new("ShaderNodeTexNoise")
            bend.inputs["Scale"].default_value = 2.0
            tree.links.new(where.outputs["Object"], bend.inputs[0])
            tree.links.new(bend.outputs["Color"], node.inputs[0])
        return node.outputs["Color"]

    bpy.ops.mesh.primitive_cube_add(size=1.8)
    bpy.context.object.data.materials.append(material(build))
    assert_alike(pictures(tmp_path, 32))


@pytest.mark.parametrize("kind", ["scatter", "absorb", "principled", "both", "emit"])
def test_volumes_of_meshes(kind: str, tmp_path: Path) -> None:
    """A ball of fog before a bright world; means within 3 %."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.8, 0.8, 0.9, 1.0)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.1, segments=32, ring_count=16)
    fog = bpy.data.materials.new("fog")
    fog.use_nodes = True
    tree = fog.node_tree
    tree.nodes.clear()
    end = tree.nodes.new("ShaderNodeOutputMaterial")

    def node(name: str, **inputs: Any) -> Any:
        made = tree.nodes.new(f"ShaderNode{name}")
        for key, value in inputs.items():
            made.inputs[key.replace("_", " ")].default_value = value
        return made

    made = {
        "scatter": lambda: node("VolumeScatter", Color=(0.9, 0.5, 0.3, 1.0), Density=1.5,
                                Anisotropy=0.4),
        "absorb": lambda: node("VolumeAbsorption", Color=(0.2, 0.6, 0.9, 1.0), Density=1.2),
        "principled": lambda: node("VolumePrincipled", Color=(0.5, 0.6, 0.7, 1.0), Density=1.0,
                                   Absorption_Color=(0.2, 0.1, 0.3, 1.0)),
        "both": lambda: node("AddShader"),
        "emit": lambda: node("VolumePrincipled", Density=0.5, Emission_Strength=0.4,
                             Emission_Color=(1.0, 0.5, 0.1, 1.0)),
    }[kind]()  # fmt: skip
    if kind == "both":
        for i, part in enumerate(("VolumeScatter", "VolumeAbsorption")):
            tree.links.new(node(part, Density=0.7 + i).outputs[0], made.inputs[i])
    tree.links.new(made.outputs[0], end.inputs["Volume"])
    bpy.context.object.data.materials.append(fog)
    assert_alike(pictures(tmp_path, 256, 16), mean=0.03, off=0.06)


def test_particle_hair(tmp_path: Path) -> None:
    """Combed hair of a ball: the share of the picture that is dark, to 10 %."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.7, segments=16, ring_count=8)
    ball = bpy.context.object
    black = bpy.data.materials.new("black")
    black.use_nodes = True
    black.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0, 0, 0, 1)
    ball.data.materials.append(black)
    ball.modifiers.new("hair", "PARTICLE_SYSTEM")
    settings = ball.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 60, 1.0
    settings.root_radius, settings.tip_radius, settings.radius_scale = 1.0, 0.4, 0.15
    bpy.context.scene.cycles_curves.shape = "THICK"
    ours, cycles = pictures(tmp_path, 64)
    dark = [(shown.mean(axis=2) < 0.5 * shown.max()).mean() for shown in (ours, cycles)]
    bare = np.pi * 0.7**2 * 0.03  # more than the ball alone
    assert dark[1] > bare and dark[0] == pytest.approx(dark[1], rel=0.1)


def test_an_armature_blurs_its_mesh(tmp_path: Path) -> None:
    """An arm that a bone swings while the shutter is open: its picture, by rows and columns."""
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.0))
    arm = bpy.context.object
    arm.scale = (0.25, 0.25, 1.6)
    bpy.ops.object.transform_apply(scale=True)
    arm.data.materials.append(material(output("TexCoord", "Generated")))
    bpy.ops.object.armature_add(location=(0.0, 0.0, -0.8))
    bones = bpy.context.object
    group = arm.vertex_groups.new(name="Bone")
    group.add(list(range(len(arm.data.vertices))), 1.0, "REPLACE")
    arm.modifiers.new("armature", "ARMATURE").object = bones
    bone = bones.pose.bones["Bone"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((0, -0.7), (2, 0.7)):
        bone.rotation_euler = (angle, 0.0, 0.0)
        bone.keyframe_insert("rotation_euler", frame=frame)
    scene = bpy.context.scene
    scene.frame_set(1)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    arm.cycles.motion_steps = 1
    ours, cycles = pictures(tmp_path, 128)
    for axis in (0, 1):
        rows = [shown[..., 0].sum(axis=axis) for shown in (ours, cycles)]
        assert np.abs(rows[0] - rows[1]).max() < 0.1 * rows[1].max()
    still = ours.max() * 0.99
    assert (ours[..., 0] > still).mean() < 0.2


def test_a_scene_of_nothing_and_what_was_deleted(tmp_path: Path) -> None:
    """No object but a camera; an object whose material is gone; an object that is gone."""
    scene = bpy.context.scene
    assert pictures(tmp_path, 4)[0].max() == 0.0
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.data.materials.append(bpy.data.materials.new("gone"))
    bpy.data.materials.remove(box.data.materials[0])
    scene.render.engine, scene.clpt.samples = "CLPT", 4
    bpy.ops.render.render()
    bpy.data.objects.remove(box)
    assert pictures(tmp_path, 4)[0].max() == 0.0


@pytest.mark.parametrize("how", ["gradient", "image", "mixed", "light path"])
def test_surroundings_that_nodes_compute(how: str, tmp_path: Path) -> None:
    """A wide view of the world, and a matte ball in it."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    tree = world.node_tree
    first = tree.nodes["Background"]
    where = tree.nodes.new("ShaderNodeTexCoord")
    if how in ("gradient", "mixed"):
        noise = tree.nodes.new("ShaderNodeTexNoise")
        noise.inputs["Scale"].default_value = 2.0
        tree.links.new(where.outputs["Generated"], noise.inputs["Vector"])
        tree.links.new(noise.outputs["Color"], first.inputs["Color"])
    if how == "image":
        image, hue = (
            tree.nodes.new("ShaderNodeTexEnvironment"),
            tree.nodes.new("ShaderNodeHueSaturation"),
        )
        image.image = painted()
        hue.inputs["Hue"].default_value, hue.inputs["Saturation"].default_value = 0.6, 1.4
        tree.links.new(image.outputs["Color"], hue.inputs["Color"])
        tree.links.new(hue.outputs["Color"], first.inputs["Color"])
    if how in ("mixed", "light path"):
        second, mix = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeMixShader")
        second.inputs["Color"].default_value = (0.9, 0.4, 0.2, 1.0)
        tree.links.new(first.outputs[0], mix.inputs[1])
        tree.links.new(second.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], tree.nodes["World Output"].inputs["Surface"])
        mix.inputs[0].default_value = 0.3
        if how == "light path":
            path = tree.nodes.new("ShaderNodeLightPath")
            tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    bpy.context.scene.camera.data.angle = 1.8
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.3)
    ours, cycles = pictures(tmp_path, 64)
    if how == "light path":  # what the camera alone sees is not there, and told
        ours, cycles = (shown[18:22, 18:22] for shown in (ours, cycles))
        assert ours.mean() == pytest.approx(cycles.mean(), rel=0.02)
    else:
        assert_alike([ours, cycles])


@pytest.mark.parametrize(
    "kind", ["SINGLE_SCATTERING", "MULTIPLE_SCATTERING", "NISHITA", "HOSEK_WILKIE"]
)
def test_sky_textures_light_a_floor(kind: str, tmp_path: Path) -> None:
    """Another model: the light on a floor within 20 %, and the sun where Cycles has it."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    if kind not in sky.bl_rna.properties["sky_type"].enum_items:
        pytest.skip("of another version of Blender")
    sky.sky_type, sky.sun_elevation, sky.sun_rotation = kind, 0.5, 2.0
    sky.sun_direction = (0.8, -0.36, 0.48)
    world.node_tree.links.new(sky.outputs[0], world.node_tree.nodes["Background"].inputs["Color"])
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    ours, cycles = pictures(tmp_path, 128)
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.2)
    if kind != "HOSEK_WILKIE":  # it has no disc: the shadow of the box
        dark = [
            shown.mean(axis=2) < 0.5 * np.median(shown.mean(axis=2)) for shown in (ours, cycles)
        ]
        assert (dark[0] & dark[1]).sum() > 0.7 * (dark[0] | dark[1]).sum() > 0.0


@pytest.mark.parametrize("how", ["file", "modifier"])
def test_a_grid_of_openvdb(how: str, tmp_path: Path) -> None:
    """A turned cloud of a file, or in memory; means within 5 %."""
    bpy.ops.mesh.primitive_torus_add(major_radius=0.8, minor_radius=0.35)
    ring, scene = bpy.context.object, bpy.context.scene
    ring.hide_render = True
    cloud = bpy.data.objects.new("cloud", bpy.data.volumes.new("cloud"))
    scene.collection.objects.link(cloud)
    fill = cloud.modifiers.new("fill", "MESH_TO_VOLUME")
    fill.object, fill.voxel_amount = ring, 32
    if how == "file":
        made = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get())
        made.data.grids.save(filepath=str(tmp_path / "cloud.vdb"))
        bpy.data.objects.remove(cloud)
        bpy.ops.object.volume_import(filepath=str(tmp_path / "cloud.vdb"))
        cloud = bpy.context.object
    cloud.rotation_euler = (0.3, 0.2, 0.4)
    smoke = bpy.data.materials.new("smoke")
    smoke.use_nodes = True
    tree = smoke.node_tree
    tree.nodes.clear()
    end, fog = (tree.nodes.new(f"ShaderNode{k}") for k in ("OutputMaterial", "VolumePrincipled"))
    fog.inputs["Density"].default_value = 2.0
    tree.links.new(fog.outputs[0], end.inputs["Volume"])
    cloud.data.materials.append(smoke)
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.8, 0.8, 0.9, 1.0)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))
    lamp.data.energy, lamp.rotation_euler = 5.0, (0.5, 0.3, 0.0)
    bpy.context.scene.collection.objects.link(lamp)
    assert_alike(pictures(tmp_path, 256, 32), mean=0.05, off=0.08)


def test_a_linked_library(tmp_path: Path) -> None:
    """A box with a painted image of another file, beside a box of the same names."""
    image = painted()
    image.filepath_raw, image.file_format = str(tmp_path / "painted.exr"), "OPEN_EXR"
    image.save()
    bpy.data.images.remove(image)
    image = bpy.data.images.load(str(tmp_path / "painted.exr"))
    image.colorspace_settings.name = "Linear Rec.709"

    def build(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        return node.outputs["Color"]

    bpy.ops.mesh.primitive_cube_add(size=1.2)
    box = bpy.context.object
    box.data.materials.append(material(build, "paint"))
    image.filepath = "//painted.exr"
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {box}, path_remap="RELATIVE_ALL")
    box.location = (-1.4, 0.5, 0.0)
    box.data.materials.clear()
    box.data.materials.append(material(output("NewGeometry", "Position"), "paint"))
    with bpy.data.libraries.load(str(library), link=True) as (there, here):
        here.objects = there.objects
    bpy.context.scene.collection.objects.link(here.objects[0])
    assert_alike(pictures(tmp_path, 32))
