# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of Blender as .ply, by material, and hair as text: strands of Bezier pieces."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

FACE = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])


Wanted = dict[int, tuple[str, str]]  # attributes by their numbers: what they are, and of what
SHARES = {"value": 1, "vector": 3, "color": 4}  # members of attributes, with their channels


@dataclass(frozen=True)
class Rows:
    """Where the rows of a written file come from: their vertices and corners; smooth: normals."""

    vertices: np.ndarray
    corners: np.ndarray
    smooth: bool


def write(
    mesh: bpy.types.Mesh, folder: Path, name: str, wanted: Wanted | None = None,
    matrix: Any = None, origins: dict[str, Rows] | None = None,
) -> dict[int, str]:  # fmt: skip
    """Write a mesh; return the file of each of its material slots that has triangles.

    folder: where the files are; name: how their names begin; wanted: what materials read; matrix:
    to the world, for normals; origins: takes the origins of the rows of the files.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return {}
    rows, corners, (vertices, last) = _rows(mesh, wanted or {}, matrix)
    faces = corners[_triangles(mesh)]
    slots = np.zeros(1, np.int32)
    if mesh.attributes.get("material_index") is not None:
        slots = np.empty(count, np.int32)
        mesh.loop_triangles.foreach_get("material_index", slots)
    files = {}
    for slot in np.unique(slots).tolist():
        file = f"{name}_{slot}.ply"
        shown = faces[slots == slot] if len(slots) > 1 else faces
        used = np.zeros(len(rows), bool)
        used[shown] = True
        _write(folder / file, rows[used], (np.cumsum(used) - 1)[shown])
        files[slot] = file
        if origins is not None:
            origins[file] = Rows(vertices[used], last[used], "nx" in rows.dtype.names)
    return files


def _triangles(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return the corners of all triangles (n, 3), in Blender's memory; `foreach_get` is slow."""
    memory = (ctypes.c_int32 * (3 * len(mesh.loop_triangles))).from_address(
        mesh.loop_triangles[0].as_pointer()
    )
    return np.frombuffer(memory, np.int32).reshape(-1, 3)


def _values(attribute: bpy.types.Attribute, name: str, width: int, kind: type) -> np.ndarray:
    """Return an attribute (n, width) at once; properties of vertices would be read one by one."""
    values = np.empty((len(attribute.data), width), kind)
    attribute.data.foreach_get(name, values.ravel())
    return values


def positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return where the vertices are (n, 3)."""
    return _values(mesh.attributes["position"], "vector", 3, np.float32)


def normals(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return the normals of all corners (n, 3)."""
    found = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", found.ravel())
    return found


def _attribute(mesh: bpy.types.Mesh, kind: str, name: str, matrix: Any) -> np.ndarray:
    """Return three numbers of each corner (n, 3); zeros for what the mesh does not have."""
    corners = _values(mesh.attributes[".corner_vert"], "value", 1, np.int32)[:, 0]
    if kind == "generated":
        co = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("undeformed_co", co.ravel())
        size = np.maximum(np.abs(mesh.texspace_size), 1e-9)
        return ((co - np.array(mesh.texspace_location)) * (0.5 / size) + 0.5)[corners]
    if kind == "object":
        return positions(mesh)[corners]
    if kind in ("normal", "world normal"):
        turned = normals(mesh)
        if kind == "world normal" and matrix is not None:
            turned = turned @ np.array(matrix.to_3x3().inverted_safe())
            turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-9)
        return turned
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.domain == "EDGE" or not len(attribute.data):
        return np.zeros((len(corners), 3), np.float32)
    member = next(m for m in SHARES if m in attribute.data[0].bl_rna.properties)
    width = 2 if attribute.data_type == "FLOAT2" else SHARES[member]
    numbers = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}
    values = _values(attribute, member, width, numbers.get(attribute.data_type, np.float32))
    values = np.repeat(values, 3, axis=1) if width == 1 else np.pad(values, ((0, 0), (0, 1)))
    if attribute.domain == "FACE":
        lengths = np.diff(_starts(mesh))
        return np.repeat(values, lengths, axis=0)[:, :3]
    return (values[corners] if attribute.domain == "POINT" else values)[:, :3]


