"""OBJ files by the format's text: every way to write the same mesh, and what is refused."""

from __future__ import annotations

import codecs
import itertools
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clpt.errors import SceneError
from clpt.formats.meshes import mesh, obj, triangles

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
UVS = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
WHOLE = SQUARE + "f 1 2 3 4\n"


@pytest.fixture
def read(tmp_path):
    """Write an .obj file and read its meshes."""

    def of(content, **options):
        path = tmp_path / "a.obj"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return mesh.read_mesh(path, **options)

    return of


def corners_of(made):
    """The corners of all triangles (t, 3, 3), float64."""
    return np.concatenate([part.vertices.astype(float)[part.faces] for part in made.meshes])


def area(made):
    a, b, c = corners_of(made).transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


NUMBERS = (
    "0 -0 -0.0 0.000 .5 5. -.25 +1.5 0.1 -0.3 1234567.875 0.0000001 16777217 -16777219.5 "
    "0.30000001192092896 123456789012345 9007199254740991 0.1000000000000000055 1e-3 .1E+2 3.4e38"
)


@pytest.mark.parametrize("words", [NUMBERS.split()[:14], NUMBERS.split()])
def test_numbers_are_rounded_as_float_rounds_them(tmp_path, words):
    """To float64, then to float32: whether all are short and without exponents, or not."""
    points = [f"v {word} {word} 1\n" for word in words]
    faces = [f"f 1 2 {i + 1}\n" for i in range(2, len(words))]
    path = tmp_path / "a.obj"
    path.write_text("".join([*points, *faces]))
    contents = obj.read(path)
    expected = np.array([float(word) for word in words], np.float64).astype(np.float32)
    np.testing.assert_array_equal(contents.vertices[:, 0].view("u4"), expected.view("u4"))


SAME = {
    "plain": WHOLE,
    "no newline at the end": WHOLE[:-1],
    "tabs": WHOLE.replace(" ", "\t"),
    "blanks": WHOLE.replace(" ", "  ").replace("\n", " \t\n\n"),
    "indented": "".join(f"\t  {line}\n" for line in WHOLE.splitlines()),
    "CR": WHOLE.replace("\n", "\r"),
    "CRLF": WHOLE.replace("\n", "\r\n"),
    "mixed ends": WHOLE.replace("\n", "\r\n", 2).replace("0\nv 0", "0\rv 0"),
    "form feed": WHOLE.replace("f 1", "\f\nf 1"),
    "end of file of DOS": WHOLE + "\x1a",
    "comments": WHOLE.replace("\n", " # v 9 9 9\n"),
    "comments without blank": WHOLE.replace("\n", "#f 1 2 3\n"),
    "indented comments": WHOLE.replace("\n", "\n  # v 9 9 9\n#\n"),
    "comment with a backslash": "# C:\\models\\\n" + WHOLE,
    "continued face": SQUARE + "f 1 2 \\\n 3 4\n",
    "continued in each word": WHOLE.replace(" ", " \\\n"),
    "continued with CRLF": SQUARE + "f 1 2 \\\r\n3\\\r\n 4\r\n",
    "continued at the end": WHOLE + "\\",
    "old faces": SQUARE + "fo 1 2 3 4\n",
    "signs": WHOLE.replace(" 1", " +1"),
    "exponents": "v 0e0 .0 -0.\nv 10e-1 0 0\nv .1E+1 1. 0\nv 0 100e-02 0\nf 1 2 3 4\n",
    "weights": "v 0 0 0 1\nv 1 0 0 .5\nv 1 1 0 1\nv 0 1 0 2\nf 1 2 3 4\n",
    "counted back": SQUARE + "f -4 -3 -2 -1\n",
    "counted both ways": SQUARE + "f 1 -3 3 -1\n",
    "counted back, twice": "v 9 9 9\n"
    + WHOLE.replace("f 1 2 3 4", "f -4 -3 -2\nv 8 8 8\nf -5 -3 -2"),
    "faces first": "f 1 2 3 4\n" + SQUARE,
    "empty corners": SQUARE + "f 1/ 2// 3/ 4\n",
    "groups": "o a\ng b c\ns 1\n" + WHOLE + "g\ns off\n",
    "other statements": "lod 1\nbevel on\nvp 0 0\n" + WHOLE,
    "vertices behind that are not used": WHOLE + "v 9 9 nan\n",
    "UTF-8 mark": codecs.BOM_UTF8 + WHOLE.encode(),
    "UTF-16": WHOLE.encode("utf-16"),
    "UTF-16 of the other order": codecs.BOM_UTF16_BE + WHOLE.encode("utf-16-be"),
    "Latin-1": "# geprüft\ng Stühle\n".encode("latin-1") + WHOLE.encode(),
    "Shift-JIS": "# 表\ng 表\n".encode("shift-jis") + WHOLE.encode(),
    "UTF-8": ("# 表 ü\ng 表\n" + WHOLE).encode(),
}


