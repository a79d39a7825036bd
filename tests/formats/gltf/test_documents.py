"""What is no glTF, or does not fit together, is refused with the place in its JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load

TEXTS = {
    "hello": "is not glTF",
    "[]": "is not glTF: its JSON is no object",
    '{"a": NaN}': "NaN is no number",
    "[" * 100_000: "is not glTF",
    "{}": "no 'asset'",
    '{"asset": {"version": "1.0"}}': r"asset.version: glTF 1.0 is not supported",
    '{"asset": {"version": "2.0", "minVersion": "2.1"}}': "asset.minVersion",
}


@pytest.mark.parametrize("text", TEXTS, ids=lambda t: t[:20])
def test_texts(read, text):
    with pytest.raises(SceneError, match=TEXTS[text]):
        read(text)


def buffer(uri: str) -> dict:
    return {"buffers": [{"byteLength": 4, "uri": uri}]}


URIS = {
    "../secret.bin": "does not lie beside the file",
    "%2e%2e/secret.bin": "does not lie beside the file",
    "/etc/passwd": "does not lie beside the file",
    "http://example.com/a.bin": "does not lie beside the file",
    "C:/a.bin": "does not lie beside the file",
    "none.bin": "there is no file",
    "a\0b": "there is no file",
    "x" * 5000: "there is no file",
    "data:application/octet-stream;base64,!!": "broken base64",
    "data:nothing": "without a comma",
    "data:,abc": r"buffers\[0\].byteLength: says 36 bytes, there are 3",
}


@pytest.mark.parametrize("uri", URIS, ids=lambda u: u[:20])
def test_uris(read, build, uri):
    made = build().mesh()
    made.json["buffers"] = [{"byteLength": 36, "uri": uri}]
    with pytest.raises(SceneError, match=URIS[uri]) as caught:
        read(made)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


CHANGES = {
    "meshes[0].primitives": (7, r"meshes\[0\].primitives: must be a list, not 7"),
    "nodes[0].mesh": (4, r"nodes\[0\].mesh: there is no meshes\[4\]; the file has 1"),
    "nodes[0].children": ([0], r"nodes\[0\].children: is its own ancestor"),
    "nodes[0].matrix": ([1.0] * 15, "must be 16 numbers"),
    "nodes[0].rotation": ([0, 0, 0, 0], "is no rotation"),
    "nodes[0].scale": ([1e300, 1, 1], "too large"),
    "nodes[0].translation": ([True, 0, 0], "must be a number, not true"),
    "scene": (3, "there is no scenes"),
    "accessors[0].count": (4294967295, r"accessors\[0\].count: .* lie outside of 36"),
    "accessors[0].componentType": (5124, "is no component type"),
    "accessors[0].type": ("VEC2", "is none of VEC3"),
    "accessors[0].byteOffset": (4, "lie outside"),
    "bufferViews[0].byteLength": (
        4294967295,
        "bufferViews.0.: ends at byte 4294967295, its buffer has 36",
    ),
    "bufferViews[0].byteStride": (4, "hold no element of 12"),
    "meshes[0].primitives[0].mode": (7, "outside 0 to 6"),
    "extensionsRequired": (["EXT_unheard_of"], r"extensionsRequired\[0\]: needs .*EXT_unheard_of"),
    "extensionsUsed": ([7], "must be a text"),
}


def change(document: dict, place: str, value) -> None:
    *keys, last = place.replace("[", ".").replace("]", "").split(".")
    for key in keys:
        document = document[int(key)] if key.isdigit() else document[key]
    document[last] = value


@pytest.mark.parametrize("place", CHANGES)
def test_changed_documents(read, build, place):
    made = build().mesh()
    value, message = CHANGES[place]
    change(made.json, place, value)
    with pytest.raises(SceneError, match=message):
        read(made)


def test_counts_without_data_take_no_memory(read, build):
    made = build().mesh()
    made.json["accessors"][0] = {"componentType": 5126, "count": 2**32 - 1, "type": "VEC3"}
    with pytest.raises(SceneError, match=r"accessors\[0\] of 4294967295 elements would take"):
        read(made)


def test_indices_and_numbers_out_of_range(read, build):
    made = build()
    indices = made.accessor([0, 1, 3], "u2")
    with pytest.raises(SceneError, match=r"primitives\[0\].indices: triangle 0 names a vertex"):
        read(made.mesh(indices=indices))
    with pytest.raises(SceneError, match=r"accessors\[0\]: element 1 is not a finite number"):
        read(build().mesh([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]]))
    made = build()
    normals = made.accessor(np.zeros((2, 3)))
    with pytest.raises(SceneError, match="accessors have different counts"):
        read(made.mesh(attributes={"NORMAL": normals}))


@pytest.mark.parametrize("place, value, message", [
    ("materials[0].pbrMetallicRoughness.baseColorFactor", [1.0000001192092896, 1, 1, 1], None),
    ("materials[0].pbrMetallicRoughness.metallicFactor", -1e-8, None),
    ("materials[0].pbrMetallicRoughness.roughnessFactor", 1.0000001, None),
    ("materials[0].alphaCutoff", -1e-9, None),
    ("bufferViews[0].byteStride", 0, "byteStride of 0"),
])  # fmt: skip
def test_numbers_beyond_a_limit_by_rounding(read, build, place, value, message):
    made = build(materials=[{"pbrMetallicRoughness": {}}]).mesh(material=0)
    change(made.json, place, value)
    scene = read(made)
    assert scene.shapes[0].kind == "mesh"
    assert message is None or any(message in text for text in scene.warnings)


def test_numbers_beyond_a_limit_are_refused(read, build):
    made = build(materials=[{"pbrMetallicRoughness": {"metallicFactor": 1.0001}}]).mesh(material=0)
    with pytest.raises(SceneError, match=r"outside"):
        read(made)


def test_a_scene_that_names_a_child(read, build):
    """The node stays where its parents put it, and is there once."""
    nodes = [{"children": [1], "translation": [0, 0, 5]}, {"mesh": 0, "translation": [1, 0, 0]}]
    for roots in ([1], [0, 1], [1, 0]):
        scene = read(build(nodes=nodes, scenes=[{"nodes": roots}]).mesh())
        shape, *studio = scene.shapes
        assert len(studio) == 2
        assert np.asarray(shape.to_world)[:3, 3].tolist() == [1.0, 0.0, 5.0]
        assert any("another's child" in text for text in scene.warnings)


def test_json_padded_by_zeros_is_named(read, build):
    """Spaces must pad it (glTF 4.4.3.2)."""
    data = build().mesh().glb()
    length = int.from_bytes(data[12:16], "little")
    text = data[20 : 20 + length].rstrip()
    padded = text + b" " * (-(len(text) + 1) % 4) + b"\0"
    head = data[:8] + (len(data) - length + len(padded)).to_bytes(4, "little")
    head += len(padded).to_bytes(4, "little") + data[16:20]
    with pytest.raises(SceneError, match="its JSON is padded with zeros, not spaces"):
        read(head + padded + data[20 + length :], "a.glb")


@pytest.mark.parametrize("dtype", ["u1", "u2"])
def test_colours_that_are_not_normalized_are_told(read, build, dtype):
    made = build()
    colours = made.accessor([[1, 0, 0]] * 3, dtype)
    scene = read(made.mesh(attributes={"COLOR_0": colours}))
    assert scene.warnings == [
        "accessors[0]: COLOR_0 of whole numbers must be normalized; taken as it is"
    ]


def test_binary_files(read, build):
    whole = build().mesh().glb()
    assert len(read(whole, "a.glb").shapes[0].faces) == 1
    for data, message in {
        whole[:-1]: "is cut short",
        whole[:10]: "is cut short",
        whole[:4] + b"\1\0\0\0" + whole[8:]: "binary glTF of version 1",
        whole[:12] + b"\xff\xff\xff\x7f" + whole[16:]: "chunk 0 says",
        whole[:16] + b"NOPE" + whole[20:]: "first chunk is not JSON",
        b"glTF": "is cut short",
    }.items():
        with pytest.raises(SceneError, match=message):
            read(data, "a.glb")


def test_a_deep_graph_is_no_recursion(read, build):
    count = 20_000
    made = build(nodes=[{"children": [i + 1], "translation": [0, 0, 1]} for i in range(count)])
    made.json["nodes"].append({"mesh": 0})
    assert read(made.mesh()).shapes[0].to_world[2, 3] == count


def test_two_parents_are_refused(read, build):
    made = build(nodes=[{"children": [1, 2]}, {"mesh": 0, "children": [2]}, {}])
    with pytest.raises(SceneError, match=r"nodes\[2\] is already a child"):
        read(made.mesh())


def corpus(assets):
    """(file, codes of the Khronos validator's errors) of its corpus."""
    for report in sorted((assets / "gltf-validator-corpus").rglob("*.report.json")):
        path = report.with_name(report.name.removesuffix(".report.json"))
        issues = json.loads(report.read_text())["issues"]["messages"]
        codes = {issue["code"] for issue in issues if issue["severity"] == 0}
        for file in (path, path.with_suffix(".gltf"), path.with_suffix(".glb")):
            if file.is_file():
                yield file, codes
                break


def test_the_validators_corpus(assets):
    """What it finds valid is read; what we refuse, it finds wrong too."""
    verdicts = {"good": 0, "noticed": 0, "passed": 0}
    for file, codes in corpus(assets):
        try:
            load(file)
        except SceneError as error:
            assert codes, f"{file} is valid: {error}"
            assert "\n" not in str(error)
            verdicts["noticed"] += 1
        else:
            verdicts["passed" if codes else "good"] += 1
    assert verdicts["good"] == 64 and verdicts["noticed"] >= 60


def test_malformed_files(assets):
    refused = set()
    for file in sorted((assets / "gltf-malformed").rglob("*.gl*")):
        try:
            load(file)
        except SceneError as error:
            assert file.name in str(error) and "\n" not in str(error)
            refused.add(file.name)
    assert len(refused) >= 11 and "RecursiveNodes.gltf" in refused
