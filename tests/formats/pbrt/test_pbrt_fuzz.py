"""Whatever stands in a PBRT or PLY file, the loader gives a Scene or a SceneError, and soon."""

from __future__ import annotations

import pytest

from clpt.formats.meshes import ply
from tests.formats.fuzzing import check, damaged, hypothesis, settings, st

FEW = settings(150)
WORDS = st.sampled_from(
    'Shape "sphere" "disk" "loopsubdiv" "plymesh" "float radius" "integer levels" "point3 P" '  # noqa: SIM905
    '"integer indices" [ ] 0 1 -1 1e30 nan 1e999 99999999999 # " true Scale Rotate Transform '
    'Identity AttributeBegin AttributeEnd ObjectBegin ObjectEnd ObjectInstance "a" Include '
    '"fuzz.pbrt" Import WorldBegin Material "diffuse" NamedMaterial "mix" "string type" Texture '
    '"float alpha" "texture alpha" LightSource "infinite" AreaLightSource "float scale" \\'.split()
)


def test_heaps_of_words(tmp_path):
    @FEW
    @hypothesis.given(st.lists(WORDS, max_size=30))
    def run(words):
        check(tmp_path / "fuzz.pbrt", ("WorldBegin\n" + " ".join(words)).encode())

    run()


@pytest.fixture(scope="module")
def source(scenes):
    return (scenes / "cornell.pbrt").read_bytes()


def test_damaged_files(tmp_path, source):
    @FEW
    @hypothesis.given(damaged(source, WORDS))
    def run(content):
        check(tmp_path / "fuzz.pbrt", content)

    run()


def test_damaged_meshes(tmp_path):
    head = (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
        b"property float y\nproperty float z\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n"
    )
    source = head + bytes(36) + b"\x03" + b"\0\0\0\0\1\0\0\0\2\0\0\0"

    @FEW
    @hypothesis.given(st.data())
    def run(data):
        at = data.draw(st.integers(0, len(source)))
        new = data.draw(st.binary(max_size=6))
        end = at + data.draw(st.integers(0, 6))
        check(tmp_path / "a.ply", source[:at] + new + source[end:], ply.read)

    run()
