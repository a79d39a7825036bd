"""Damaged files of each format, made by what knows its structure.

Checksums and lengths of containers are made right again after what is inside was changed, so that
the readers behind them are reached. An input is a function of the format's name and a number.
"""

from __future__ import annotations

import base64
import contextlib
import copy
import gzip
import hashlib
import io
import json
import random
import re
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images, lenses, measured, spectra
from clpt.formats import ies, load, volumes
from clpt.formats.meshes import mesh, mtl_statements, spheres_curves
from clpt.formats.mitsuba.mesh_files import read as read_serialized
from clpt.images import read_stored
from clpt.images.spectral_exr import SpectralImage
from clpt.images.spectral_exr import read as read_spectral
from clpt.images.spectral_exr import write as write_spectral
from clpt.render.film import film_file

SCENES = Path(__file__).resolve().parents[1] / "scenes"
LENSES = Path(lenses.__file__).parent / "library"
Random = random.Random
INTEGERS = (0, 1, 2, 3, 7, 8, 127, 128, 255, 256, 32767, 65535, 65536, 2**31 - 1, 2**31, 2**32 - 1)
WORDS = (
    "0", "1", "-1", "nan", "inf", "-inf", "1e999", "1e-320", "1e38", "99999999999999999999", "0x10",
    "1,5", "", " ", "\n", "\0", "#", '"', "'", "[", "]", "{", "}", "<", ">", "&", "$", "\\", "/",
    "..", "true", "null", "\u00fc", "\ufeff", "*a", "&a", "a.png", "/dev/zero", "fuzz",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, 0, 1, -1, 2, 0.5, 1e999, -1e308, 10**30, 2**31, 2**53, "", "a", "../a", "a.png", [],
    {}, [0, 0, 0], [[]], [1e308] * 3, "data:,", "5126", 5126, "VEC3", "MAT4",
)  # fmt: skip


# What damages bytes, texts and JSON


def raw(rng: Random, data: bytes) -> bytes:
    """Bytes with some bits, numbers or runs changed, moved, doubled or cut."""
    made = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(made)) if made else 0
        way = rng.randrange(7)
        if way == 0 and made:
            made[at] ^= 1 << rng.randrange(8)
        elif way == 1 and made:
            made[at] = rng.choice((0, 1, 127, 128, 255))
        elif way == 2:
            form = rng.choice("<H >H <I >I <Q >Q <f >f <d".split())  # noqa: SIM905
            number = rng.choice(INTEGERS)
            number = float(number) if form[1] in "fd" else number % 256 ** struct.calcsize(form)
            new = struct.pack(form, number)
            made[at : at + len(new)] = new
        elif way == 3:
            end = at + rng.randint(0, 40)
            made[at:end] = made[at:end] * 2
        elif way == 4:
            del made[at : at + rng.randint(0, 40)]
        elif way == 5:
            made[at:at] = bytes(rng.randrange(256) for _ in range(rng.randint(1, 8)))
        else:
            other = rng.randrange(len(made)) if made else 0
            made[at : at + 16] = made[other : other + 16]
    if rng.random() < 0.1:
        del made[rng.randrange(len(made) + 1) :]
    return bytes(made)


def words(rng: Random, data: bytes) -> bytes:
    """A text with some words, or lines, changed, moved, doubled or left out."""
    split = rb"(\n)" if rng.random() < 0.3 else rb'([\s"<>=\[\](){},:]+)'
    parts = re.split(split, data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(parts))
        way = rng.randrange(5)
        if way == 0:
            parts[at] = rng.choice(WORDS).encode()
        elif way == 1:
            parts[at] = rng.choice(parts)
        elif way == 2:
            parts[at] *= rng.choice((0, 2, 50))
        elif way == 3:
            parts[at : at + 8] = parts[at : at + 8] * 2
        else:
            del parts[at : at + rng.randint(1, 8)]
            parts = parts or [b""]
    made = b"".join(parts)
    return raw(rng, made) if rng.random() < 0.1 else made