@pytest.mark.parametrize("name", SAME)
def test_ways_to_write_a_square(read, name):
    made = read(SAME[name])
    assert corners_of(made).shape == (2, 3, 3) and area(made) == 1.0
    assert corners_of(made).min() == 0.0 and corners_of(made).max() == 1.0
    assert made.warnings == []


@pytest.mark.parametrize("name", SAME)
def test_a_square_in_pieces(read, name, monkeypatch):
    """Where the file is cut into pieces changes nothing; each line is a piece of its own here."""
    monkeypatch.setattr(obj, "PIECE", 2)
    test_ways_to_write_a_square(read, name)


BAD = {
    "v 0 0 0\nv 1 0\n": (2, "'v' needs 3 numbers, and has 2"),
    "v 0 0 0\n\nvn 1 0\n": (3, "'vn' needs 3 numbers, and has 2"),
    "v\n": (1, "'v' needs 3 numbers, and has 0"),
    "vt\n": (1, "'vt' needs 1 numbers, and has 0"),
    "v 0 0 x\n": (1, "'x' is not a number"),
    "v 0 0 1_0\n": (1, "'1_0' is not a number"),
    "v 0 0 0x10\n": (1, "'0x10' is not a number"),
    "v 0 0 1-2\n": (1, "'1-2' is not a number"),
    "v 0 0 .\n": (1, "'.' is not a number"),
    "v 0 0 1e\n": (1, "'1e' is not a number"),
    "v 0 0 0\nv 1.#QNAN 0 0\nv 0 1 0\nf 1 2 3\n": (2, "'v' is not finite"),
    "v 0 0 0\nv -1.#IND00 0 0\nv 0 1 0\nf 1 2 3\n": (2, "'v' is not finite"),
    "v 0 0 \u22121\n": (1, "is not a number"),
    "v 0,5 0 0\n": (1, "write numbers with a decimal point, not a comma: '0,5 0 0'"),
    "# a\nvt 0,5 0,25\n": (2, "write numbers with a decimal point, not a comma"),
    "vn 0,0 0,0 1,0\n": (1, "write numbers with a decimal point, not a comma"),
    "v 0 \\\n0 0\nv 0 0 x\n": (3, "'x' is not a number"),
    "v 0 0 0\r\nv 0 0 x\r\n": (2, "'x' is not a number"),
    SQUARE + "f 1 2 5\n": (5, "'f' names the 'v' 5 of 4"),
    SQUARE + "f 1 2 3\n\n  f 1 2 99999999999999999999\n": (7, "'f' names the 'v' .* of 4"),
    SQUARE + "f 1 2 0\n": (5, "'0' names 0, but numbers begin at 1"),
    SQUARE + UVS + "f 1/1 2/0 3/1\n": (9, "'2/0' names 0"),
    SQUARE + "f 1 2 -5\n": (5, "'f' counts 5 back, beyond the first 'v'"),
    "v 0 0 0\nv 1 0 0\nf -3 -2 -1\nv 1 1 0\n": (3, "counts 3 back"),
    SQUARE + "vt 0 0\nf 1/1 2/1 3/2\n": (6, "'f' names the 'vt' 2 of 1"),
    SQUARE + "vt 0 0\nf 1/-1 2/-1 3/-2\n": (6, "counts 2 back, beyond the first 'vt'"),
    SQUARE + "vn 0 0 1\nf 1//1 2//1 3//7\n": (6, "'f' names the 'vn' 7 of 1"),
    SQUARE + "f 1 2 3.0\n": (5, "'3.0' is no corner such as"),
    SQUARE + "f 1 2 x\n": (5, "'x' is no corner"),
    SQUARE + "f 1,2,3\n": (5, "'1,2,3' is no corner"),
    SQUARE + "f 1/1/1/1 2 3\n": (5, "'1/1/1/1' is no corner"),
    SQUARE + "f 1///1 2 3\n": (5, "'1///1' is no corner"),
    SQUARE + "f /1 2 3\n": (5, "'/1' is no corner"),
    SQUARE + "f 1 / 2 3\n": (5, "'/' is no corner"),
    SQUARE + "f 1//1/1 2 3\n": (5, "'1//1/1' is no corner"),
    "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n": (2, "'v' is not finite"),
    "v 0 0 0\n v 1e39 0 0\nv 0 1 0\nf 1 2 3\n": (2, "'v' is not finite"),
    "v 0 0 0\n# v\nv 0 -inf 0\nv 0 1 0\nf 1 2 3\n": (3, "'v' is not finite"),
}


