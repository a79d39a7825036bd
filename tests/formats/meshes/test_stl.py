"""STL files of every kind: what is text and what is binary, solids, colours, damage."""

from __future__ import annotations

import gzip
from functools import partial

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats.meshes import stl

PLACES = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 5], [1, 0, 5], [0, 1, 5.5]]])


def solid(name="part", places=PLACES[:1], end="\n"):
    """A text, as programs indent it."""
    lines = [f"solid {name}"]
    for corners in places:
        lines += ["  facet normal 0 0 1", "    outer loop"]
        lines += [f"      vertex {x:g} {y:g} {z:g}" for x, y, z in corners]
        lines += ["    endloop", "  endfacet"]
    return end.join([*lines, f"endsolid {name}", ""])


def binary(head=b"made by hand", places=PLACES, attributes=0, count=None):
    rows = np.zeros(len(places), stl.FACET)
    rows["corners"], rows["attribute"] = places, attributes
    count = len(rows) if count is None else count
    return head.ljust(80, b"\0") + count.to_bytes(4, "little") + rows.tobytes()


@pytest.fixture
def read(read_as):
    return partial(read_as, ".stl")


TEXTS = {
    "plain": solid(),
    "upper case": solid().upper(),
    "mixed": solid().replace("facet", "Facet").replace("solid", "SOLID"),
    "before the first word": "\n \t" + solid(),
    "CRLF": solid(end="\r\n"),
    "CR": solid(end="\r"),
    "one line": solid(end=" "),
    "no name": solid(""),
    "no end": solid().rpartition("endsolid")[0],
    "no end of a line": solid().rstrip(),
    "normals that are no numbers": solid().replace("normal 0 0 1", "normal nan nan nan"),
    "a name of keywords": solid("vertex 1 2 3 facet"),
    "tabs": solid().replace(" ", "\t"),
    "exponents": solid().replace("vertex 1 0 0", "vertex 1.0e+00 -0.0E-5 0"),
    "mark": "\ufeff" + solid(),
    "an end of DOS": solid() + "\x1a\0\0",
    "no normals": solid().replace(" normal 0 0 1", ""),
}


@pytest.mark.parametrize("name", TEXTS)
def test_texts(read, name):
    made = read(TEXTS[name])
    assert made.warnings == []
    assert made.meshes[0].vertices[made.meshes[0].faces].tolist() == PLACES[:1].tolist()


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-16"])
def test_names(read, encoding):
    assert read(solid("Türgriff").encode(encoding)).meshes[0].name == "Türgriff"
    assert read(solid("部品").encode("shift-jis")).meshes[0].vertices.max() == 1
    assert read(solid("")).meshes[0].name == "a.stl"


def test_several_solids(read):
    made = read(solid("one") + "\n" + solid("two", PLACES) + solid("", PLACES[1:]))
    assert [(part.name, len(part.faces)) for part in made.meshes] == [
        ("one", 1), ("two", 2), ("a.stl", 1),
    ]  # fmt: skip


BINARIES = {
    "plain": binary(),
    "solid in the header": binary(b"solid made by a program"),
    "Unity": binary(b"Solid Unity Mesh"),
    "blanks in the header": binary(b"solid facet normal".ljust(80)),
    "one byte more": binary() + b"\0",
    "an end of a line": binary() + b"\r\n",
    "letters that are no text": binary(b"\xff\xfe\xe9solid"),
}


@pytest.mark.parametrize("name", BINARIES)
def test_binaries(read, name):
    made = read(BINARIES[name])
    assert made.warnings == []
    assert made.meshes[0].vertices[made.meshes[0].faces].tolist() == PLACES.tolist()
    assert len(read(gzip.compress(BINARIES[name])).meshes[0].faces) == 2


def test_what_follows_is_told(read):
    assert read(binary() + b"and more").warnings == ["8 bytes after the 2 triangles left out"]


def rgb(red, green, blue):
    return red << 10 | green << 5 | blue


def test_colours_of_viscam(read):
    """Five bits each, blue lowest; the flag says that there is a colour."""
    colours = read(binary(attributes=[0x8000 | rgb(31, 0, 16), rgb(31, 31, 31)])).meshes[0]
    # 132 of 255 through sRGB's curve; without the flag the grey of a mesh without colours.
    np.testing.assert_allclose(
        colours.attributes["face_color"], [[1, 0, 0.2307], [0.5972] * 3], atol=1e-3
    )
    assert colours.material.front.reflectance.name == "face_color"
    assert not read(binary(attributes=[7, 9])).meshes[0].attributes


def test_colours_of_magics(read):
    """Red lowest; the flag says that it is the default, which stands in the header."""
    head = b"COLOR=" + bytes([255, 0, 188, 255]) + b",MATERIAL="
    own = read(binary(head, attributes=[rgb(0, 31, 31), 0x8000])).meshes[0].attributes
    np.testing.assert_allclose(own["face_color"], [[1, 1, 0], [1, 0, 0.5029]], atol=1e-3)


def test_loops_of_more_corners(read):
    """Not of the format, but some programs write them: the letter L as one loop."""
    corners = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    more = "\n".join(f"vertex {x} {y} 0" for x, y in corners)
    text = f"solid l\nfacet normal 0 0 1\nouter loop\n{more}\nendloop\nendfacet\n"
    (made,) = read(text + "endsolid l").meshes
    a, b, c = made.vertices[made.faces].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(3)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "it ends within its header"),
        ("hello", "it ends within its header"),
        ("solid x\nendsolid x\n", "holds no triangles"),
        (binary(count=0)[:84], "holds no triangles"),
        (binary(count=3), "it ends early: it holds 2 of 3 triangles"),
        (binary(count=2**32 - 1), "it holds 2 of 4294967295 triangles"),
        (solid().replace("1 0 0", "1,5 0 0"), "a.stl:5: .*decimal point, not a comma: 'vertex 1,5"),
        (solid().replace("1 0 0", "1 0"), "a.stl:5: .*a vertex needs three numbers: 'vertex 1 0'"),
        (solid().replace("1 0 0", "1 o 0"), "a.stl:5: .*a vertex needs three numbers"),
        (solid()[:70], "a.stl:5: .*it ends within a facet"),
        (solid().replace("outer", "inner"), "a.stl:3: .*a line begins with 'inner loop'"),
        (solid().replace("    outer loop\n", ""), "a.stl:3: .*a line begins with 'vertex 0 0 0'"),
        (solid().replace("1 0 0", "1e39 0 0"), "triangle 0 has a vertex that is not a finite"),
        (solid().replace("1 0 0", "nan 0 0"), "triangle 0 has a vertex that is not a finite"),
        (binary(places=PLACES * np.nan), "triangle 0 has a vertex that is not a finite"),
    ],
)  # fmt: skip
def test_bad_files(read, content, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(content)
    assert "\n" not in str(caught.value)


def test_trimesh_is_not_asked(read, monkeypatch):
    """Nor is it imported, which takes a second."""
    import sys

    monkeypatch.setitem(sys.modules, "trimesh", None)
    assert read(solid()).meshes and read(binary()).meshes
