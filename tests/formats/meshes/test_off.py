"""OFF files by Geomview's manual: every header, free format, colours, damage."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from clpt.errors import SceneError

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
POINTS = "0 0 0\n1 0 0\n0 1 0\n"


@pytest.fixture
def read(read_as):
    return partial(read_as, ".off")


FILES = {
    "plain": f"OFF\n3 1 0\n{POINTS}3 0 1 2\n",
    "small letters": f"off\n3 1 0\n{POINTS}3 0 1 2\n\x1a",
    "no word": f"3 1 0\n{POINTS}3 0 1 2\n",
    "counts on the line": f"OFF 3 1 0\n{POINTS}3 0 1 2\n",
    "counts at the word": f"OFF3 1 0\n{POINTS}3 0 1 2\n",
    "no edges": f"OFF\n3 1\n{POINTS}3 0 1 2\n",
    "counts on lines": f"OFF\n3\n1\n0\n{POINTS}3 0 1 2\n",
    "one line": f"OFF 3 1 0 {POINTS} 3 0 1 2".replace("\n", " "),
    "a face on lines": f"OFF\n3 1 0\n{POINTS}3 0\n1\n2\n",
    "vertices on lines": "OFF\n3 1 0\n0 0\n0 1 0 0 0\n1\n0 3 0 1 2",
    "comments": f"# made by hand\nOFF # a word\n\n3 1 0 # sizes\n{POINTS}# 9 9 9\n3 0 1 2 # 1\n",
    "CRLF": f"OFF\n3 1 0\n{POINTS}3 0 1 2\n".replace("\n", "\r\n"),
    "CR": f"OFF\n3 1 0\n{POINTS}3 0 1 2\n".replace("\n", "\r"),
    "mark": f"\ufeffOFF\n3 1 0\n{POINTS}3 0 1 2\n",
    "Latin-1": f"OFF\n# größe\n3 1 0\n{POINTS}3 0 1 2\n".encode("latin-1"),
    "UTF-16": f"OFF\n3 1 0\n{POINTS}3 0 1 2\n".encode("utf-16"),
    "a fourth coordinate divides": "4OFF\n3 1 0\n0 0 0 1\n2 0 0 2\n0 -.5 0 -.5\n3 0 1 2\n",
    "three dimensions": f"nOFF\n3\n3 1 0\n{POINTS}3 0 1 2\n",
    "two dimensions": "nOFF 2\n3 1 0\n0 0\n1 0\n0 1\n3 0 1 2\n",
    "four less one": "4nOFF 2\n3 1 0\n0 0 1\n2 0 2\n0 3 3\n3 0 1 2\n",
    "points and edges beside": f"OFF\n3 3 0\n{POINTS}1 0\n2 0 1\n3 0 1 2\n",
}


@pytest.mark.parametrize("name", FILES)
def test_files(read, name):
    made = read(FILES[name])
    assert made.warnings == []
    assert made.meshes[0].vertices[made.meshes[0].faces].tolist() == [CORNERS]


def test_normals_colours_and_coordinates(read):
    """In this order behind the place, whatever the order of the letters' meaning."""
    rows = "0 0 0 0 0 1 1 0 0 1 0 .5\n1 0 0 0 1 0 0 1 0 1 1 .5\n0 1 0 1 0 0 0 0 .25 1 0 1\n"
    (made,) = read(f"STCNOFF\n3 1 0\n{rows}3 0 1 2\n").meshes
    assert made.normals.tolist() == [[0, 0, 1], [0, 1, 0], [1, 0, 0]]
    assert made.uvs.tolist() == [[0, 0.5], [1, 0.5], [0, 1]]
    assert made.attributes["vertex_color"].tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 0.25]]


VERTEX_COLOURS = {
    "255 0 188 255": (1, 0, 0.5029),  # bytes through sRGB's curve
    "255 0 188": (1, 0, 0.5029),
    "1 0 .5 1": (1, 0, 0.5),
    "1 0 .5": (1, 0, 0.5),
}


