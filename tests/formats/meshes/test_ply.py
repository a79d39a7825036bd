"""PLY files in all their forms, beside how trimesh reads them."""

from __future__ import annotations

import gzip
import struct

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats.meshes import ply

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
POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 2, 1)]
MIXED = [(0, 1, 2), (0, 2, 3, 4), (4, 3, 2, 1, 0)]
EVEN = [(0, 1, 2, 3), (4, 3, 2, 1)]
FANS = {  # triangles around the first corner
    "mixed": [(0, 1, 2), (0, 2, 3), (0, 3, 4), (4, 3, 2), (4, 2, 1), (4, 1, 0)],
    "even": [(0, 1, 2), (0, 2, 3), (4, 3, 2), (4, 2, 1)],
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
    with pytest.raises(SceneError, match="larger than 1 MiB when unpacked"):
        ply.read(path, largest=1 << 20)


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