@pytest.mark.parametrize("content", BAD)
@pytest.mark.parametrize("piece", [obj.PIECE, 2])
def test_what_is_wrong_is_told_with_its_line(read, monkeypatch, content, piece):
    monkeypatch.setattr(obj, "PIECE", piece)
    line, message = BAD[content]
    with pytest.raises(SceneError, match=message) as caught:
        read(content)
    assert caught.value.line == line and "\n" not in str(caught.value)


EMPTY = {
    "": "0 vertices",
    "# nothing\n": "0 vertices",
    SQUARE: r"4 vertices \(v\), but no faces \(f\)",
    SQUARE + "p 1\nl 1 2\n": r"4 vertices .*left out: points \(p\), lines \(l\)",
    SQUARE + "f 1 2\nf 1\nf\n": "left out 3 faces of fewer than three corners",
    "hello world\n": "left out what OBJ does not know: hello",
    "\0" * 64: "0 vertices",
}


@pytest.mark.parametrize("content", EMPTY)
def test_files_without_triangles(read, content):
    with pytest.raises(SceneError, match=f"holds no triangles: .*{EMPTY[content]}") as caught:
        read(content)
    assert "\n" not in str(caught.value)


TOLD = {
    "vt 1.#QNAN 0\nf 1/1 2/1 3/1\n": [
        "a.obj: left out texture coordinates that are not finite",
        "2 triangles have no texture coordinates; (0, 0) stands for them",
    ],
    "l 1 2 3\n": ["left out: lines (l)"],
    "p 1\np 2\nl 1 2\n": ["left out: points (p), lines (l)"],
    "cstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\n": [
        "left out: curves and surfaces (cstype), curves (curv)"
    ],
    "call other.obj\n": ["left out: other files (call)"],
    "f 1 2\n": ["left out 1 faces of fewer than three corners"],
    "hello world\n": ["left out what OBJ does not know: hello"],
    "V 0 0 0\n": ["left out what OBJ does not know: V"],
    "f 1/1/1 2/2/1 3/3/1\n": [
        "left out the numbers of 'vt': the file has none",
        "left out the numbers of 'vn': the file has none",
    ],
    "usemtl red\nf 1 2 3\n": ["no library holds the material 'red'; grey stands for it"],
    "mtllib no.mtl\n": ["there is no library 'no.mtl': what it holds is left out"],
}


