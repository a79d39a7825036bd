# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of Blender as .ply, by material, and hair as text: strands of Bezier pieces."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

CORNER = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("nx", "<f4"), ("ny", "<f4"), ("nz", "<f4")]
UV = [("s", "<f4"), ("t", "<f4")]
FACE = np.dtype([("count", "u1"), ("corners", "<u4", (3,))])


def write(mesh: bpy.types.Mesh, folder: Path, name: str) -> dict[int, str]:
    """Write a mesh; return the file of each of its material slots that has triangles.

    folder: where the files are; name: how their names begin.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return {}
    corners = np.empty(count * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    slots = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("material_index", slots)
    rows = _rows(mesh)
    files = {}
    for slot in np.unique(slots).tolist():
        chosen = corners.reshape(-1, 3)[slots == slot]
        used, faces = np.unique(chosen, return_inverse=True)
        file = f"{name}_{slot}.ply"
        _write(folder / file, rows[used], faces.reshape(-1, 3))
        files[slot] = file
    return files


def _rows(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return positions, normals and texture coordinates of all corners."""
    loops = len(mesh.loops)
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", vertices)
    places = np.empty(loops, np.int32)
    mesh.loops.foreach_get("vertex_index", places)
    normals = np.empty(loops * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    layer = mesh.uv_layers.active
    rows = np.empty(loops, CORNER + (UV if layer is not None else []))
    for axis, (place, normal) in enumerate(zip("xyz", ("nx", "ny", "nz"), strict=True)):
        rows[place] = vertices.reshape(-1, 3)[places, axis]
        rows[normal] = normals.reshape(-1, 3)[:, axis]
    if layer is not None:
        uvs = np.empty(loops * 2, np.float32)
        layer.uv.foreach_get("vector", uvs)
        rows["s"], rows["t"] = uvs.reshape(-1, 2).T
    return rows


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
