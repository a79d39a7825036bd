"""Whatever stands in a file, a loader gives a Scene or a SceneError, and soon."""

from __future__ import annotations

import json

import pytest

from clpt.formats import load, native
from tests.formats.fuzzing import (
    check,
    damaged,
    hypothesis,
    json_paths,
    json_values,
    replace,
    settings,
    st,
)

FEW = settings(80)
WORDS = st.sampled_from(
    "type value name id filename sphere mesh cube diffuse twosided path perspective rgb float "  # noqa: SIM905
    "to_world reflectance radiance area constant 1 -1 0 nan 1e999 $x true # , : [ ] { } < > & ; / "
    "\\".split()
)
SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | WORDS | st.text(max_size=5)
VALUES = json_values(SCALARS, WORDS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, scenes):
    made = tmp_path_factory.mktemp("fuzz")
    for name in ("tiles.png", "sky.exr", "bowl.obj"):
        (made / name).write_bytes((scenes / name).read_bytes())
    native.save(load(scenes / "plastic.xml"), made / "plastic.json")
    return made


@pytest.mark.parametrize("name", ["cornell.xml", "plastic.xml", "textures.xml"])
def test_damaged_xml(folder, scenes, name):
    @FEW
    @hypothesis.given(damaged((scenes / name).read_bytes(), WORDS))
    def run(content):
        check(folder / "damaged.xml", content)

    run()


def test_damaged_json(folder):
    @FEW
    @hypothesis.given(damaged((folder / "plastic.json").read_bytes(), WORDS))
    def run(content):
        check(folder / "damaged.json", content)

    run()


def test_json_with_one_value_replaced(folder):
    source = (folder / "plastic.json").read_text()
    paths = list(json_paths(json.loads(source)))

    @FEW
    @hypothesis.given(st.sampled_from(paths), VALUES)
    def run(path, value):
        document = json.loads(source)
        replace(document, path, value)
        check(folder / "replaced.json", json.dumps(document).encode("utf-8", "surrogatepass"))

    run()


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".off", ".glb"])
def test_damaged_meshes(folder, suffix):
    import trimesh

    trimesh.creation.icosphere(subdivisions=0).export(folder / f"ball{suffix}")

    @FEW
    @hypothesis.given(damaged((folder / f"ball{suffix}").read_bytes(), WORDS))
    def run(content):
        check(folder / f"damaged{suffix}", content)

    run()