@pytest.mark.parametrize("colour", VERTEX_COLOURS)
def test_colours_of_vertices(read, colour):
    rows = POINTS.replace("\n", f" {colour}\n")
    made = read(f"COFF\n3 1 0\n{rows}3 0 1 2\n")
    expected = np.tile(VERTEX_COLOURS[colour], (3, 1))
    np.testing.assert_allclose(made.meshes[0].attributes["vertex_color"], expected, atol=1e-4)
    assert made.warnings == []


def test_colours_of_faces(read):
    """Whole numbers are bytes, others are linear; a face without one is grey."""
    square = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
    (made,) = read(square + "4 0 1 2 3 255 0 188\n3 0 1 2\n").meshes
    expected = [[1, 0, 0.5029]] * 2 + [[0.597] * 3]
    np.testing.assert_allclose(made.attributes["face_color"], expected, atol=1e-3)
    (made,) = read(square + "4 0 1 2 3 .25 0 1 1\n3 0 1 2\n").meshes
    np.testing.assert_allclose(made.attributes["face_color"], [[0.25, 0, 1]] * 2 + [[0.6] * 3])


def test_what_is_left_out_is_told(read):
    told = read(f"OFF\n3 2 0\n{POINTS}3 0 1 2 7\n3 0 2 1 .5 0 0 .5\n").warnings
    assert told == ["colours of faces by their number in a list left out", "face alpha left out"]
    rows = POINTS.replace("\n", " 7\n")
    told = read(f"OFF\n3 1 0\n{rows}3 0 1 2\n").warnings
    assert told == ["1 further numbers of each vertex left out"]


def test_a_polygon_that_is_not_convex(read):
    corners = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    rows = "".join(f"{x} {y} 0\n" for x, y in corners)
    (made,) = read(f"OFF\n8 1 0\n{rows}8 0 1 2 3 4 5 6 7\n").meshes
    a, b, c = made.vertices[made.faces].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(7)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "it ends within its vertices"),
        ("hello", "a.off:1: .*not all words are numbers: 'hello'"),
        (b"OFF BINARY\n\0\0\0\3", "it is a binary OFF file; save it as text"),
        ("OFF 999999999 1 0\n0 0 0", "it ends within its 999999999 vertices"),
        (f"OFF 3 999999999 0\n{POINTS}3 0 1 2", "it ends within its"),
        (f"OFF 3 1 0\n{POINTS}999999999 0 1 2", "it ends within its 1 faces"),
        (f"OFF 3 1e99 0\n{POINTS}3 0 1 2", r"it has 1e\+99 faces"),
        (f"OFF 3 -1 0\n{POINTS}3 0 1 2", "it has -1 faces"),
        (f"OFF 3 1 0\n{POINTS}3 0 1 7", "outside 0 to 2"),
        (f"OFF 3 1 0\n{POINTS}3 0 1 -1", "outside 0 to 2"),
        (f"OFF 3 1 0\n{POINTS}3 0 1 1.5", "a face names vertex 1.5"),
        (f"OFF 3 1 0\n{POINTS}2 0 1", "holds no triangles"),
        (f"nOFF 4 3 1 0\n{POINTS}2 0 1", "its vertices have 4 dimensions, not 3"),
        ("4OFF 3 1 0\n0 0 0 1\n1 0 0 0\n0 1 0 1\n3 0 1 2", "not a finite number"),
        ("OFF\n\n3 1 0\n0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2", "a.off:5: .*decimal point, not a comma"),
        ("# 1\nOFF 3 1 0 x\n", "a.off:2: .*not all words are numbers: '3 1 0 x'"),
    ],
)  # fmt: skip
def test_bad_files(read, content, message):
    with pytest.raises(SceneError, match=message) as caught:
        read(content)
    assert "\n" not in str(caught.value)
