"""Whatever stands in a file, a loader gives a Scene or a SceneError, and soon."""

from __future__ import annotations

import json

import pytest

from clpt.errors import SceneError
from clpt.formats import load, native

hypothesis = pytest.importorskip("hypothesis")
st = hypothesis.strategies

FEW = hypothesis.settings(
    max_examples=80,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(hypothesis.HealthCheck),
)
WORDS = st.sampled_from(
    "type value name id filename sphere mesh cube diffuse twosided path perspective rgb float "  # noqa: SIM905
    "to_world reflectance radiance area constant 1 -1 0 nan 1e999 $x true # , : [ ] { } < > & ; / "
    "\\".split()
)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | WORDS | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(WORDS, inner, max_size=4),
    max_leaves=8,
)


def check(path, content: bytes) -> None:
    path.write_bytes(content)
    try:
        load(path)
    except SceneError as error:
        assert "\n" not in str(error)


def damaged(source: bytes):
    """The source with some of it cut out, doubled, or overwritten by words."""

    @st.composite
    def of(draw):
        text = source
        for _ in range(draw(st.integers(1, 3))):
            a = draw(st.integers(0, len(text)))
            b = min(len(text), a + draw(st.integers(0, 30)))
            new = draw(
                st.just(b"")
                | st.just(text[a:b] * 2)
                | WORDS.map(str.encode)
                | st.binary(max_size=4)
            )
            text = text[:a] + new + text[b:]
        return text

    return of()


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
    @hypothesis.given(damaged((scenes / name).read_bytes()))
    def run(content):
        check(folder / "damaged.xml", content)

    run()


def test_damaged_json(folder):
    @FEW
    @hypothesis.given(damaged((folder / "plastic.json").read_bytes()))
    def run(content):
        check(folder / "damaged.json", content)

    run()


def test_json_with_one_value_replaced(folder):
    source = (folder / "plastic.json").read_text()
    places = list(_places(json.loads(source)))

    @FEW
    @hypothesis.given(st.sampled_from(places), VALUES)
    def run(place, value):
        document = json.loads(source)
        inner = document
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = value
        check(folder / "replaced.json", json.dumps(document).encode("utf-8", "surrogatepass"))

    run()


def _places(value, path=()):
    keys = (
        value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    )
    for key in keys:
        yield (*path, key)
        yield from _places(value[key], (*path, key))


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".off", ".glb"])
def test_damaged_meshes(folder, suffix):
    import trimesh

    trimesh.creation.icosphere(subdivisions=0).export(folder / f"ball{suffix}")

    @FEW
    @hypothesis.given(damaged((folder / f"ball{suffix}").read_bytes()))
    def run(content):
        check(folder / f"damaged{suffix}", content)

    run()
