"""meshopt compression: streams made by the meshoptimizer library 0.2.30 from the values beside."""

from __future__ import annotations

import base64

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats.gltf import meshopt

VALUES = np.array(
    [
        [4, -5, -4, -3], [0, -1, 1, -2], [-6, -6, -1, -3], [-4, -6, -4, -7], [-2, -3, -10, -12],
        [-3, -4, -5, -12], [-4, -5, -3, -11], [-8, -2, 0, -5], [-4, -5, -2, -3],
        [2998, 2998, 3003, 2994], [4, -8, -3, 0], [10, -11, -8, -2], [4, -6, -6, -1],
        [1, -6, -10, 3], [1, -12, -13, 6], [1, -14, -16, 1], [2, -12, -16, 7], [8, -16, -15, 9],
        [5, -19, -15, 12], [2, -16, -13, 8],
    ]
)  # fmt: skip
ATTRIBUTES = {
    0: "oAYHtEEXj/y1AIucvwAAAAwFBQEEADwAGBUKCJBhFl/1oLOJhEdWAAAAAAAAAQAAPAAYFwYKNbpGP/lHVYWEIwAA"
    "AAQBJAJ8ABgXCgIXkCxP8yhplZzEZwAAAAAAAAEAAD0gGBUAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAEAPv//P/9/w==",
    1: "oRERAge0QReP/LUAdGMPAAIMBQUBAAYXFwIIkGEWX/Wgs3Z7DwAEBwUGAQAGFxcCCjW6Rj/5R1V6ewoAAgQBAAYX"
    "FwICF5AsT/MoaWpjDwAMBAYHAQAGFxcAAAAAAAAAAAAAAAAAAAQA+//8//3/AQE=",
}
INDICES = [0, 1, 2, 2, 1, 3, 4, 5, 6, 2, 3, 7, 9, 1, 200, 3, 8, 7]
TRIANGLES = "4fAQ8DD/QH8S/gIAdodWZ3iphmWJaJgBaQAA"
SEQUENCE = "0QAEBAACCAQEBA4EEAgeoQYIFAIAAAAA"


def view(stream: str | bytes, count: int, stride: int, mode: str, **more):
    """A document whose first triangle's corners are the first values of a compressed view."""
    data = base64.b64decode(stream) if isinstance(stream, str) else stream
    compressed = {"buffer": 0, "byteLength": len(data), "byteStride": stride, "count": count}
    compressed |= {"mode": mode, **more}
    return data, {
        "buffer": 1,
        "byteLength": count * stride,
        "extensions": {"EXT_meshopt_compression": compressed},
    }


@pytest.fixture
def decode(read, build):
    """Vertices as a loader gives them, of a view of 16-bit values."""

    def of(stream, count, **more):
        made = build(extensionsRequired=["EXT_meshopt_compression", "KHR_mesh_quantization"])
        data, compressed = view(stream, count, 8, "ATTRIBUTES", **more)
        made.view(data)
        made.json["bufferViews"].append(compressed)
        accessor = {"bufferView": 1, "componentType": 5122, "count": count, "type": "VEC3"}
        made.json["accessors"].append(accessor)
        made.json["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}]
        uri = "data:;base64," + base64.b64encode(made.data).decode()
        buffers = [{"byteLength": len(made.data), "uri": uri}, {"byteLength": 1 << 20}]
        made.json["buffers"] = buffers
        return read(made).shapes[0].vertices

    return of


@pytest.mark.parametrize("version", ATTRIBUTES)
def test_attributes(decode, version):
    assert np.array_equal(decode(ATTRIBUTES[version], 20), VALUES[:, :3])


@pytest.mark.parametrize(("mode", "stream"), [("TRIANGLES", TRIANGLES), ("INDICES", SEQUENCE)])
def test_indices(read, build, mode, stream):
    made = build()
    data, compressed = view(stream, 18, 2, mode)
    made.view(data)
    made.json["bufferViews"].append(compressed)
    indices = {"bufferView": 1, "componentType": 5123, "count": 18, "type": "SCALAR"}
    made.json["accessors"].append(indices)
    points = np.random.default_rng(0).normal(size=(201, 3))
    made.mesh(points, indices=0)
    made.json["buffers"] = [
        {
            "byteLength": len(made.data),
            "uri": "data:;base64," + base64.b64encode(made.data).decode(),
        },
        {"byteLength": 36},
    ]
    mesh = read(made).shapes[0]
    corners = mesh.vertices[mesh.faces].mean(axis=1)
    assert np.allclose(corners, points[INDICES].reshape(-1, 3, 3).mean(axis=1), atol=1e-6)


def test_broken_streams_are_refused(decode):
    whole = base64.b64decode(ATTRIBUTES[1])
    for stream in (b"\xa0", whole[:40], b"\xa2" + whole[1:], whole[:1] + b"\xff" * 90):
        with pytest.raises(SceneError, match=r"bufferViews\[1\].*cannot be decompressed"):
            decode(stream, 20)
    with pytest.raises(SceneError, match="cut short"):  # more than the stream could hold
        decode(whole, 1 << 16)
    with pytest.raises(SceneError, match="its buffer has 1048576"):
        decode(whole, 1 << 40)


def test_filters_after_the_specification():
    rng = np.random.default_rng(1)
    unit = rng.normal(size=(50, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    flat = unit / np.abs(unit).sum(axis=1, keepdims=True)
    low = flat[:, 2] < 0
    folded = (1 - np.abs(flat[:, 1::-1])) * np.where(flat[:, :2] < 0, -1, 1)
    flat[low, :2] = folded[low]
    stored = np.column_stack([np.round(flat[:, :2] * 511), np.full(50, 511), np.arange(50)])
    made = meshopt.apply_filter(stored.astype("<i2").view(np.uint8), "OCTAHEDRAL").view("<i2")
    assert np.abs(made[:, :3] / 32767 - unit).max() < 6e-3  # ten bits
    assert np.array_equal(made[:, 3], np.arange(50))

    quaternion = np.array([0.1, -0.7, 0.3, -0.2])
    quaternion /= np.linalg.norm(quaternion)
    rest = -np.roll(quaternion, -1)[[1, 2, 3]] * np.sqrt(2) * 2047  # w, x after y is left out
    rest = -quaternion[[2, 3, 0]] * np.sqrt(2) * 2047
    stored = np.array([[*np.round(rest), 2044 | 1]]).astype("<i2")
    made = meshopt.apply_filter(stored.view(np.uint8), "QUATERNION").view("<i2")
    assert np.abs(made / 32767 + quaternion).max() < 1e-3

    words = np.array([[(-3 & 0xFF) << 24 | 5, 2 << 24 | (-7 & 0xFFFFFF)]], "<u4")
    made = meshopt.apply_filter(words.view(np.uint8), "EXPONENTIAL").view("<f4")
    assert made.tolist() == [[0.625, -28.0]]

    red = np.array([[64, 127, -64, 0xFF]]).astype(np.uint8)  # Y 64, Co 127, Cg -64 of 8 bits
    made = meshopt.apply_filter(red, "COLOR")
    assert np.abs(made.astype(int) - [[255, 0, 1, 255]]).max() <= 1