def value(rng: Random, document: Any) -> Any:
    """A JSON document with some values replaced by others, moved, or left out."""
    made = copy.deepcopy(document)
    for _ in range(rng.randint(1, 3)):
        places = list(_places(made))
        if not places:
            break
        owner, key = rng.choice(places)
        way = rng.randrange(5)
        if way == 0:
            owner[key] = copy.deepcopy(rng.choice(VALUES))
        elif way == 1:
            owner[key] = copy.deepcopy(rng.choice(places)[0])
        elif way == 2 and isinstance(owner, list):
            owner.insert(key, copy.deepcopy(owner[key]))
        elif way == 3 and isinstance(owner, list):
            del owner[key]
        elif isinstance(owner[key], (int, float)) and not isinstance(owner[key], bool):
            owner[key] = rng.choice((-owner[key], owner[key] + 1, owner[key] * 1000, *INTEGERS))
        elif isinstance(owner, dict):
            other = rng.choice(list(owner))
            owner[other] = owner.pop(key)
    return made


def _places(document: Any) -> list[tuple[Any, Any]]:
    """Every container of a document, and each of its keys."""
    found: list[tuple[Any, Any]] = []
    if isinstance(document, (dict, list)):
        items = document.items() if isinstance(document, dict) else enumerate(document)
        for key, inner in list(items):
            found.append((document, key))
            found += _places(inner)
    return found


def json_text(rng: Random, data: bytes) -> bytes:
    if rng.random() < 0.2:
        return words(rng, data)
    return json.dumps(value(rng, json.loads(data))).encode("utf-8", "surrogatepass")


# Containers, made right again


def gzipped(inner: Callable[[Random, bytes], bytes]) -> Callable[[Random, bytes], bytes]:
    def damage(rng: Random, data: bytes) -> bytes:
        if rng.random() < 0.1:
            return raw(rng, data)
        return gzip.compress(inner(rng, gzip.decompress(data)), 1)

    return damage


def png(rng: Random, data: bytes) -> bytes:
    chunks, at = [], 8
    while at + 8 <= len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        chunks.append([data[at + 4 : at + 8], data[at + 8 : at + 8 + size]])
        at += 12 + size
    for _ in range(rng.randint(1, 2)):
        i = rng.randrange(len(chunks))
        name, body = chunks[i]
        way = rng.randrange(5)
        if way == 0 and name == b"IDAT":
            with contextlib.suppress(zlib.error):  # one that was doubled, and changed
                chunks[i][1] = zlib.compress(raw(rng, zlib.decompress(body)))
        elif way < 3:
            chunks[i][1] = raw(rng, body)
        elif way == 3:
            chunks.insert(rng.randrange(len(chunks)), copy.copy(chunks[i]))
        else:
            new = rng.choice(
                (b"PLTE", b"tRNS", b"gAMA", b"cHRM", b"iCCP", b"sRGB", b"cICP", b"eXIf")
            )
            chunks.insert(1, [new, bytes(rng.randrange(256) for _ in range(rng.randint(0, 40)))])
    return data[:8] + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    )


def npy(rng: Random, data: bytes) -> bytes:
    """The header's text, with its length made right, or the numbers."""
    if rng.random() < 0.2:
        return raw(rng, data)
    size = int.from_bytes(data[8:10], "little")
    head = words(rng, data[10 : 10 + size]).rstrip(b"\n") + b"\n"
    if rng.random() < 0.4:
        kinds = ("<f4", "<f8", ">i2", "|O", "<U9", "|V8", "<c16", "<M8[s]", "|b1", "<f2", "|u1")
        shapes = ("()", "(0,)", "(3,)", "(-1, 3)", "(2, 2, 2, 3)", "(10**9,)", "(99999999999, 9)")
        described = (
            f"{{'descr': {rng.choice(kinds)!r}, 'fortran_order': {rng.choice((True, False))}"
        )
        head = f"{described}, 'shape': {rng.choice(shapes)}, }}\n".encode()
    head = head[:65000]
    return data[:8] + len(head).to_bytes(2, "little") + head + data[10 + size :]