def _starts(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return the first corner of each polygon, and behind them the number of corners."""
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return np.append(starts, len(mesh.loops))


def _layer(mesh: bpy.types.Mesh) -> Any:
    """Return the UV map that renders."""
    active = mesh.uv_layers.active
    return next((layer for layer in mesh.uv_layers if layer.active_render), active)


def _rows(
    mesh: bpy.types.Mesh, wanted: Wanted, matrix: Any
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return rows of positions, normals and more, the row of each corner, and their origins.

    The corners of a vertex share a row where they are equal; flat meshes have no normals. Origins
    are a vertex and a corner of each row.
    """
    vertices = positions(mesh)
    corners = _values(mesh.attributes[".corner_vert"], "value", 1, np.int32)[:, 0]
    layer, domain = _layer(mesh), mesh.normals_domain
    parts = {}
    if domain == "CORNER":
        parts["nx", "ny", "nz"] = normals(mesh)
    if layer is not None:
        parts["s", "t"] = _values(mesh.attributes[layer.name], "vector", 2, np.float32)
    for number, (kind, name) in wanted.items():
        name = layer.name if kind == "uv" and not name and layer is not None else name
        names = tuple(f"b{number}_{axis}" for axis in range(3))
        parts[names] = _attribute(mesh, kind, name, matrix)
    last = np.zeros(len(vertices), np.int32)  # a corner of each vertex
    last[corners] = np.arange(len(corners), dtype=np.int32)
    origin = np.arange(len(vertices), dtype=np.int32)
    if parts:
        other = np.zeros(len(corners), bool)
        for values in parts.values():
            other |= (values != values[last[corners]]).any(axis=1)
        origin = np.concatenate([origin, corners[other]])
        last = np.concatenate([last, np.flatnonzero(other).astype(np.int32)])
        corners[other] = np.arange(len(vertices), len(origin), dtype=np.int32)
    parts = {names: values[last] for names, values in parts.items()}
    if domain == "POINT":
        smooth = np.empty((len(vertices), 3), np.float32)
        mesh.vertex_normals.foreach_get("vector", smooth.ravel())
        parts = {("nx", "ny", "nz"): smooth[origin], **parts}
    parts = {("x", "y", "z"): vertices[origin], **parts}
    rows = np.empty(len(origin), [(name, "<f4") for names in parts for name in names])
    for names, values in parts.items():
        for axis, name in enumerate(names):
            rows[name] = values[:, axis]
    return rows, corners, (origin, last)


def _write(file: Path, rows: np.ndarray, faces: np.ndarray) -> None:
    table = np.empty(len(faces), FACE)
    table["count"] = 3
    table["corners"] = faces
    properties = "".join(f"property float {name}\n" for name in rows.dtype.names)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    with file.open("wb") as stream:
        stream.write(header.encode("ascii"))
        stream.write(rows.tobytes())
        stream.write(table.tobytes())


def strands(curves: bpy.types.Curves) -> tuple[np.ndarray, list[int]]:
    """Return the points and radii of hair (n, 4), and how many points each strand has."""
    lengths = np.empty(len(curves.curves), np.int32)
    curves.curves.foreach_get("points_length", lengths)
    places = np.empty((len(curves.points), 3), np.float32)
    curves.points.foreach_get("position", places.ravel())
    radii = np.full(len(curves.points), 0.005, np.float32)
    radius = curves.attributes.get("radius")
    if radius is not None:
        radius.data.foreach_get("value", radii)
    return np.column_stack([places, radii]), lengths.tolist()


def particle_strands(source: bpy.types.Object, system: Any) -> tuple[np.ndarray, list[int]]:
    """Return the same of a particle system of hair, in the world. Cycles' shapes of radii."""
    settings = system.settings
    steps = 2**settings.render_step + 1
    parents, children = len(system.particles), len(system.child_particles)
    first = parents if children and settings.child_type == "INTERPOLATED" else 0
    share = np.linspace(0.0, 1.0, steps)
    bend = settings.shape
    share = share ** (1.0 + bend) if bend < 0.0 else share ** (1.0 / max(1.0 - bend, 1e-3))
    root, tip = settings.root_radius, settings.tip_radius
    radii = 0.5 * settings.radius_scale * (root + (tip - root) * share)
    found, lengths = [], []
    for number in range(first, parents + children):
        points = [system.co_hair(source, particle_no=number, step=s) for s in range(steps)]
        places = np.array([p for p in points if p.length_squared > 0.0])
        if len(places) > 1:
            found.append(np.column_stack([places, radii[: len(places)]]))
            lengths.append(len(places))
    return (np.concatenate(found) if found else np.empty((0, 4))), lengths


def count_of_strands(source: bpy.types.Object) -> int:
    """Return how many strands a hair of an object has; 0 where hairs or their strands differ."""
    if source.type == "CURVES":
        hairs = [strands(source.data)[1]]
    else:
        systems = (s for s in source.particle_systems if s.settings.type == "HAIR")
        hairs = [particle_strands(source, system)[1] for system in systems]
    counts = {len(lengths) if len(set(lengths)) == 1 else 0 for lengths in hairs}
    return counts.pop() if len(counts) == 1 else 0


def write_strands(rows: np.ndarray, lengths: list[int], file: Path) -> bool:
    """Write strands, whose points are joined by Catmull-Rom pieces; return whether there is any.

    A piece from p1 to p2 is the Bezier p1, p1 + (p2 - p0) / 6, p2 - (p3 - p1) / 6, p2; at the ends
    of a strand its first and last point count twice.
    """
    written, start = [], 0
    for length in lengths:
        points, start = rows[start : start + length], start + length
        if length < 2:
            continue
        around = np.vstack([points[:1], points, points[-1:]])
        step = (around[2:] - around[:-2]) / 6.0
        pieces = np.stack([points[:-1], points[:-1] + step[:-1], points[1:] - step[1:]], axis=1)
        written.append(np.vstack([pieces.reshape(-1, 4), points[-1:]]))
    with file.open("w") as stream:
        for strand in written:
            np.savetxt(stream, strand, "%.7g")
            stream.write("\n")
    return bool(written)
