"""Mitsuba's .serialized meshes: as Mitsuba reads them, and broken ones."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats.mitsuba import mesh_files

VERTICES = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)])
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
UVS = np.array([(0, 0), (1, 0), (1, 0.75), (0, 0.75)])
NORMALS = np.array([(0, 0, 1), (0, 0.6, 0.8), (0, 0, 1), (0.6, 0, 0.8)])


def packed(version: int, real: str, *, uvs: bool, normals: bool, counts: tuple = (4, 2)) -> bytes:
    flags = (0x2000 if real == "<f8" else 0x1000) | (2 if uvs else 0) | (1 if normals else 0)
    body = struct.pack("<I", flags) + (b"a mesh\0" if version == 4 else b"")
    body += struct.pack("<QQ", *counts) + VERTICES.astype(real).tobytes()
    body += NORMALS.astype(real).tobytes() if normals else b""
    body += UVS.astype(real).tobytes() if uvs else b""
    return struct.pack("<HH", 0x041C, version) + zlib.compress(body + FACES.tobytes())


def file(path: Path, meshes: list[bytes], version: int) -> Path:
    starts = np.cumsum([0, *(len(m) for m in meshes[:-1])])
    table = starts.astype("<u8" if version == 4 else "<u4").tobytes()
    path.write_bytes(b"".join(meshes) + table + struct.pack("<I", len(meshes)))
    return path


def scene(path: Path, index: int, flat: str = "false") -> Path:
    made = path.with_suffix(".xml")
    made.write_text(
        f'<scene version="3.0.0"><shape type="serialized"><string name="filename" '
        f'value="{path.name}"/><integer name="shape_index" value="{index}"/>'
        f'<boolean name="face_normals" value="{flat}"/>'
        '<transform name="to_world"><translate x="2"/></transform></shape></scene>'
    )
    return made


@pytest.mark.peers
@pytest.mark.parametrize("version", [3, 4])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_as_mitsuba_reads_it(version: int, index: int, tmp_path: Path) -> None:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    meshes = [
        packed(version, "<f4", uvs=True, normals=False),
        packed(version, "<f8", uvs=True, normals=True),
        packed(version, "<f4", uvs=False, normals=True),
    ]
    path = scene(file(tmp_path / "two.serialized", meshes, version), index)
    ours = clpt.load(path).shapes[0]
    theirs = mi.traverse(mi.load_file(str(path)).shapes()[0])
    np.testing.assert_allclose(ours.vertices.ravel(), theirs["vertex_positions"], atol=1e-6)
    assert np.array_equal(ours.faces.ravel(), theirs["faces"])
    np.testing.assert_allclose(ours.normals.ravel(), theirs["vertex_normals"], atol=1e-6)
    if index < 2:
        np.testing.assert_allclose(ours.uvs.ravel(), theirs["vertex_texcoords"], atol=1e-6)
    assert (
        clpt.load(scene(path.with_suffix(".serialized"), index, "true")).shapes[0].normals is None
    )


def test_broken_files(tmp_path: Path) -> None:
    good = file(tmp_path / "a.serialized", [packed(4, "<f4", uvs=True, normals=True)], 4)
    whole = good.read_bytes()
    huge = packed(4, "<f4", uvs=True, normals=True, counts=(2**40, 2**33))
    cases = [b"", whole[:3], b"\0" * 40, whole[:-4] + b"\xff\xff\xff\xff", whole[:60] + whole[-12:]]
    cases += [file(tmp_path / "b.serialized", [huge], 4).read_bytes()]
    rng = np.random.default_rng(1)
    for _ in range(200):
        damaged = bytearray(whole)
        damaged[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        cases.append(bytes(damaged))
    failed = 0
    for case in cases:
        good.write_bytes(case)
        try:
            clpt.load(scene(good, 0))
        except SceneError:
            failed += 1
    assert failed >= 100
    good.write_bytes(whole)
    with pytest.raises(SceneError, match="has no mesh 3: it holds 1"):
        clpt.load(scene(good, 3))


def test_a_small_file_cannot_ask_for_much_memory(tmp_path: Path) -> None:
    """Zeros shrink to a thousandth."""
    body = struct.pack("<I", 0x1000) + b"a mesh\0" + struct.pack("<QQ", 10_000, 1)
    mesh = struct.pack("<HH", 0x041C, 4) + zlib.compress(body + bytes(132_000))
    path = file(tmp_path / "zeros.serialized", [mesh], 4)
    limits = budget.Budget(memory=1 << 16)
    with pytest.raises(SceneError, match="a mesh in it would take"), budget.opened(limits):
        mesh_files.read(path, 0, {})


def test_a_file_of_many_meshes_is_read_once(tmp_path: Path) -> None:
    """Each reading of a file costs parts of the budget, which 40 of them would exceed."""
    meshes = [packed(4, "<f8", uvs=True, normals=True)] * 40
    path = file(tmp_path / "many.serialized", meshes, 4)
    listing = "".join(
        f'<shape type="serialized"><string name="filename" value="{path.name}"/>'
        f'<integer name="shape_index" value="{index}"/></shape>'
        for index in range(40)
    )
    listed = tmp_path / "many.xml"
    listed.write_text(f'<scene version="3.0.0">{listing}</scene>')
    assert len(clpt.load(listed, budget=budget.Budget(parts=400)).shapes) == 40
