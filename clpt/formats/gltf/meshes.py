"""Primitives: their triangles and the attributes of their vertices, as arrays."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats32, Matrix
from clpt.files import budget
from clpt.formats.gltf import geometry, materials
from clpt.formats.gltf.accessors import COMPONENTS, floats, integers, stored
from clpt.formats.gltf.document import Element
from clpt.formats.gltf.geometry import Geometry, target_types, types, warn_of_whole_numbers
from clpt.formats.gltf.nodes import Graph, compose
from clpt.formats.meshes.mesh import Arrays, checked
from clpt.formats.meshes.triangles import TANGENTS
from clpt.scene.lights import Area
from clpt.scene.materials import Material, NormalMap
from clpt.scene.media import Medium
from clpt.scene.shapes import Group, Instance, Mesh, Shape
from clpt.scene.textures import SECOND_UV

POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
NOT_DRAWN = {0: "points", 1: "lines", 2: "a line loop", 3: "a line strip"}


def primitive_geometry(primitive: Element) -> Geometry | None:
    """Return the triangles of a primitive, or None, and a note, if it has none.

    Raises SceneError where accessors contradict each other or name vertices that are not there.
    """
    mode = primitive.integer("mode", TRIANGLES, high=FAN)
    attributes = primitive.needed("attributes")
    if mode in NOT_DRAWN:
        primitive.warn(f"{NOT_DRAWN[mode]} left out: only triangles are rendered")
        return None
    if "POSITION" not in attributes:
        primitive.warn("left out, since it has no positions")
        return None
    compressed = primitive.extension(geometry.DRACO)
    if compressed is None:
        decoded = _plain(attributes)
    else:
        decoded = geometry.draco_attributes(primitive, compressed)
    vertices = len(decoded.attributes["POSITION"])
    for name, values in decoded.attributes.items():
        if len(values) != vertices:
            message = f"has {len(values)} elements, POSITION has {vertices}"
            raise attributes.error(message, name)
    if compressed is None:
        order = integers(primitive, "indices") if "indices" in primitive else np.arange(vertices)
        decoded.faces = triangles(order.astype(np.int64), mode)
    _check_indices(primitive, decoded.faces, vertices)
    decoded.targets = [_target(target, vertices) for target in primitive.children("targets")]
    return decoded


def triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Return the triangles (m, 3) that a list, strip or fan of vertices draws (glTF 3.7.2.1)."""
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    count = max(len(order) - 2, 0)
    i = np.arange(count)
    if mode == STRIP:
        odd = i % 2
        return order[np.stack([i, i + 1 + odd, i + 2 - odd], axis=1)]
    return order[np.stack([i + 1, i + 2, np.zeros_like(i)], axis=1)]


def _plain(attributes: Element) -> Geometry:
    arrays: dict[str, NDArray[Any]] = {}
    for name in filter(types, attributes.value):
        accessor = attributes.entry(name, "accessors")
        if accessor is None:
            continue
        warn_of_whole_numbers(name, accessor)
        if name.startswith("JOINTS_"):
            if COMPONENTS.get(accessor.integer("componentType"), np.dtype("f4")).kind != "u":
                raise accessor.error("joints must be unsigned integers", "componentType")
            arrays[name] = stored(accessor, types(name))
        else:
            arrays[name] = floats(accessor, types(name))
    return Geometry(np.zeros((0, 3), np.int64), arrays)


def _check_indices(primitive: Element, faces: NDArray[np.int64], vertices: int) -> None:
    if len(faces) and faces.max() >= vertices:
        bad = int(np.argmax((faces >= vertices).any(axis=1)))
        message = f"triangle {bad} names a vertex outside of 0 to {vertices - 1}"
        raise primitive.error(message, "indices")


def _target(target: Element, vertices: int) -> dict[str, Floats32]:
    displacements = {}
    for name in filter(types, target.value):
        accessor = target.entry(name, "accessors")
        if accessor is None:
            continue
        displacements[name] = floats(accessor, target_types(name))
        if len(displacements[name]) != vertices:
            raise target.error(f"has {len(displacements[name])} elements, not {vertices}", name)
    return displacements


PER_PART = 256  # moved vertices that count as a part
BYTES = 2048  # of a copy in memory, about
FLIPPED = np.array([1, -1], np.float32)
INSTANCING = "EXT_mesh_gpu_instancing"
INSTANCED = 20_000  # triangles that copies would add; fewer are traced faster as copies


@dataclass(frozen=True)
class Surface:
    """A material, what it emits, what it is the boundary of, and the sets of texture coordinates
    that it looks up."""

    material: Material
    emission: Area | None
    interior: Medium | None
    uv_sets: tuple[int, ...]


Copies = list[tuple[Element, Matrix]]  # each node that shows a mesh, with its transform


