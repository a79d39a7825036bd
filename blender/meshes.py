# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of Blender as .ply, by material, and hair as text: strands of Bezier pieces."""

from __future__ import annotations

import ctypes
from pathlib import Path

import bpy
import numpy as np

FACE = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])


def write(mesh: bpy.types.Mesh, folder: Path, name: str) -> dict[int, str]:
    """Write a mesh; return the file of each of its material slots that has triangles.

    folder: where the files are; name: how their names begin.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return {}
    rows, corners = _rows(mesh)
    faces = corners[_triangles(mesh)]
    slots = np.zeros(1, np.int32)
    if mesh.attributes.get("material_index") is not None:
        slots = np.empty(count, np.int32)
        mesh.loop_triangles.foreach_get("material_index", slots)
    files = {}
    for slot in np.unique(slots).tolist():
        file = f"{name}_{slot}.ply"
        _write(folder / file, *_used(rows, faces[slots == slot] if len(slots) > 1 else faces))
        files[slot] = file
    return files


def _triangles(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return the corners of all triangles (n, 3), in Blender's memory; `foreach_get` is slow."""
    memory = (ctypes.c_int32 * (3 * len(mesh.loop_triangles))).from_address(
        mesh.loop_triangles[0].as_pointer()
    )
    return np.frombuffer(memory, np.int32).reshape(-1, 3)


def _used(rows: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows that faces have, and these faces."""
    used = np.zeros(len(rows), bool)
    used[faces] = True
    return (rows, faces) if used.all() else (rows[used], (np.cumsum(used) - 1)[faces])


def _values(attribute: bpy.types.Attribute, name: str, width: int, kind: type) -> np.ndarray:
    """Return an attribute (n, width) at once; properties of vertices would be read one by one."""
    values = np.empty((len(attribute.data), width), kind)
    attribute.data.foreach_get(name, values.ravel())
    return values


def _rows(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return rows of positions, normals and texture coordinates, and the row of each corner.

    The corners of a vertex share a row where they are equal; flat meshes have no normals.
    """
    vertices = _values(mesh.attributes["position"], "vector", 3, np.float32)
    corners = _values(mesh.attributes[".corner_vert"], "value", 1, np.int32)[:, 0]
    layer, domain = mesh.uv_layers.active, mesh.normals_domain
    parts = {}
    if domain == "CORNER":
        parts["nx", "ny", "nz"] = normals = np.empty((len(corners), 3), np.float32)
        mesh.corner_normals.foreach_get("vector", normals.ravel())
    if layer is not None:
        parts["s", "t"] = _values(mesh.attributes[layer.name], "vector", 2, np.float32)
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
        normals = np.empty((len(vertices), 3), np.float32)
        mesh.vertex_normals.foreach_get("vector", normals.ravel())
        parts = {("nx", "ny", "nz"): normals[origin], **parts}
    parts = {("x", "y", "z"): vertices[origin], **parts}
    rows = np.empty(len(origin), [(name, "<f4") for names in parts for name in names])
    for names, values in parts.items():
        for axis, name in enumerate(names):
            rows[name] = values[:, axis]
    return rows, corners


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


def write_strands(curves: bpy.types.Curves, file: Path) -> bool:
    """Write hair, whose points are joined by Catmull-Rom pieces; return whether there is any.

    A piece from p1 to p2 is the Bezier p1, p1 + (p2 - p0) / 6, p2 - (p3 - p1) / 6, p2; at the ends
    of a strand its first and last point count twice.
    """
    lengths = np.empty(len(curves.curves), np.int32)
    curves.curves.foreach_get("points_length", lengths)
    places = np.empty(len(curves.points) * 3, np.float32)
    curves.points.foreach_get("position", places)
    radii = np.full(len(curves.points), 0.005, np.float32)
    radius = curves.attributes.get("radius")
    if radius is not None:
        radius.data.foreach_get("value", radii)
    rows = np.column_stack([places.reshape(-1, 3), radii])
    strands, start = [], 0
    for length in lengths.tolist():
        points, start = rows[start : start + length], start + length
        if length < 2:
            continue
        around = np.vstack([points[:1], points, points[-1:]])
        step = (around[2:] - around[:-2]) / 6.0
        pieces = np.stack([points[:-1], points[:-1] + step[:-1], points[1:] - step[1:]], axis=1)
        strands.append(np.vstack([pieces.reshape(-1, 4), points[-1:]]))
    with file.open("w") as stream:
        for strand in strands:
            np.savetxt(stream, strand, "%.7g")
            stream.write("\n")
    return bool(strands)
