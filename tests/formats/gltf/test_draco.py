"""What stands in a Draco stream before its triangles."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load

DracoPy = pytest.importorskip("DracoPy")
METADATA = 10  # the byte whose highest bit tells of metadata
# Of one attribute: its number, no entries, nothing inside; of the mesh: two entries, and one inside
# that has one entry.
GOOD = (
    bytes([1, 0, 0, 0])
    + bytes([2, 1])
    + b"a\x02xy"
    + b"\x01b\x01q"
    + b"\x01\x01i\x01\x01c\x01z\x00"
)
# Each has 200 inside, at every depth, of which the data hold none.
WIDE = bytes([0, 0]) + bytes([200, 1, 1, 1]) * 12
# 2^35 attributes.
MANY = b"\xff\xff\xff\xff\x7f"


def file_with(tmp_path, metadata):
    """A glTF of one Draco mesh, whose metadata are so; returns the mesh's points too."""
    points = np.random.default_rng(1).random((12, 3)).astype(np.float32)
    faces = np.arange(12, dtype=np.uint32).reshape(4, 3)
    data = bytearray(DracoPy.encode(points, faces))
    data[METADATA] |= 0x80
    data[11:11] = metadata
    (tmp_path / "a.bin").write_bytes(data)
    accessor = {"count": 12, "componentType": 5126, "type": "VEC3", "min": [0] * 3, "max": [1] * 3}
    packed = {"bufferView": 0, "attributes": {"POSITION": 0}}
    primitive = {
        "attributes": {"POSITION": 0},
        "extensions": {"KHR_draco_mesh_compression": packed},
    }
    (tmp_path / "a.gltf").write_text(json.dumps({
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_draco_mesh_compression"],
        "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [primitive]}], "accessors": [accessor],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"uri": "a.bin", "byteLength": len(data)}],
    }))  # fmt: skip
    return tmp_path / "a.gltf", points


def test_metadata_are_passed_over(tmp_path):
    path, points = file_with(tmp_path, GOOD)
    shape = load(path).shapes[0]
    assert len(shape.faces) == 4
    np.testing.assert_allclose(np.sort(shape.vertices, 0), np.sort(points, 0), atol=1e-3)


@pytest.mark.parametrize("metadata", [WIDE, MANY, b"\x7f"], ids=["wide", "many", "short"])
def test_metadata_that_the_data_do_not_hold(tmp_path, metadata):
    """A claimed count costs no time: before, each depth read 200 that were not there."""
    path, _ = file_with(tmp_path, metadata)
    with pytest.raises(SceneError, match=r"KHR_draco_mesh_compression: .*Draco|its data end"):
        load(path)