def shapes(graph: Graph, *, instances: bool = True) -> list[Shape]:
    """Return the shapes that the scene shows, a mesh's copies beside each other.

    With `instances`, many copies of many triangles are instances of a group. All other copies are
    meshes that share their arrays.
    """
    posed: dict[Any, tuple[list[Mesh], Copies]] = {}  # primitives of meshes in a pose
    for index in graph.shown:
        node = graph.node(index)
        mesh = node.entry("mesh", "meshes")
        if mesh is None:
            continue
        weights = _weights(graph, index, node, mesh)
        skin = node.entry("skin", "skins")
        key = (mesh.path, weights) if skin is None else index
        if key not in posed:
            joints = None if skin is None else geometry.joint_matrices(skin, graph.to_world)
            posed[key] = _parts(mesh, weights, joints), []
        node_to_world = np.eye(4) if skin is not None else graph.to_world[index]
        parts, copies = posed[key]
        matrices = _transforms(node, node_to_world)
        count = len(matrices) * max(len(parts), 1)
        budget.take_parts(count, "copies of its meshes", graph.document.file)
        budget.take(BYTES * count, "copies of its meshes", graph.document.file)
        copies += [(node, matrix) for matrix in matrices]
    return [shape for each in posed.values() for shape in _shapes(*each, instances)]


def _shapes(parts: list[Mesh], copies: Copies, instances: bool) -> list[Shape]:
    """Return the shapes that show all copies of a mesh."""
    triangles = sum(len(part.faces) for part in parts)
    if not instances or triangles * (len(copies) - 1) < INSTANCED:
        meshes = [_transformed(part, *copy) for copy in copies for part in parts]
        return [mesh for mesh in meshes if mesh is not None]
    group = Group(tuple(parts), parts[0].name)
    result: list[Shape] = []
    flat = transforms.are_singular(np.stack([to_world for _, to_world in copies]))
    for (node, to_world), is_flat in zip(copies, flat.tolist(), strict=True):
        if is_flat:
            meshes = [_transformed(part, node, to_world) for part in parts]
            result += [mesh for mesh in meshes if mesh is not None]
        else:
            result.append(Instance(group=group, to_world=to_world))
    return result


def _weights(graph: Graph, index: int, node: Element, mesh: Element) -> tuple[float, ...]:
    """Return the weights of a node's morph targets: animated, its own, or the mesh's."""
    animated = graph.pose.get((index, "weights"))
    if animated is not None:
        return tuple(map(float, animated))
    node_weights = node.numbers("weights", None, None)
    return node_weights if node_weights is not None else mesh.numbers("weights", None, ())


def _transforms(node: Element, to_world: Matrix) -> list[Matrix]:
    """Return a node's transform to the world, or those of its instances."""
    extension = node.extension(INSTANCING)
    if extension is None:
        return [to_world]
    attributes = extension.needed("attributes")
    rows = {
        "TRANSLATION": ("VEC3", [0.0, 0.0, 0.0]),
        "ROTATION": ("VEC4", [0.0, 0.0, 0.0, 1.0]),
        "SCALE": ("VEC3", [1.0, 1.0, 1.0]),
    }
    columns = {name: attributes.entry(name, "accessors") for name in rows}
    values = {n: floats(a, (rows[n][0],)) for n, a in columns.items() if a is not None}
    counts = {len(value) for value in values.values()}
    if len(counts) != 1:
        raise attributes.error("needs accessors of one length: TRANSLATION, ROTATION or SCALE")
    count = counts.pop()
    t, r, s = (np.asarray(values.get(n, [rows[n][1]] * count), np.float64) for n in rows)
    length = np.linalg.norm(r, axis=1, keepdims=True)
    if not length.all():
        raise attributes.error("a quaternion of length 0 is no rotation", "ROTATION")
    return list(to_world @ compose(t, r / length, s))


def _parts(
    mesh: Element, weights: tuple[float, ...], joints: NDArray[np.float64] | None
) -> list[Mesh]:
    """Return a mesh's primitives in the node's space, or in world space where it is skinned."""
    parts = []
    for primitive in mesh.children("primitives"):
        primitive_arrays = primitive_geometry(primitive)
        if primitive_arrays is None:
            continue
        _morph(primitive, primitive_arrays, weights)
        if joints is not None:
            geometry.skinned(primitive, primitive_arrays, joints)
        part = _mesh(mesh, primitive, primitive_arrays)
        parts += [] if part is None else [part]
    return parts