def npz(rng: Random, data: bytes) -> bytes:
    if rng.random() < 0.3:
        return raw(rng, data)
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as held, zipfile.ZipFile(file, "w") as made:
        names = held.namelist()
        for name in names:
            body = held.read(name)
            body = npy(rng, body) if rng.random() < 0.6 else body
            shown = (
                rng.choice((*names, "../a.npy", "a", "vertex_a.npy"))
                if rng.random() < 0.1
                else name
            )
            ways = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
            made.writestr(shown, body, rng.choice(ways))
    whole = bytearray(file.getvalue())
    if rng.random() < 0.3:  # flags, ways to pack and sizes, which no checksum covers
        entry = whole.find(b"PK\x01\x02")
        at = entry + rng.choice((8, 10, 16, 20, 24, 42))
        whole[at : at + 2] = struct.pack("<H", rng.choice(INTEGERS) % 65536)
    return bytes(whole)


def serialized(rng: Random, data: bytes) -> bytes:
    """What deflate has packed of the only mesh, and the table behind it."""
    if rng.random() < 0.3:
        return raw(rng, data)
    body = zlib.decompressobj().decompress(data[4:])
    mesh = data[:4] + zlib.compress(raw(rng, body))
    return mesh + struct.pack("<QI", 0, 1)


def nvdb(rng: Random, data: bytes) -> bytes:
    from tests.formats.test_volumes import GRID, file_bytes

    if rng.random() < 0.2:
        return raw(rng, data)
    grid = bytearray(GRID)
    for _ in range(rng.randint(1, 6)):  # most of a grid is empty: heads, tables and leaves
        begin = rng.choice((0, 296, 600, 672, 736, 800, 9000, len(grid) - 40_000, len(grid) - 3000))
        at = begin + rng.randrange(200)
        new = struct.pack("<Q", rng.choice((rng.getrandbits(64), rng.getrandbits(24), *INTEGERS)))
        new = new[: rng.choice((1, 4, 8))]
        grid[at : at + len(new)] = new
    size = rng.choice((None, None, None, len(grid) - 1, 1 << 40))
    return file_bytes({"density": bytes(grid)}, rng.choice((0, 1)), size)


def vdb(rng: Random, data: bytes) -> bytes:
    """Where there is something: most of a tree's upper nodes is zero."""
    made = bytearray(data)
    told = [m.start() for m in re.finditer(rb"[^\0]{1,64}", data)]
    for _ in range(rng.randint(1, 5)):
        at = rng.choice(told) + rng.randrange(8)
        new = struct.pack("<Q", rng.choice((rng.getrandbits(64), rng.getrandbits(16), *INTEGERS)))
        new = new[: rng.choice((1, 1, 4, 8))]
        made[at : at + len(new)] = new
    return bytes(made if rng.random() < 0.9 else made[: rng.randrange(len(made))])


def film(rng: Random, data: bytes) -> bytes:
    """An EXR file behind which a seal stands that is right."""
    body = data[: -film_file.SEAL_BYTES]
    at = body.find(film_file.ATTRIBUTE.encode() + b"\0string\0")
    if rng.random() < 0.7:
        begin = at + len(film_file.ATTRIBUTE) + 8
        size = int.from_bytes(body[begin : begin + 4], "little")
        text = body[begin + 4 : begin + 4 + size]
        new = json_text(rng, text)[:size].ljust(size)  # offsets behind it stay right
        made = body[: begin + 4] + new + body[begin + 4 + size :]
    else:
        made = raw(rng, body)
    seal = film_file.SEAL + len(made).to_bytes(8, "little") + hashlib.sha256(made).digest()
    return made + seal


