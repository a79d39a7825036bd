"""Meshes of Blender as files, by its own buffers: each corner of each triangle (needs bpy)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt.formats.native import shape_files

bpy: Any = pytest.importorskip("bpy")
meshes: Any = pytest.importorskip("blender.meshes")

pytestmark = pytest.mark.slow


def by_properties(mesh: Any) -> dict[int, list[np.ndarray]]:
    """Return the corners (n, 3, 8) of the triangles of each material, asked for one by one."""
    mesh.calc_loop_triangles()
    uvs = mesh.uv_layers.active
    found: dict[int, list[np.ndarray]] = {}
    for triangle in mesh.loop_triangles:
        rows = [
            [
                *mesh.vertices[mesh.loops[corner].vertex_index].co,
                *mesh.corner_normals[corner].vector,
                *(uvs.uv[corner].vector if uvs else (0.0, 0.0)),
            ]
            for corner in triangle.loops
        ]
        found.setdefault(triangle.material_index, []).append(np.array(rows, np.float32))
    return found


@pytest.mark.parametrize("seed", range(6))
def test_corners_are_those_of_blender(seed: int, tmp_path: Path) -> None:
    """Random polygons: smooth, flat or both, with seams of their UV map, of several materials."""
    random = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=9, ring_count=6)
    mesh = bpy.context.object.data
    if seed % 3 == 0:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    smooth = {0: 0.0, 1: 1.0}.get(seed // 2, 0.5)
    for polygon in mesh.polygons:
        polygon.use_smooth = random.random() < smooth
        polygon.material_index = random.integers(0, 3) if seed > 2 else 0
    for _ in range(3):
        mesh.materials.append(bpy.data.materials.new("paint"))
    mesh.update()
    files, wanted = meshes.write(mesh, tmp_path, "mesh"), by_properties(mesh)
    assert set(files) == set(wanted)
    for slot, file in files.items():
        (part,) = shape_files.read_meshes(tmp_path / file, "error").meshes
        corners = np.stack(wanted[slot])
        faces = np.asarray(part.faces)
        assert np.array_equal(part.vertices[faces], corners[..., :3])
        if part.normals is None:
            assert mesh.normals_domain == "FACE"
        else:
            assert np.allclose(part.normals[faces], corners[..., 3:6], atol=1e-6)
        if part.uvs is None:
            assert not mesh.uv_layers
        else:
            assert np.array_equal(part.uvs[faces], corners[..., 6:])
        assert len(np.unique(faces)) == len(part.vertices)


def test_a_million_triangles(tmp_path: Path, record_property: Any) -> None:
    """They are written whole; how long that takes is told, not tested."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=708, y_subdivisions=708)
    mesh = bpy.context.object.data
    mesh.shade_smooth()
    began = time.perf_counter()
    (file,) = meshes.write(mesh, tmp_path, "mesh").values()
    written = time.perf_counter() - began
    (part,) = shape_files.read_meshes(tmp_path / file, "error").meshes
    read = time.perf_counter() - began - written
    assert len(part.faces) == 2 * 708**2
    assert 709**2 <= len(part.vertices) < 1.05 * 709**2  # UVs of Blender 4.5 differ in a last bit
    record_property("seconds", {"written": written, "read": read})