def _morph(primitive: Element, primitive_arrays: Geometry, weights: tuple[float, ...]) -> None:
    """Add the displacements of the targets, each times its weight."""
    for weight, target in zip(weights, primitive_arrays.targets, strict=False):
        for name, change in target.items():
            budget.take_parts(len(change) // PER_PART, "morph targets", primitive.document.file)
            if weight != 0.0 and name in primitive_arrays.attributes:
                base = primitive_arrays.attributes[name]
                width = min(base.shape[1], change.shape[1])
                moved = base.astype(np.float32)
                moved[:, :width] += np.float32(weight) * change[:, :width]
                primitive_arrays.attributes[name] = moved
    if len(weights) > len(primitive_arrays.targets):
        primitive.warn(
            f"{len(weights)} weights for {len(primitive_arrays.targets)} targets", "targets"
        )


def _mesh(owner: Element, primitive: Element, primitive_arrays: Geometry) -> Mesh | None:
    arrays = primitive_arrays.attributes
    colours = arrays.get("COLOR_0")
    surface = _surface(primitive, colours is not None)
    uvs, second = _uvs(primitive, primitive_arrays, surface)
    name = owner.text("name", "")
    mesh_arrays = Arrays(
        arrays["POSITION"],
        primitive_arrays.faces,
        arrays.get("NORMAL"),
        uvs,
        _attributes(colours, second, surface, len(arrays["POSITION"])) | _tangents(arrays, surface),
    )
    document = primitive.document
    values = checked(document.file, name or primitive.path, mesh_arrays, document.warnings)
    values["tangents"] = values["attributes"].pop(TANGENTS, None)
    if not len(values["faces"]):
        return None
    return Mesh(
        name=name,
        material=surface.material,
        emission=surface.emission,
        interior=surface.interior,
        **values,
    )


def _surface(primitive: Element, colours: bool) -> Surface:
    """Return the primitive's material, made once for all primitives that have it."""
    document = primitive.document
    element = materials.shown_material(primitive)

    def make() -> Surface:
        document.uv_sets.clear()
        material, emission = materials.material(element, colours=colours)
        inside = materials.medium(element) if material.transmits else None
        return Surface(material, emission, inside, tuple(document.uv_sets))

    return document.once(("surface", element.path if element else "", colours), make)


def _uvs(
    primitive: Element, primitive_arrays: Geometry, surface: Surface
) -> list[NDArray[np.float32] | None]:
    """Return the two uv sets that the material looks up, with v upward, as clpt has it."""
    sets = surface.uv_sets or (0,)
    if len(sets) > 2:
        message = (
            f"textures use more than two TEXCOORD sets; TEXCOORD_{sets[0]} replaces the others"
        )
        primitive.warn(message, "material")
    result: list[NDArray[np.float32] | None] = []
    for number in sets[:2]:
        uvs = primitive_arrays.attributes.get(f"TEXCOORD_{number}")
        if uvs is None and surface.uv_sets:
            primitive.warn(f"its textures need TEXCOORD_{number}, which is missing", "material")
        upward = None if uvs is None else uvs * FLIPPED + np.array([0, 1], np.float32)
        result.append(upward)
    return [*result, None][:2]


def _tangents(arrays: dict[str, NDArray[Any]], surface: Surface) -> dict[str, NDArray[Any]]:
    """Return the tangents that a file gives, where the material looks at them."""
    tangents = arrays.get("TANGENT")
    if tangents is None or "NORMAL" not in arrays or not _looks_at_tangents(surface.material):
        return {}
    return {TANGENTS: tangents.astype(np.float32)}


def _looks_at_tangents(material: object) -> bool:
    inner = [getattr(material, name, None) for name in ("material", "front")]
    return (
        isinstance(material, NormalMap)
        or getattr(material, "uses_tangents", False)
        or any(
            _looks_at_tangents(inner_material)
            for inner_material in inner
            if inner_material is not None
        )
    )


def _attributes(
    colours: NDArray[Any] | None, second: NDArray[np.float32] | None, surface: Surface, count: int
) -> dict[str, NDArray[np.float32]]:
    """Return the attributes that the material reads: colours, alpha, and a second uv set."""
    attributes = {} if colours is None else _colour_attributes(colours)
    if len(surface.uv_sets) > 1:
        uvs = np.zeros((count, 2), np.float32) if second is None else second
        attributes |= dict(zip(SECOND_UV, (uvs[:, :1], uvs[:, 1:]), strict=True))
    return attributes


def _colour_attributes(colours: NDArray[Any]) -> dict[str, NDArray[np.float32]]:
    """Return the colours of vertices, and their alpha, which is 1 by default."""
    rgba = np.ones((len(colours), 4), np.float32)
    rgba[:, : colours.shape[1]] = np.clip(colours, 0.0, 1.0)
    return {"vertex_color": rgba[:, :3], "vertex_alpha": rgba[:, 3:]}


def _transformed(part: Mesh, node: Element, to_world: Matrix) -> Mesh | None:
    if np.array_equal(to_world, np.eye(4)):
        return part
    if not transforms.is_singular(to_world):
        return part.placed(to_world)
    # A node may be flat, or scaled to zero to hide it.
    moved = transforms.transform_points(to_world, part.vertices).astype(np.float32)
    solid = transforms.edge_crosses(moved, part.faces).any(axis=1)
    if not solid.any():
        node.warn("not shown, since its transform leaves no area")
        return None
    return dataclasses.replace(
        part, vertices=moved, faces=part.faces[solid], normals=None, tangents=None
    )