@pytest.mark.parametrize("content", TOLD)
def test_what_is_left_out_is_told_once(read, content):
    assert read(WHOLE + content).warnings == TOLD[content]


def test_each_number_of_a_corner_counts_back_from_its_own_line(read):
    text = (
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .1 0\nvt .2 0\nvt .3 0\nvn 0 0 1\n"
        "f -3/-3/-1 -2/-2/-1 -1/-1/-1\n"
        "v 5 0 0\nvt .4 0\nvn 0 1 0\nv 6 0 0\nv 5 1 0\nf -3/-1/-1 -2/-1/-2 -1/-4/-1\n"
    )
    (made,) = read(text).meshes
    np.testing.assert_allclose(made.vertices[made.faces][:, :, 0], [[0, 1, 0], [5, 6, 5]])
    np.testing.assert_allclose(
        made.uvs[made.faces][:, :, 0], np.float32([[0.1, 0.2, 0.3], [0.4, 0.4, 0.1]])
    )
    assert made.normals[made.faces][:, :, 1].tolist() == [[0, 0, 0], [1, 0, 1]]


@pytest.mark.parametrize("mixed", ["f 1/1 2/2 3/3\nf 1 3 4\n", "f 1/1 2/2 3/3\nf 1/1 3 4/4\n"])
def test_faces_without_coordinates_beside_others(read, mixed):
    made = read(SQUARE + UVS + mixed)
    (one,) = made.meshes
    assert one.uvs[one.faces][0].tolist() == [[0, 0], [1, 0], [1, 1]]
    assert made.warnings == ["1 triangles have no texture coordinates; (0, 0) stands for them"]
    assert one.uvs[one.faces][1, 1].tolist() == [0, 0]


def test_faces_without_normals_beside_others_are_flat(read):
    (made,) = read(SQUARE + "vn 1 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n").meshes
    shared = np.sqrt(0.5)
    np.testing.assert_allclose(made.normals[made.faces][0], [[shared, 0, shared]] * 3, rtol=1e-6)
    assert made.normals[made.faces][1].tolist() == [[0, 0, 1]] * 3


FOLD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\n"  # two squares at a right angle


@pytest.mark.parametrize(
    ("groups", "smooth"),
    [(("1", "1"), True), (("1", "2"), False), (("off", "0"), False), (("1", "off"), False)],
)
def test_smoothing_groups(read, groups, smooth):
    """ "vertices of one group share a normal", where the file has none; Mitsuba ignores groups."""
    text = FOLD + f"s {groups[0]}\nf 1 2 3 4\ns {groups[1]}\nf 1 4 6 5\n"
    (made,) = read(text).meshes
    if groups == ("off", "0"):
        assert made.normals is None
    else:
        # At the fold both squares have an angle of 90 degrees: the mean of their normals.
        expected = np.sqrt([0.5, 0.0, 0.5]) if smooth else [0, 0, 1]
        corner = made.vertices[made.faces[0]].tolist().index([0, 0, 0])
        np.testing.assert_allclose(made.normals[made.faces[0, corner]], expected, atol=1e-6)
    (whole,) = read(text, materials=False).meshes
    assert whole.normals is None


def test_normals_supersede_smoothing_groups(read):
    text = FOLD + "vn 0 0 1\nvn 1 0 0\ns 1\nf 1//1 2//1 3//1 4//1\nf 1//2 4//2 6//2 5//2\n"
    (made,) = read(text).meshes
    assert made.normals[made.faces][:, :, 2].tolist() == [[1] * 3] * 2 + [[0] * 3] * 2


@pytest.mark.parametrize(
    ("vt", "uv"), [("vt .5", [0.5, 0]), ("vt .5 .25", [0.5, 0.25]), ("vt .5 .25 9", [0.5, 0.25])]
)
def test_texture_coordinates_of_one_to_three_numbers(read, vt, uv):
    (made,) = read(SQUARE + f"vt 0 0\n{vt}\nf 1/1 2/2 3/2\n").meshes
    assert made.uvs[made.faces][0].tolist() == [[0, 0], uv, uv]


