"""PLY files in all their forms, beside how trimesh reads them."""

from __future__ import annotations

import gzip
import struct

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats.meshes import ply
from clpt.formats.meshes.triangles import attributes

HEADER = """ply
format {} 1.0
comment made by hand
element vertex 5
property float x
property float y
property float z
property uchar red
property double u
property double v
element face {}
property int flags
property list {} int vertex_indices
end_header
"""
POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 1.5, 0)]
MIXED = [(0, 1, 2), (0, 2, 4, 3), (3, 4, 2, 1, 0)]
EVEN = [(0, 1, 2, 3), (3, 4, 2, 1)]
FANS = {  # triangles around the first corner
    "mixed": [(0, 1, 2), (0, 2, 4), (0, 4, 3), (3, 4, 2), (3, 2, 1), (3, 1, 0)],
    "even": [(0, 1, 2), (0, 2, 3), (3, 4, 2), (3, 2, 1)],
    "triangles": [(0, 1, 2), (2, 3, 4)],
}
FACES = {"mixed": MIXED, "even": EVEN, "triangles": FANS["triangles"]}


def content(form, faces, count="uchar"):
    head = HEADER.format(form, len(faces), count).encode()
    if form == "ascii":
        rows = [f"{x} {y} {z} 9 {x / 2} {y / 2}" for x, y, z in POINTS]
        rows += [f"{face[1]} {len(face)} " + " ".join(map(str, face)) for face in faces]
        return head + "\n".join(rows).encode()
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}3fB2d", *p, 9, p[0] / 2, p[1] / 2) for p in POINTS)
    letter = {"uchar": "B", "int": "i"}[count]
    for face in faces:
        body += struct.pack(f"{order}i{letter}{len(face)}i", face[1], len(face), *face)
    return head + body


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("packed", [False, True])
def test_forms(tmp_path, form, name, packed):
    data = content(form, FACES[name], "int" if packed else "uchar")
    path = tmp_path / "a.ply"
    path.write_bytes(gzip.compress(data) if packed else data)
    made = ply.read(path)
    assert made.vertices.tolist() == np.array(POINTS).tolist()
    assert [tuple(face) for face in made.faces] == FANS[name]
    assert made.uvs == pytest.approx(np.array(POINTS)[:, :2] / 2)
    assert made.normals is None
    assert (made.columns["vertex"]["red"] == 9).all()
    flags = [face[1] for face in FACES[name] for _ in face[2:]]  # a polygon's, of each triangle
    assert made.columns["face"]["flags"].tolist() == flags


@pytest.mark.parametrize("ends", ["\r\n", "\r"], ids=["CRLF", "CR"])
@pytest.mark.parametrize("form", FORMS)
def test_other_ends_of_lines(tmp_path, form, ends):
    path = tmp_path / "a.ply"
    data = content(form, MIXED)
    path.write_bytes(data)
    plain = ply.read(path)
    head, mark, body = data.partition(b"end_header\n")
    body = body.replace(b"\n", ends.encode()) if form == "ascii" else body
    path.write_bytes((head + mark).replace(b"\n", ends.encode()) + body)
    made = ply.read(path)
    assert (made.vertices == plain.vertices).all() and (made.faces == plain.faces).all()


def test_rows_that_are_longer_than_the_header_tells(tmp_path):
    """As of vertices with colours that the header does not name; trimesh reads them too."""
    path = tmp_path / "a.ply"
    head = HEADER.format("ascii", len(MIXED), "uchar")
    points = [f"{x} {y} {z} 9 0.5 0.5 255 128 0" for x, y, z in POINTS]
    faces = [f"7 {len(face)} {' '.join(map(str, face))} 1 2" for face in MIXED]
    path.write_text(head + "\n".join([*points, *faces]) + "\n\n")
    made = ply.read(path)
    assert made.vertices.tolist() == [list(point) for point in POINTS]
    assert made.faces.tolist() == [list(face) for face in FANS["mixed"]]