def exr(rng: Random, data: bytes) -> bytes:
    """Attributes of the head for the most part."""
    end = min(len(data), 400)
    if rng.random() < 0.7:
        return raw(rng, data[:end]) + data[end:]
    return raw(rng, data)


def glb(rng: Random, data: bytes) -> bytes:
    size = int.from_bytes(data[12:16], "little")
    text, rest = data[20 : 20 + size], data[28 + size :]
    if rng.random() < 0.1:
        return raw(rng, data)
    if rng.random() < 0.5:
        text = json.dumps(value(rng, json.loads(text))).encode("utf-8", "surrogatepass")
    else:
        rest = raw(rng, rest)
    return _glb(text, rest)


def _glb(text: bytes, rest: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    rest += b"\0" * (-len(rest) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(rest), b"BIN\0") + rest
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


# Whole files


def _made(name: str, write: Callable[[Path], Any]) -> bytes:
    """What a function writes into a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()


def _picture(channels: int = 3) -> np.ndarray:
    return np.random.default_rng(1).random((6, 7, channels)).astype(np.float32)


def _pillow(suffix: str, mode: str = "RGB", **options: Any) -> bytes:
    from PIL import Image

    kinds = {"RGB": 3, "RGBA": 4, "L": 1}
    pixels = (_picture(kinds.get(mode, 3)) * 255).astype(np.uint8)
    image = Image.fromarray(pixels[..., 0] if mode == "L" else pixels)
    return _made(f"a{suffix}", lambda path: image.convert(mode).save(path, **options))


def _ball(suffix: str) -> bytes:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=0)
    return _made(f"a{suffix}", lambda path: ball.export(path))


def _rich() -> Any:
    from tests.formats.gltf.conftest import Builder
    from tests.formats.gltf.test_fuzz import rich

    return rich(Builder)


def _draco() -> bytes:
    import DracoPy

    points = np.random.default_rng(1).random((12, 3)).astype(np.float32)
    faces = np.random.default_rng(2).integers(0, 12, (16, 3)).astype(np.uint32)
    data = DracoPy.encode(points, faces)
    packed = {"bufferView": 0, "attributes": {"POSITION": 0}}
    primitive = {
        "attributes": {"POSITION": 0},
        "extensions": {"KHR_draco_mesh_compression": packed},
    }
    return _of_view(data, {"buffer": 0, "byteLength": len(data)}, primitive, 12)


def _meshopt(mode: int = 1) -> bytes:
    from tests.formats.gltf.test_meshopt import ATTRIBUTES

    data = base64.b64decode(ATTRIBUTES[mode])
    packed = {
        "buffer": 0, "byteLength": len(data), "byteStride": 8, "count": 20, "mode": "ATTRIBUTES",
    }  # fmt: skip
    view = {
        "buffer": 1, "byteLength": 160, "byteStride": 8,
        "extensions": {"EXT_meshopt_compression": packed},
    }  # fmt: skip
    return _of_view(data, view, {"attributes": {"POSITION": 0}}, 20, 5122)


def _of_view(data: bytes, view: Any, primitive: Any, count: int, kind: int = 5126) -> bytes:
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}], "bufferViews": [view],
        "buffers": [{"byteLength": len(data)}, {"byteLength": 1 << 16}],
        "accessors": [{"componentType": kind, "count": count, "type": "VEC3"}],
    }  # fmt: skip
    if kind != 5126:
        document["accessors"][0]["bufferView"] = 0  # type: ignore[index]
    return _glb(json.dumps(document).encode(), data)


def _native() -> bytes:
    from clpt.formats import native

    with tempfile.TemporaryDirectory() as folder:
        native.save(load(SCENES / "plastic.xml"), Path(folder) / "a.json")
        return (Path(folder) / "a.json").read_bytes()


def _film() -> bytes:
    from tests.render.film.test_film_file import made

    return _made("a.film", lambda path: film_file.write(path, made()))


def _vol() -> bytes:
    head = struct.pack("<3sB5i6f", b"VOL", 3, 1, 2, 3, 4, 1, 0, 0, 0, 1, 1, 1)
    return head + np.ones(24, "<f4").tobytes()


def _vdb(flags: int) -> bytes:
    from tests.formats.test_vdb import VALUES, file_bytes

    return file_bytes({"density": VALUES}, flags)


def _nvdb() -> bytes:
    from tests.formats.test_volumes import GRID, file_bytes

    return file_bytes({"density": GRID})


def _serialized() -> bytes:
    from tests.formats.mitsuba.test_serialized import packed

    return packed(4, "<f4", uvs=True, normals=True) + struct.pack("<QI", 0, 1)


def _merl() -> bytes:
    return struct.pack("<3i", 3, 3, 4) + np.full(108, 0.1).tobytes()


def _spectral(path: Path) -> None:
    write_spectral(path, SpectralImage(_picture(), [400.0, 500.0, 600.0], True))


MTL = (
    b"newmtl m\nKd 0.5 0.5 0.5\nKs 0.1 0.1 0.1\nNs 20\nd 0.5\nillum 2\nmap_Kd -s 2 2 a.png\n"
    b"map_Bump -bm 0.5 b.png\nPr 0.3\n"
)
OBJ = (
    b"mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nvt 0 0\nvt 1 0\nvn 0 0 1\nusemtl m\n"
    b"s 1\nf 1/1/1 2/2/1 3//1\nf -1 -2 -3 -4\no part\ng a b\nl 1 2\n"
)
STL = (
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    b"endfacet\nendsolid a\n"
)
OFF = (
    b"COFF\n4 2 0\n0 0 0 1 0 0 1\n1 0 0 0 1 0 1\n0 1 0 0 0 1 1\n1 1 0 1 1 1 1\n3 0 1 2\n"
    b"3 1 2 3 0.5 0.5 0.5\n"
)
YML = (
    b"REFERENCES: a\nCOMMENTS: b\nDATA:\n  - type: formula 1\n    wavelength_range: 0.3 2.5\n"
    b"    coefficients: 0 0.7 0.0047 0.4 0.01 0.9 97.9\n  - type: tabulated k\n    data: |\n"
    b"        0.4 0.1\n        0.5 0.2\n        0.7 0.3\n"
)
CSV = b"wl,n\n0.4,1.5\n0.5,1.6\n0.7,1.7\n\nwl,k\n0.4,0.1\n0.7,0.2\n"
SPD = b"# a lamp\n400 0.1\n500 0.5\n600 0.7\n700 0.1\n"
SENSOR = b"400 0.1 0.2 0.9\n500 0.2 0.8 0.3\n600 0.9 0.4 0.1\n700 0.3 0.1 0\n"
IES = (
    b"IESNA:LM-63-2002\n[TEST] a\nTILT=NONE\n1 1000 1 3 2 1 2 0.1 0.1 0.1\n1 1 50\n0 45 90\n0 90\n"
    b"100 50 10\n90 40 5\n"
)
LDT = "\n".join(
    [
        "", "1", "1", "1", "0", "3", "90", *[""] * 5, *["0"] * 9, "100", "100", "1", "0", "1",
        "1", "LED", "2000", "3000", "80", "20", *["1"] * 10, "0", "0", "90", "180", *["500"] * 3,
    ]
).encode()  # fmt: skip
ROWS = (
    b"# a lens\n# radius thickness eta aperture\n35.98 1.21 1.54 23.7\n0 0.8 0 15\n"
    b"-30 3.5 1.62 20\n50 40 1 20\n"
)
ZMX = (
    b"VERS 1\nMODE SEQ\nUNIT MM\nSURF 0\n  DISZ INFINITY\nSURF 1\n  STOP\n  CURV 0.02\n  DISZ 5\n"
    b"  GLAS N-BK7\n  DIAM 10\nSURF 2\n  CURV -0.02\n  DISZ 40\n  DIAM 10\nSURF 3\n  DISZ 0\n"
)
STRANDS = b"0 0 0 0.1\n0 1 0 0.1\n0 2 0 0.05\n\n1 0 0 0.1\n1 1 0 0.2\n"
HAIR = b"BINARY_HAIR" + struct.pack("<I10f", 3, 0, 0, 0, 0, 0, 1, float("inf"), 2, 0, 0)
PLY_BINARY = (
    b"ply\nformat binary_little_endian 1.0\ncomment TextureFile a.png\nelement vertex 3\n"
    b"property float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face 1\n"
    b"property list uchar int vertex_indices\nend_header\n" + bytes(39)
    + b"\x03\0\0\0\0\1\0\0\0\2\0\0\0"
)  # fmt: skip


PLY_TEXT = (
    b"ply\nformat ascii 1.0\ncomment a\nelement vertex 3\nproperty float x\nproperty float y\n"
    b"property float z\nproperty float s\nproperty float t\nelement face 1\n"
    b"property list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n"
    b"0 1 0 0 1\n3 0 1 2\n"
)


@dataclass(frozen=True)
class Format:
    """A format: its suffix, whole files, what damages one, and what reads one."""

    suffix: str
    seeds: Callable[[], Sequence[bytes]]
    damage: Callable[[Random, bytes], bytes]
    read: Callable[[Path], Any]


def _scene(path: Path) -> Any:
    return load(path, missing_textures="grey")


def _image(*suffixes: str) -> Callable[[], Sequence[bytes]]:
    def seeds() -> Sequence[bytes]:
        return [_made(f"a{one}", lambda path: images.write(path, _picture())) for one in suffixes]

    return seeds


def _files(*names: str) -> Callable[[], Sequence[bytes]]:
    return lambda: [(SCENES / name).read_bytes() for name in names]


FORMATS: dict[str, Format] = {
    "json": Format(".json", lambda: [_native()], json_text, _scene),
    "mitsuba": Format(
        ".xml",
        _files("cornell.xml", "plastic.xml", "principled.xml", "spectra.xml", "thin_lens.xml"),
        words,
        _scene,
    ),
    "pbrt": Format(".pbrt", _files("cornell.pbrt"), words, _scene),
    "pbrt.gz": Format(
        ".pbrt.gz",
        lambda: [gzip.compress((SCENES / "cornell.pbrt").read_bytes())],
        gzipped(words),
        _scene,
    ),
    "gltf": Format(".gltf", lambda: [_rich().text().encode()], json_text, _scene),
    "glb": Format(".glb", lambda: [_rich().glb(), _ball(".glb")], glb, _scene),
    "draco": Format(".glb", lambda: [_draco()], glb, _scene),
    "meshopt": Format(".glb", lambda: [_meshopt(0), _meshopt(1)], glb, _scene),
    "obj": Format(".obj", lambda: [OBJ, _ball(".obj")], words, mesh.read_mesh),
    "mtl": Format(".mtl", lambda: [MTL], words, mtl_statements.read),
    "ply": Format(".ply", lambda: [PLY_BINARY, _ball(".ply")], raw, mesh.read_mesh),
    "ply text": Format(".ply", lambda: [PLY_TEXT], words, mesh.read_mesh),
    "ply.gz": Format(".ply", lambda: [gzip.compress(PLY_BINARY)], gzipped(raw), mesh.read_mesh),
    "stl": Format(".stl", lambda: [_ball(".stl")], raw, mesh.read_mesh),
    "stl text": Format(".stl", lambda: [STL], words, mesh.read_mesh),
    "off": Format(".off", lambda: [OFF], words, mesh.read_mesh),
    "serialized": Format(
        ".serialized",
        lambda: [_serialized()],
        serialized,
        lambda path: read_serialized(path, 0, {}),
    ),
    "strands": Format(".txt", lambda: [STRANDS], words, spheres_curves.read_strands),
    "hair": Format(".hair", lambda: [HAIR], raw, spheres_curves.read_hair),
    "spheres": Format(
        ".npz",
        lambda: [_made("a.npz", lambda p: np.savez(p, centers=np.ones((3, 3)), radii=np.ones(3)))],
        npz,
        spheres_curves.read_spheres,
    ),
    "densities npy": Format(
        ".npy",
        lambda: [_made("a.npy", lambda p: np.save(p, np.ones((2, 3, 4))))],
        npy,
        volumes.read,
    ),
    "vol": Format(".vol", lambda: [_vol()], raw, volumes.read),
    "vdb": Format(".vdb", lambda: [_vdb(flags) for flags in (0, 2, 3)], vdb, volumes.read),
    "nvdb": Format(".nvdb", lambda: [_nvdb()], nvdb, volumes.read),
    "png": Format(
        ".png",
        lambda: [
            _pillow(".png"),
            _pillow(".png", "L"),
            _pillow(".png", "RGBA"),
            _pillow(".png", "P"),
        ],
        png,
        read_stored,
    ),
    "jpg": Format(".jpg", lambda: [_pillow(".jpg")], raw, read_stored),
    "webp": Format(".webp", lambda: [_pillow(".webp")], raw, read_stored),
    "gif": Format(".gif", lambda: [_pillow(".gif")], raw, read_stored),
    "bmp": Format(".bmp", lambda: [_pillow(".bmp")], raw, read_stored),
    "tga": Format(".tga", lambda: [_pillow(".tga")], raw, read_stored),
    "tif": Format(
        ".tif",
        lambda: [_pillow(".tif"), _pillow(".tif", compression="tiff_lzw")],
        raw,
        read_stored,
    ),
    "exr": Format(".exr", _image(".exr"), exr, read_stored),
    "spectral exr": Format(".exr", lambda: [_made("a.exr", _spectral)], exr, read_spectral),
    "hdr": Format(".hdr", _image(".hdr"), raw, read_stored),
    "pfm": Format(".pfm", _image(".pfm"), raw, read_stored),
    "image npy": Format(".npy", _image(".npy"), npy, read_stored),
    "film": Format(".film", lambda: [_film()], film, film_file.read),
    "yml": Format(".yml", lambda: [YML], words, spectra.read_refractive_index),
    "csv": Format(".csv", lambda: [CSV], words, spectra.read_refractive_index),
    "spd": Format(".spd", lambda: [SPD], words, spectra.read_table),
    "sensor": Format(".csv", lambda: [SENSOR], words, spectra.read_sensor),
    "ies": Format(".ies", lambda: [IES], words, ies.read),
    "eulumdat": Format(".ldt", lambda: [LDT], words, ies.read_eulumdat),
    "lens dat": Format(".dat", lambda: [ROWS], words, lenses.read),
    "lens zmx": Format(".zmx", lambda: [ZMX], words, lenses.read),
    "lens txt": Format(
        ".txt", lambda: [next(LENSES.glob("*.txt")).read_bytes()], words, lenses.read
    ),
    "merl": Format(".binary", lambda: [_merl()], raw, measured.read_merl),
    "bsdf": Format(
        ".bsdf",
        lambda: [_made("a.bsdf", lambda p: measured.write(p, measured.grey()))],
        raw,
        measured.read,
    ),
}


@cache
def seeds(name: str) -> Sequence[bytes]:
    """The whole files of a format."""
    return FORMATS[name].seeds()


def damaged(name: str, number: int) -> bytes:
    """A damaged file of a format."""
    rng = Random(f"{name} {number}")
    return FORMATS[name].damage(rng, rng.choice(seeds(name)))