@pytest.mark.parametrize("tail", ["", " 1"])
@pytest.mark.parametrize("scale", [1, 255])
def test_colours_of_vertices(read, tail, scale):
    """Three numbers behind the place are sRGB, as Blender reads and MeshLab writes them."""
    rows = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    colours = [(scale, 0, 0), (0, scale, 0), (0, 0, scale * 0.5)]
    text = "".join(
        "v " + " ".join(map(str, (*row, *colour))) + tail + "\n"
        for row, colour in zip(rows, colours, strict=True)
    )
    made = read(text + "f 1 2 3\n")
    (one,) = made.meshes
    expected = [[1, 0, 0], [0, 1, 0], [0, 0, 0.21404]]  # .5 of sRGB (IEC 61966-2-1)
    np.testing.assert_allclose(one.attributes["vertex_color"], expected, atol=1e-4)
    assert one.material.front.reflectance.name == "vertex_color" and made.warnings == []


def test_vertices_with_and_without_colours(read):
    made = read("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nf 1 2 3\n")
    colours = made.meshes[0].attributes["vertex_color"]
    assert colours.tolist() == [[1, 0, 0], [1, 1, 1], [0, 0, 1]]
    assert made.warnings == ["vertices without a colour beside others with one are white"]


@pytest.mark.parametrize(
    ("outline", "size"),
    [
        ("0 0 3 0 3 3 2 3 2 1 1 1 1 3 0 3", 7.0),  # the letter U
        ("-1 -1 1 -1 1 1 0 -.5 -1 1", 2.5),  # V
        ("0 0 4 0 1 1 0 4", 4.0),  # a dart
        ("4 0 1 1 0 4 0 0", 4.0),
        ("0 0 2 0 2 1 1 1 1 2 0 2", 3.0),  # L
        ("0 0 1 0 1 1 0 1", 1.0),
    ],
)
@pytest.mark.parametrize("reversed_", [False, True])
def test_polygons_keep_their_shape(read, outline, size, reversed_):
    points = np.array(outline.split(), float).reshape(-1, 2)
    points = points[::-1] if reversed_ else points
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    placed = np.column_stack([points, np.full(len(points), 5.0)]) @ turn
    rows = "".join(f"v {x:.9f} {y:.9f} {z:.9f}\n" for x, y, z in placed)
    made = read(rows + "f " + " ".join(str(i + 1) for i in range(len(points))) + "\n")
    assert len(corners_of(made)) == len(points) - 2
    np.testing.assert_allclose(area(made), size, rtol=1e-5)