def test_what_is_packed_has_a_limit(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(gzip.compress(content("ascii", MIXED) + b"\n" * (1 << 21)))
    assert len(ply.read(path).faces)
    limits = budget.Budget(memory=1 << 20)
    with pytest.raises(SceneError, match="unpacking it would take"), budget.opened(limits):
        ply.read(path)


@pytest.mark.parametrize("form", FORMS)
def test_cut_files_are_refused(tmp_path, form):
    data = content(form, MIXED)
    path = tmp_path / "a.ply"
    for end in range(0, len(data) - 1, 7):
        path.write_bytes(data[:end])
        with pytest.raises(SceneError, match=r"cannot be read"):
            ply.read(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("element face 3", "element face 30000000000"),
        ("element vertex 5", "element vertex 99999999999"),
        ("property float x", "property list uchar float x"),
        ("property float y", "property float x"),
        ("format ascii", "format octal"),
        ("property int flags", "property int"),
    ],
)
@pytest.mark.parametrize("form", FORMS)
def test_wrong_headers_are_refused(tmp_path, old, new, form):
    path = tmp_path / "a.ply"
    data = content(form, MIXED)
    path.write_bytes(data.replace(old.replace("ascii", form).encode(), new.encode()))
    with pytest.raises(SceneError):
        ply.read(path)


def test_as_trimesh_reads(assets):
    trimesh = pytest.importorskip("trimesh")
    for name in ("cycloidal", "plane_tri"):
        path = assets / "meshes" / "trimesh" / f"{name}.ply"
        made, other = ply.read(path), trimesh.load(path, process=False)
        assert np.allclose(made.vertices, other.vertices)
        ours, theirs = (a[np.lexsort(a.T)] for a in (made.faces, np.asarray(other.faces)))
        assert (ours == theirs).all()


def written(*header: str, rows: str = "") -> bytes:
    head = ["ply", "format ascii 1.0", *header, "end_header"]
    return "\n".join(head).encode("latin-1") + b"\n" + rows.encode()


SQUARE = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n"
XYZ = ["property float x", "property float y", "property float z"]
LIST = "property list {} int vertex_indices"


def of(tmp_path, data):
    (tmp_path / "a.ply").write_bytes(data)
    return ply.read(tmp_path / "a.ply")


def table(form, dtype, order, columns, rows):
    """The lines of a header for a table of numbers, and its rows in a form."""
    names = [f"property {dtype} {name}" for name in columns]
    if form == "ascii":
        return names, "".join(" ".join(map(str, row)) + "\n" for row in rows).encode()
    return names, np.array(rows, order + np.dtype(TYPES[dtype]).str[1:]).tobytes()


