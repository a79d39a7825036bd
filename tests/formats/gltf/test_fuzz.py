"""Whatever stands in a glTF file, the loader gives a Scene or a SceneError, and soon."""

from __future__ import annotations

import contextlib
import copy
import json

import numpy as np
import pytest

from clpt.formats import load
from tests.formats.fuzzing import check, hypothesis, json_paths, json_values, replace, settings, st

FEW = settings(150)
WORDS = st.sampled_from(
    ["mesh", "VEC3", "MAT4", "LINEAR", "data:,", "../a", "perspective", "", "é"]
)
NUMBERS = st.sampled_from([-1, 0, 1, 2, 3, 7, 5121, 5126, 2**31, 2**32 - 1, 10**30, 0.5, -1e308])
VALUES = json_values(st.none() | st.booleans() | NUMBERS | WORDS, WORDS)


def rich(build):
    """A document with most of what there is."""
    made = build(
        nodes=[
            {"mesh": 0, "skin": 0, "weights": [0.5]},
            {"children": [2], "rotation": [0, 0, 0, 1]},
            {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        scenes=[{"nodes": [0, 1]}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}},
        extensionsUsed=["KHR_lights_punctual"],
        materials=[{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
    )
    attributes = {
        "NORMAL": made.accessor([[0, 0, 127]] * 3, "i1", normalized=True),
        "TEXCOORD_0": made.accessor(np.zeros((3, 2))),
        "COLOR_0": made.accessor([[255, 0, 0]] * 3, "u1", normalized=True),
        "JOINTS_0": made.accessor([[0, 1, 0, 0]] * 3, "u2"),
        "WEIGHTS_0": made.accessor([[0.5, 0.5, 0, 0]] * 3),
    }
    targets = [{"POSITION": made.accessor(np.ones((3, 3)))}]
    indices = made.accessor([0, 1, 2], "u1")
    made.mesh(attributes=attributes, targets=targets, indices=indices, material=0)
    matrices = made.accessor(np.tile(np.eye(4).reshape(16), (2, 1)))
    made.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    samplers = [{"input": made.accessor([0.0, 1.0]), "output": made.accessor(np.zeros((2, 3)))}]
    channels = [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]
    made.json["animations"] = [{"samplers": samplers, "channels": channels}]
    return made


def test_the_whole_document_is_read(tmp_path, build):
    (tmp_path / "a.gltf").write_text(rich(build).text())
    assert not load(tmp_path / "a.gltf", time=0.5).warnings


def test_values_replaced(tmp_path, build):
    document = json.loads(rich(build).text())
    paths = list(json_paths(document))

    @FEW
    @hypothesis.given(st.lists(st.tuples(st.sampled_from(paths), VALUES), min_size=1, max_size=3))
    def run(changes):
        changed = copy.deepcopy(document)
        for path, value in changes:
            with contextlib.suppress(KeyError, IndexError, TypeError):  # an earlier change cut it
                replace(changed, path, value)
        check(tmp_path / "replaced.gltf", json.dumps(changed).encode(), time=0.5)

    run()


def test_bytes_replaced(tmp_path, build):
    whole = rich(build).glb()

    @FEW
    @hypothesis.given(
        st.lists(st.tuples(st.integers(0, len(whole) - 1), st.binary(max_size=4)), max_size=4),
        st.integers(0, len(whole)),
    )
    def run(changes, end):
        data = bytearray(whole)
        for at, new in changes:
            data[at : at + len(new)] = new
        check(tmp_path / "damaged.glb", bytes(data[: end if end % 5 == 0 else len(data)]), time=0.5)

    run()


@pytest.mark.parametrize("name", ["Box-draco/Box_Draco.glb", "khr"])
def test_compressed_bytes_replaced(tmp_path, assets, name):
    if name == "khr":
        name = "meshopt-khr-no-fallback/meshopt-no-fallback.gltf"
    source = assets / "gltf" / name
    whole = source.read_bytes()
    for beside in source.parent.glob("*.bin"):
        (tmp_path / beside.name).write_bytes(beside.read_bytes())

    @FEW
    @hypothesis.given(
        st.lists(st.tuples(st.integers(0, 1 << 20), st.binary(min_size=1, max_size=3)), max_size=4)
    )
    def run(changes):
        target = next(tmp_path.glob("*.bin"), None)
        stored = whole if target is None else (source.parent / target.name).read_bytes()
        data = bytearray(stored)
        for at, new in changes:
            at %= len(data)
            data[at : at + len(new)] = new
        if target is None:
            check(tmp_path / source.name, bytes(data[: len(stored)]), time=0.5)
        else:
            target.write_bytes(data)
            check(tmp_path / source.name, whole, time=0.5)

    run()