def test_a_mesh_for_each_material_in_the_order_of_the_file(read, tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    text = SQUARE + "mtllib a.mtl\nf 1 2 3\nusemtl blue\nf 1 2 3\nusemtl red\nf 1 3 4\nf 2 3 4\n"
    made = read(text + "usemtl blue\nf 2 4 3\nusemtl nothing\n")
    assert [part.name for part in made.meshes] == ["a.obj", "blue", "red"]
    assert [len(part.faces) for part in made.meshes] == [1, 2, 2]
    assert [part.material.front.name for part in made.meshes] == ["grey", "blue", "red"]
    (whole,) = read(text, materials=False).meshes
    assert len(whole.faces) == 4


def _written(draw, points, uvs, normals, faces):
    """Write a mesh in a random legal style; faces: lists of corners (vertex, uv, normal)."""
    blank = draw(st.sampled_from([" ", "\t", "  ", " \\\n"]))
    end = draw(st.sampled_from(["\n", "\r\n", " # end\n", "\n\n", "\t\n#\n"]))
    form = draw(st.sampled_from(["{:.9g}", "{:+.9e}", "{:.9E}"]))
    ahead, back = draw(st.booleans()), draw(st.booleans())
    rows = {"v": list(points), "vt": list(uvs), "vn": list(normals)}
    lines, written = [], {"v": 0, "vt": 0, "vn": 0}

    def write(key, until):
        for row in rows[key][written[key] : until]:
            lines.append(blank.join([key, *map(form.format, row)]))
        written[key] = max(written[key], until)

    for face in faces:
        for key, column in zip(rows, range(3), strict=True):
            needed = [corner[column] + 1 for corner in face if corner[column] is not None]
            write(key, len(rows[key]) if ahead else max(needed, default=0))
        words = []
        for corner in face:
            numbers = [
                "" if i is None else str(i - written[key] if back else i + 1)
                for key, i in zip(rows, corner, strict=True)
            ]
            words.append("/".join(numbers).rstrip("/"))
        lines.append(blank.join(["f", *words]))
    if draw(st.booleans()):  # everything is there before its face; or only at the end
        lines = (
            lines
            if back
            else [*[x for x in lines if x[0] == "f"], *[x for x in lines if x[0] != "f"]]
        )
    data = end.join(lines) + end
    mark = draw(st.booleans())
    return (codecs.BOM_UTF8 if mark else b"") + data.encode()


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_random_mesh_in_any_style_is_read_back(tmp_path_factory, data):
    draw = data.draw
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = rng.normal(size=(draw(st.integers(3, 12)), 3)).astype(np.float32)
    uvs = rng.random((draw(st.integers(1, 5)), 2)).astype(np.float32)
    normals = rng.normal(size=(draw(st.integers(1, 5)), 3)).astype(np.float32)
    with_uv, with_normal = draw(st.booleans()), draw(st.booleans())
    faces = []
    for _ in range(draw(st.integers(1, 8))):
        vertex = rng.permutation(len(points))[:3]
        uv = rng.integers(len(uvs), size=3) if with_uv else itertools.repeat(None)
        normal = rng.integers(len(normals), size=3) if with_normal else itertools.repeat(None)
        faces.append(list(zip(vertex.tolist(), uv, normal, strict=False)))
    path = tmp_path_factory.mktemp("obj") / "a.obj"
    path.write_bytes(_written(draw, points, uvs, normals, faces))
    piece, dense = draw(st.sampled_from([2, 64, obj.PIECE])), draw(st.sampled_from([0, 8]))
    with mock.patch.object(obj, "PIECE", piece), mock.patch.object(triangles, "DENSE", dense):
        made = mesh.read_mesh(path)
    (one,) = made.meshes
    assert made.warnings == []
    named = np.array([[corner[0] for corner in face] for face in faces])
    np.testing.assert_array_equal(one.vertices[one.faces], points[named])
    if with_uv:
        named = np.array([[corner[1] for corner in face] for face in faces])
        np.testing.assert_array_equal(one.uvs[one.faces], uvs[named])
    else:
        assert one.uvs is None
    if with_normal:
        named = np.array([[corner[2] for corner in face] for face in faces])
        unit = normals / np.linalg.norm(normals.astype(float), axis=1, keepdims=True)
        np.testing.assert_allclose(one.normals[one.faces], unit[named], atol=1e-6)
    else:
        assert one.normals is None


@settings(max_examples=300, deadline=None)
@given(
    st.lists(
        st.sampled_from(
            ["v ", "f ", "vt ", "vn ", "1", "-1", "0", "/", " ", "\n", "\\\n", "#", ".", "e", ",",
             "nan", "usemtl a\n", "mtllib b\n", "s 1\n", "v 0 0 0\n", "f 1 2 3\n", "\t", "\0", "é"]
        ),
        max_size=40,
    )
)  # fmt: skip
def test_no_text_crashes(tmp_path_factory, parts):
    path = tmp_path_factory.mktemp("obj") / "a.obj"
    path.write_text("".join(parts))
    try:
        mesh.read_mesh(path)
    except SceneError as error:
        assert "\n" not in str(error)
