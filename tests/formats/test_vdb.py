"""OpenVDB's files: values, boxes, names and ways of packing; and what malformed ones say.

Files come from a small writer here. The reader was compared once with what OpenVDB 10 and its tool
nanovdb_convert write.
"""

from __future__ import annotations

import contextlib
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import volumes
from clpt.formats.volumes import sparse, vdb

LOW = np.array([-3, 5, 126])  # the index of the lowest value
VALUES = np.random.default_rng(1).random((6, 4, 9)).astype(np.float32)
VALUES[VALUES < 0.3] = 0.0
BACKGROUND = 0.0
SCALE = "UniformScaleTranslateMap", np.array([1, -2, 0.5, *[0.25] * 3, *[0.25] * 12])


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def metadata(values: dict[str, str]) -> bytes:
    held = (text(key) + text("string") + text(value) for key, value in values.items())
    return struct.pack("<I", len(values)) + b"".join(held)


def bits(mask: np.ndarray) -> bytes:
    return np.packbits(mask, bitorder="little").tobytes()


class Writer:
    """Writes a grid's tree. flags: as in the file; form: of its numbers, 'e' for halves."""

    def __init__(self, flags: int, form: str, background: float, way: int):
        self.flags, self.form, self.background, self.way = flags, form, background, way
        self.number = "f" if form == "e" else form

    def numbers(self, values: np.ndarray) -> bytes:
        raw = values.astype(np.dtype(self.form)).tobytes()
        if not self.flags & (vdb.ZIP | vdb.BLOSC):
            return raw
        if not len(values) and self.form == "e":
            return b""
        if self.flags & vdb.ZIP:
            packed = zlib.compress(raw)
        else:
            import blosc

            packed = blosc.compress(raw, typesize=4, cname="lz4") if raw else raw
        size = len(packed) if len(packed) < len(raw) else -len(raw)
        return struct.pack("<q", size) + (packed if size > 0 else raw)

    def values(self, values: np.ndarray, active: np.ndarray) -> bytes:
        """Values of a node, whose inactive ones are the background, in one of the ways."""
        way, back = self.way, struct.pack(f"<{self.number}", self.background)
        if way == 6 or not self.flags & vdb.ACTIVE_MASK:
            return bytes([6]) + self.numbers(values)
        other = struct.pack(f"<{self.number}", 99.0)  # which no value has
        told = {0: b"", 2: back, 3: b"", 4: other, 5: other + back}[way]
        if way in (3, 4, 5):
            told += bits(np.ones(len(values), bool))
        return bytes([way]) + told + self.numbers(values[active])

    def tree(self, values: np.ndarray, tile: float | None) -> tuple[bytes, bytes]:
        """Topology and leaves; with a tile of 8^3 at (-8, 0, 0)."""
        high = LOW + values.shape
        whole: dict[tuple[int, ...], np.ndarray] = {}
        for at in np.ndindex(*values.shape):
            index = LOW + at
            leaf = whole.setdefault(
                tuple(index // 8), np.full((8, 8, 8), self.background, values.dtype)
            )
            leaf[tuple(index % 8)] = values[at]
        assert (high <= 256).all()
        lowers = sorted({tuple(np.array(leaf) // 16) for leaf in whole} | {(-1, 0, 0)})
        uppers = sorted({tuple(np.array(lower) // 32) for lower in lowers})
        head = struct.pack(f"<I{self.number}II", 1, self.background, 0, len(uppers))
        leaves = b""
        for upper in uppers:
            head += struct.pack("<3i", *np.multiply(upper, 4096))
            inner = [one for one in lowers if tuple(np.array(one) // 32) == upper]
            inner.sort(key=lambda one: tuple(np.array(one) % 32))
            head += self.node(inner, 32, {})
            for lower in inner:
                own = [one for one in whole if tuple(np.array(one) // 16) == lower]
                own.sort(key=lambda one: tuple(np.array(one) % 16))
                has = lower == (-1, 0, 0) and tile is not None
                head += self.node(own, 16, {(-1, 0, 0): tile} if has else {})
                for leaf in own:
                    mask = whole[leaf].ravel() != self.background
                    head += bits(mask)
                    leaves += bits(mask) + self.values(whole[leaf].ravel(), mask)
        return head, leaves

    def node(self, inner: list, side: int, tiles: dict) -> bytes:
        child, active = np.zeros((2, side, side, side), bool)
        values = np.full((side,) * 3, self.background)
        for one in inner:
            child[tuple(np.array(one) % side)] = True
        for place, value in tiles.items():
            active[tuple(np.array(place) % side)] = True
            values[tuple(np.array(place) % side)] = value
        return bits(child) + bits(active) + self.values(values.ravel(), active.ravel())


def file_bytes(
    grids: dict[str, np.ndarray],
    flags: int = 0,
    form: str = "f",
    background: float = BACKGROUND,
    way: int = 0,
    moved: tuple[str, np.ndarray] = SCALE,
    tile: float | None = 0.5,
    shared: str = "",
    about: dict[str, str] | None = None,
    kind: str = "Tree_{}_5_4_3",
) -> bytes:
    """A file of some grids; shared: another name for the first grid's tree."""
    out = vdb.MAGIC + struct.pack("<IIIB", 224, 10, 0, 1) + b"-" * 36 + metadata({"by": "a test"})
    out += struct.pack("<I", len(grids) + bool(shared))
    named = kind.format("double" if form == "d" else "float") + (vdb.HALF if form == "e" else "")
    head, leaves = b"", b""
    for name, values in grids.items():
        topology, leaves = Writer(flags, form, background, way).tree(values, tile)
        head = struct.pack("<I", flags) + metadata(about or {"class": "fog volume"})
        head += text(moved[0]) + moved[1].astype("<f8").tobytes()
        out += text(name) + text(named) + text("")
        at = len(out) + 24
        middle = at + len(head) + len(topology)
        out += struct.pack("<3q", at, middle, middle + len(leaves)) + head + topology + leaves
    if shared:
        out += text(shared) + text(named) + text(next(iter(grids)))
        at = len(out) + 24
        end = at + len(head)
        out += struct.pack("<3q", at, end, end) + head
    return out


@pytest.fixture
def written(tmp_path):
    def of(name: str, data: bytes) -> Path:
        (tmp_path / name).write_bytes(data)
        return tmp_path / name

    return of


def the_values(found: object) -> np.ndarray:
    """Those at the places of VALUES; the box begins at the tile, (-8, 0, 0), and a layer before."""
    begin = LOW - [-8, 0, 0] + 1
    return found.values[tuple(map(slice, begin, begin + VALUES.shape))]


@pytest.mark.parametrize("flags", [0, 1, 2, 3, 4, 6])
def test_ways_of_packing(written, flags: int) -> None:
    """Values, a tile, and what is outside; floats, doubles and halves."""
    if flags & vdb.BLOSC:
        pytest.importorskip("blosc")
    for form in "fde" if flags in (0, 3) else "fe":
        found = volumes.read(written("a.vdb", file_bytes({"density": VALUES}, flags, form)))
        exact = VALUES.astype(np.float16) if form == "e" else VALUES
        assert np.array_equal(the_values(found), exact)
        assert found.values[1:9, 1:9, 1:9].min() == found.values[1:9, 1:9, 1:9].max() == 0.5
        assert not found.values[0].any() and not found.values[9:, :5].any()
        assert found.values.dtype == np.float32


@pytest.mark.parametrize("way", [0, 2, 3, 4, 5, 6])
def test_inactive_values(written, way: int) -> None:
    values = np.where(VALUES == 0.0, np.float32(0.75), VALUES)
    data = file_bytes({"density": values}, 3, background=0.75, way=way)
    found = volumes.read(written("a.vdb", data))
    assert np.array_equal(the_values(found), values)
    assert (found.values[0] == 0.75).all()


def test_names_and_places(written) -> None:
    """Several grids, one that shares a tree, and transforms of each kind."""
    grids = {"heat": 2 * VALUES, "density\x1e0": VALUES}
    path = written("a.vdb", file_bytes(grids, shared="again"))
    assert np.array_equal(the_values(volumes.read(path)), VALUES)
    for name in ("heat", "again"):
        assert np.array_equal(the_values(volumes.read(path, name)), 2 * VALUES)
    with pytest.raises(SceneError, match="'heat', 'density', 'again'"):
        volumes.read(path, "smoke")
    turned = np.array([[0.1, 0, 0, 0], [0, 0.2, 0.1, 0], [0, -0.1, 0.2, 0], [1, 2, 3, 1.0]])
    for kind, numbers, first in (
        (*SCALE, [-1.0, -2.0, 0.5]),
        ("ScaleMap", np.full(15, 2.0), [-16, 0, 0]),
        ("TranslationMap", np.array([1.0, 2.0, 3.0]), [-7, 2, 3]),
        ("AffineMap", turned, [0.2, 2.0, 3.0]),
    ):
        data = file_bytes({"density": VALUES}, moved=(kind, numbers))
        found = volumes.read(written("b.vdb", data))
        first_center = found.to_world @ [*(1.5 / np.array(found.values.shape)), 1.0]
        np.testing.assert_allclose(first_center[:3], first, atol=1e-12)


WHOLE = file_bytes({"density": VALUES}, 3)
PLACES = WHOLE.index(b"Tree_float_5_4_3") + 16 + 4  # of the grid's head, its leaves, and its end
(HEAD,) = struct.unpack_from("<q", WHOLE, PLACES)
NODE = (
    WHOLE.index(SCALE[0].encode()) + 24 + 144 + 16 + 12 + 2 * 4096
)  # the first upper one's values
BROKEN = {
    "is no .vdb file": b"something else",
    "ends too soon": WHOLE[:60],
    "goes beyond its end": WHOLE[:-5],
    "version 221": WHOLE[:8] + struct.pack("<I", 221) + WHOLE[12:],
    "as a stream": WHOLE[:20] + b"\0" + WHOLE[21:],
    "is a level set": file_bytes({"density": VALUES}, about={"class": "level set"}),
    "is a Tree_vec3s_5_4_3": file_bytes({"density": VALUES}, kind="Tree_vec3s_5_4_3"),
    "NonlinearFrustumMap": file_bytes(
        {"density": VALUES}, moved=("NonlinearFrustumMap", np.ones(3))
    ),
    "no inverse": file_bytes({"density": VALUES}, moved=("ScaleMap", np.zeros(15))),
    "not finite": file_bytes({"density": VALUES + np.float32(np.inf)}),
    "is negative": file_bytes({"density": -VALUES}),
    "in an unknown way": WHOLE[:NODE] + b"\7" + WHOLE[NODE + 1 :],
    "no active values": file_bytes({"density": 0 * VALUES}, tile=None),
}


@pytest.mark.parametrize("said", BROKEN)
def test_broken(written, said: str) -> None:
    with pytest.raises(SceneError, match=said) as caught:
        volumes.read(written("a.vdb", BROKEN[said]))
    assert caught.value.file is not None


def test_bombs_and_missing_codecs(written, monkeypatch) -> None:
    bomb = zlib.compress(bytes(1 << 26))
    data = WHOLE[: NODE + 1] + struct.pack("<q", len(bomb)) + bomb
    end = struct.pack("<2q", len(data), len(data))
    data = data[: PLACES + 8] + end + data[PLACES + 24 :]
    with pytest.raises(SceneError, match="not as many values"):
        volumes.read(written("a.vdb", data))
    far = struct.pack("<3i", -4096, 0, 0)
    with pytest.raises(SceneError, match="along an axis"):
        volumes.read(written("b.vdb", WHOLE.replace(far, struct.pack("<3i", 1 << 30, 0, 0))))
    monkeypatch.setitem(sys.modules, "blosc", None)
    packed = WHOLE[:HEAD] + struct.pack("<I", 6) + WHOLE[HEAD + 4 :]
    with pytest.raises(SceneError, match=r"clpt\[volumes\]"):
        volumes.read(written("c.vdb", packed))


def test_every_byte_may_be_wrong(written) -> None:
    """A file with any changed byte is read, or says what is wrong."""
    rng = np.random.default_rng(2)
    for _ in range(80):
        data = bytearray(WHOLE)
        data[rng.integers(0, len(data))] = rng.integers(0, 256)
        with contextlib.suppress(SceneError):
            volumes.read(written("a.vdb", bytes(data)))


def test_blosc_that_lies() -> None:
    blosc = pytest.importorskip("blosc")
    unpack = sparse.blosc_unpacked
    good = blosc.compress(bytes(4096), typesize=4)
    assert unpack(good, 4096) == bytes(4096)
    for data in (b"", good[:10], good[:-1], good[:4] + struct.pack("<I", 1 << 30) + good[8:]):
        with pytest.raises(SceneError, match="is damaged"):
            unpack(data, 4096)
