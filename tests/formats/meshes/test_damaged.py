"""Files that are drawn by their formats' grammar, then damaged: a mesh, or an error of one line."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats.meshes import mesh
from clpt.formats.meshes.ply import TYPES
from tests.formats.fuzzing import check, damaged, hypothesis, settings, st

SOME = settings(80)
WORDS = st.sampled_from(
    "-1 0 1 3 4 255 65535 4294967295 1e999 nan inf 0,5 x # list uchar float face vertex "  # noqa: SIM905
    "tristrips element property comment TextureFile end_header facet solid endloop OFF 4 n".split()
)
NUMBERS = st.sampled_from([0, 1, 2, 3, 0, 1, 2, 3, -1, 0.5, 1e30, -2])
PLACES = st.sampled_from([0, 1, 2, 3, 4, -1, 0.5])
CORNERS = st.lists(st.sampled_from([0, 1, 2, 3] * 4 + [4, -1]), min_size=3, max_size=7)
NAMES = st.sampled_from("x y z nx ny nz u v s red green blue alpha r g b flags texnumber".split())  # noqa: SIM905
LISTS = st.sampled_from(["vertex_indices", "vertex_index", "texcoord", "other"])
WHOLE = st.sampled_from(["uchar", "char", "int", "uint", "ushort", "int16"])


def within(value, dtype):
    """A number as a type of numpy holds it."""
    kind = np.dtype(dtype)
    if kind.kind == "f":
        return kind.type(value)
    limits = np.iinfo(kind)
    return kind.type(min(max(int(value), limits.min), limits.max))


@st.composite
def ply_files(draw):
    """A PLY file of any elements, properties, types and form, whose header tells what is there."""
    form = draw(st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]))
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    head, body = ["ply", f"format {form} 1.0"], b""
    for element in draw(st.permutations(["vertex", "face", "tristrips", "edge"]))[
        : draw(st.integers(1, 4))
    ]:
        columns = []
        names = ["x", "y", "z"] if element == "vertex" else []
        names += draw(st.lists(NAMES, max_size=4, unique=True))
        columns += [
            (name, draw(st.sampled_from(sorted(TYPES))), None) for name in dict.fromkeys(names)
        ]
        if element != "vertex":
            lists = dict.fromkeys(["vertex_indices", *draw(st.lists(LISTS, max_size=1))])
            columns += [(name, draw(st.sampled_from(sorted(TYPES))), draw(WHOLE)) for name in lists]
        rows = draw(st.integers(0, 3)) + 4 * (element == "vertex")
        head.append(f"element {element} {rows}")
        head += [f"property {f'list {n} ' if n else ''}{kind} {name}" for name, kind, n in columns]
        for _ in range(rows):
            for name, kind, length in columns:
                given = CORNERS if name.startswith("vertex") else st.lists(NUMBERS, max_size=9)
                values = draw(given) if length else [draw(PLACES)]
                if form == "ascii":
                    given = [len(values), *values] if length else values
                    body += " ".join(map(str, given)).encode() + b" "
                    continue
                if length:
                    body += np.array([len(values)], order + TYPES[length]).tobytes()
                body += b"".join(
                    np.array([within(v, TYPES[kind])]).astype(order + TYPES[kind]).tobytes()
                    for v in values
                )
            body += b"\n" if form == "ascii" else b""
    return "\n".join([*head, "end_header"]).encode() + b"\n" + body


@st.composite
def stl_files(draw):
    """An STL file, text or binary."""
    corners = draw(st.lists(st.tuples(*[NUMBERS] * 9), max_size=4))
    if draw(st.booleans()):
        head = draw(st.sampled_from([b"solid", b"Solid Unity Mesh", b"COLOR=\xff\0\0\xff", b""]))
        count = draw(st.sampled_from([len(corners)] * 4 + [0, 7, 2**32 - 1]))
        rows = b"".join(
            struct.pack("<12fH", 0, 0, 1, *row, draw(st.sampled_from([0, 1, 0x8000, 0xFFFF])))
            for row in corners
        )
        return head.ljust(80, b"\0") + struct.pack("<I", count) + rows
    name = draw(st.sampled_from(["", "part", "solid facet", "größe"]))
    lines = [f"solid {name}"]
    for row in corners:
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += ["vertex " + " ".join(map(str, row[i : i + 3])) for i in (0, 3, 6)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}"]).encode(
        draw(st.sampled_from(["utf-8", "latin-1", "utf-16"]))
    )


@st.composite
def off_files(draw):
    """An OFF file with any header, one row a line or in free format."""
    kind = (
        draw(st.sampled_from(["", "ST"]))
        + draw(st.sampled_from(["", "C", "N", "CN", "4", "n"]))
        + "OFF"
    )
    width = 3 + 2 * ("ST" in kind) + 3 * ("N" in kind) + 4 * ("C" in kind) + ("4" in kind)
    vertices, faces = draw(st.integers(4, 6)), draw(st.integers(0, 4))
    rows = [f"{kind} 3" if "n" in kind else kind, f"{vertices} {faces} 0"]
    for _ in range(vertices):
        rows.append(" ".join(str(draw(PLACES)) for _ in range(width)))
    for _ in range(faces):
        corners = draw(CORNERS)
        colour = draw(st.lists(NUMBERS, max_size=4))
        rows.append(" ".join(map(str, [len(corners), *corners, *colour])))
    return draw(st.sampled_from(["\n", "\r\n", " "])).join(rows).encode()


FILES = {".ply": ply_files(), ".stl": stl_files(), ".off": off_files()}


def sound(path: Path) -> None:
    """Read a file; what is made of it fits together."""
    for made in mesh.read_mesh(path).meshes:
        assert made.faces.max() < len(made.vertices)
        assert np.isfinite(made.vertices).all()
        for name, values in made.attributes.items():
            assert len(values) == len(made.faces if name.startswith("face_") else made.vertices)
        for values in (made.normals, made.uvs):
            assert values is None or len(values) == len(made.vertices)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("suffix", FILES)
def test_files_as_they_are(tmp_path, suffix):
    @SOME
    @hypothesis.given(FILES[suffix])
    def run(content):
        check(tmp_path / f"a{suffix}", content, sound)

    run()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("suffix", FILES)
def test_damaged_files(tmp_path, suffix):
    @SOME
    @hypothesis.given(st.data())
    def run(data):
        content = data.draw(FILES[suffix])
        check(tmp_path / f"a{suffix}", data.draw(damaged(content, WORDS)), sound)

    run()


@pytest.mark.parametrize("suffix", FILES)
def test_files_that_end_early(tmp_path, suffix):
    """Every beginning of a file is read or refused."""

    @settings(10)
    @hypothesis.given(FILES[suffix])
    def run(content):
        for end in range(0, len(content), 7):
            check(tmp_path / f"a{suffix}", content[:end], sound)

    run()


@pytest.mark.parametrize("suffix", FILES)
def test_some_of_what_is_drawn_is_read(tmp_path, suffix):
    """Else the tests above would be of refusals alone."""
    outcomes = []

    @settings(100)
    @hypothesis.given(FILES[suffix])
    def run(content):
        (tmp_path / f"a{suffix}").write_bytes(content)
        try:
            sound(tmp_path / f"a{suffix}")
            outcomes.append(None)
        except SceneError as error:
            outcomes.append(error.message)

    run()
    assert outcomes.count(None) >= 10, set(outcomes)
    assert len(set(outcomes)) >= 4