TYPES = {"uchar": "u1", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
# 128 of 255 through sRGB's curve is .2159 (IEC 61966-2-1); floats are linear.
COLOURS = {
    "uchar": ((128, 0, 255), (0.2159, 0, 1)),
    "ushort": ((32896, 0, 65535), (0.2159, 0, 1)),
    "int": ((128, 0, 255), (0.2159, 0, 1)),
    "uint": ((32896, 0, 65535), (0.2159, 0, 1)),
    "float": ((0.25, 0, 3), (0.25, 0, 3)),
    "double": ((0.25, 0, 1), (0.25, 0, 1)),
}


@pytest.mark.parametrize(
    "names", ["red green blue", "r g b", "diffuse_red diffuse_green diffuse_blue"]
)
@pytest.mark.parametrize("dtype", COLOURS)
@pytest.mark.parametrize("form", FORMS)
def test_colours_mean_shares_of_their_type(tmp_path, form, dtype, names):
    colour, linear = COLOURS[dtype]
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    places, points = table(form, "double", order, "xyz", [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    colours, values = table(form, dtype, order, names.split(), [colour])
    indices = b"3 0 1 2" if form == "ascii" else b"\3" + np.array([0, 1, 2], order + "i4").tobytes()
    head = ["ply", f"format {form} 1.0", "element vertex 3", *places, "element face 1"]
    head += ["property list uchar int vertex_indices", *colours, "end_header"]
    values = b" " + values if form == "ascii" else values
    made = of(tmp_path, "\n".join(head).encode() + b"\n" + points + indices + values)
    assert attributes(made)["face_color"][0] == pytest.approx(linear, abs=1e-4)
    assert made.warnings == []


STRIPS = {
    "4 0 1 2 3": [[0, 1, 2], [2, 1, 3]],
    "9 0 1 2 -1 3 2 1 0 -1": [[0, 1, 2], [3, 2, 1], [1, 2, 0]],
    "7 0 1 2 2 2 1 3": [[0, 1, 2], [2, 1, 3]],  # what has no area joins two parts
    "3 -1 -1 0": [],
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("row", STRIPS)
def test_strips_of_triangles(tmp_path, row, form):
    """As Stanford's files have them: each vertex makes a triangle with the two before it."""
    data = written("element vertex 4", *XYZ, "element tristrips 2", LIST.format("int"), rows=SQUARE)
    data += (row + "\n3 0 1 3\n").encode()
    if form != "ascii":
        order = "<" if "little" in form else ">"
        head, _, body = data.replace(b"ascii", form.encode()).partition(b"end_header\n")
        words = body.split()
        data = head + b"end_header\n" + np.array(words[:12], float).astype(order + "f4").tobytes()
        data += np.array(words[12:], int).astype(order + "i4").tobytes()
    assert of(tmp_path, data).faces.tolist() == [*STRIPS[row], [0, 1, 3]]


def test_a_long_strip(tmp_path):
    """One list of 100,000 vertices, beside faces."""
    count = 100_000
    points = "".join(f"{i // 2} {i % 2} 0\n" for i in range(count))
    strip = f"{count} " + " ".join(map(str, range(count)))
    header = ["element vertex 100000", *XYZ, "element face 1", LIST.format("uchar")]
    header += ["property uchar red", "property uchar green", "property uchar blue"]
    header += ["element tristrips 1", LIST.format("int")]
    made = of(tmp_path, written(*header, rows=points + "4 0 2 3 1 9 9 9\n" + strip))
    assert len(made.faces) == 2 + count - 2 == len(made.columns["face"]["red"])
    corners = made.vertices[made.faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[2:, 2] < 0).all()


def test_a_polygon_that_is_not_convex(tmp_path):
    """The letter U: area 7; its column is that of all its triangles."""
    corners = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    rows = "".join(f"{x} {y} 0\n" for x, y in corners)
    header = ["element vertex 8", *XYZ, "element face 2", LIST.format("uchar"), "property int part"]
    made = of(tmp_path, written(*header, rows=rows + "8 0 1 2 3 4 5 6 7 5\n3 0 1 2 6\n"))
    a, b, c = made.vertices[made.faces[:-1]].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(7)
    assert made.columns["face"]["part"].tolist() == [5] * 6 + [6]


UV = "property list uchar float texcoord"


def test_texture_coordinates_of_corners(tmp_path):
    """As of photogrammetry: a vertex with two places in the image becomes two."""
    header = ["comment TextureFile my picture.png", "element vertex 4", *XYZ, "element face 2"]
    rows = SQUARE + "3 0 1 2 6 0 0 1 0 0 1\n3 2 1 3 6 0.5 0.5 1 0 1 1\n"
    made = of(tmp_path, written(*header, LIST.format("uchar"), UV, rows=rows))
    assert made.textures == ["my picture.png"] and made.warnings == []
    assert len(made.vertices) == 5
    corners = np.array(SQUARE.split(), float).reshape(-1, 3)
    assert made.vertices[made.faces].tolist() == corners[[[0, 1, 2], [2, 1, 3]]].tolist()
    assert made.uvs[made.faces].tolist() == [[[0, 0], [1, 0], [0, 1]], [[0.5, 0.5], [1, 0], [1, 1]]]


def test_faces_without_texture_coordinates_are_told(tmp_path):
    header = ["element vertex 4", *XYZ, "element face 2", LIST.format("uchar"), UV]
    made = of(tmp_path, written(*header, rows=SQUARE + "3 0 1 2 0\n3 2 1 3 6 0 0 1 0 1 1\n"))
    assert made.uvs[made.faces][1].tolist() == [[0, 0], [1, 0], [1, 1]]
    assert made.warnings == ["faces without texture coordinates have those of one point"]


def test_what_is_left_out_is_told(tmp_path):
    header = ["element vertex 4", *XYZ, "property uchar alpha", "property float quality"]
    header += ["element edge 1", "property int vertex1", "property int vertex2"]
    header += ["element face 1", LIST.format("uchar"), "property int material_index"]
    rows = "0 0 0 9 1\n1 0 0 255 1\n0 1 0 255 1\n1 1 0 255 1\n0 1\n3 0 1 2 7\n"
    made = of(tmp_path, written(*header, rows=rows))
    assert made.warnings == [
        "element 'edge' left out", "vertex alpha left out", "face material_index left out",
    ]  # fmt: skip
    assert made.faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_encodings(tmp_path, encoding):
    """The mark before the header; a letter that ends a line in some encodings."""
    header = ["comment größe \x85 TextureFile", "element vertex 4", *XYZ, "element face 1"]
    data = written(*header, LIST.format("uchar"), rows=SQUARE + "3 0 1 2\n").decode("latin-1")
    assert of(tmp_path, data.encode(encoding)).faces.tolist() == [[0, 1, 2]]


ROWS = SQUARE + "3 0 1 2\n"
FACE = ["element vertex 4", *XYZ, "element face 1", LIST.format("uchar")]


@pytest.mark.parametrize(
    ("header", "rows", "message"),
    [
        (FACE, ROWS.replace("1 0 0", "1,5 0 0"), ":11: .*decimal point, not a comma: '1,5 0 0'"),
        (FACE, ROWS.replace("1 0 0", "one 0 0"), ":11: .*not all words are numbers: 'one 0 0'"),
        (FACE, ROWS.replace("3 0 1 2", "3 0 1 2.5"), "a face names vertex 2.5"),
        (FACE, ROWS.replace("3 0 1 2", "3 0 1 nan"), "a face names vertex nan"),
        (FACE, ROWS.replace("3 0 1 2", "3 0 1 1e300"), "a face names vertex 1e\\+300"),
        (FACE, ROWS.replace("3 0 1 2", "1e18 0 1 2"), "it ends within 1 rows of 'face'"),
        (FACE, ROWS.replace("3 0 1 2", "nan 0 1 2"), "a list has nan values"),
        (FACE[:4], SQUARE, "it holds no triangles: its elements are 'vertex'"),
        (FACE[4:], "3 0 1 2", "it holds no triangles: it has no vertices with x, y and z"),
        ([*FACE, "who knows"], ROWS, ":9: .*its header has the line 'who knows'"),
    ],
)
def test_bad_ascii_files(tmp_path, header, rows, message):
    with pytest.raises(SceneError, match=message) as caught:
        of(tmp_path, written(*header, rows=rows))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("count", ["int", "uint", "char"])
def test_lengths_of_lists_take_no_memory(tmp_path, count):
    """A binary file that announces a list of as many values as its type holds."""
    dtype = {"int": "<i4", "uint": "<u4", "char": "<i1"}[count]
    head = written(*FACE[:-2], "element face 2", LIST.format(count))
    head = head.replace(b"ascii", b"binary_little_endian")
    points = np.array(SQUARE.split(), "<f4").tobytes()
    row = np.array([3], dtype).tobytes() + np.array([0, 1, 2], "<i4").tobytes()
    for value in (np.iinfo(dtype).max, np.iinfo(dtype).min or np.iinfo(dtype).max):
        many = np.array([value], dtype).tobytes() + bytes(12)
        for rows in (many, row + many):
            with pytest.raises(SceneError, match=r"within a list of \d+ values|has -\d+ values"):
                of(tmp_path, head + points + rows)


def test_lists_of_any_number_and_place(tmp_path):
    """Numbers before, between and behind two lists whose rows differ in length."""
    head = written("element vertex 4", *XYZ, "element face 3", "property short a", UV,
                   "property double b", LIST.format("int"), "property uchar red")  # fmt: skip
    data = head.replace(b"ascii", b"binary_big_endian") + np.array(SQUARE.split(), ">f4").tobytes()
    faces = [(7, (), 1.5, (0, 1, 2), 9), (-8, (1, 2), 2.5, (0, 2, 3, 1), 8), (9, (), -1, (), 7)]
    for a, uv, b, corners, red in faces:
        data += struct.pack(
            f">hB{len(uv)}fdi{len(corners)}iB", a, len(uv), *uv, b, len(corners), *corners, red
        )
    made = of(tmp_path, data)
    assert made.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 1]]
    face = made.columns["face"]
    assert (face["a"].tolist(), face["b"].tolist()) == ([7, -8, -8], [1.5, 2.5, 2.5])
    assert face["red"].tolist() == [9, 8, 8]
    for end in range(data.index(b"end_header") + 11, len(data)):
        with pytest.raises(SceneError, match="ends"):
            of(tmp_path, data[:end])
