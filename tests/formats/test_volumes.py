"""Densities in files: values, boxes and names; and what malformed ones say."""

from __future__ import annotations

import contextlib
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load, save, volumes
from clpt.formats.volumes import nvdb
from clpt.scene import media
from clpt.spectra import RGB, RGBUnbounded

VERSION = (32 << 21) | (3 << 10) | 3
SHARED = Path(__file__).resolve().parents[3] / "shared"
LOW = np.array([-3, 5, 126])  # the index of the lowest value
PACKED = {"fp4": 4, "fp8": 8, "fp16": 16, "fpn": 0}  # bits of a number
STEP, ORIGIN = 0.25, np.array([1.0, -2.0, 0.5])


def flags(mask: np.ndarray) -> bytes:
    return np.packbits(mask, bitorder="little").tobytes()


def leaf_bytes(held: np.ndarray, kind: str, bits: int = 8) -> tuple[int, bytes]:
    """What is in a leaf of a type: its flags, and its bytes behind the mask. bits: of FpN."""
    if kind not in PACKED:
        form = nvdb.LAYOUTS[kind].form
        return 0, bytes(nvdb.LAYOUTS[kind].values - 80) + held.astype(form).tobytes()
    width = PACKED[kind] or bits
    first, step = held.min(), np.ptp(held) / ((1 << width) - 1)
    codes = np.rint((held - first) / max(step, 1e-30)).astype(np.uint16).ravel()
    each = codes.view(np.uint8).reshape(512, 2)
    packed = np.packbits(
        np.unpackbits(each, axis=1, bitorder="little")[:, :width], bitorder="little"
    )
    flags = int(np.log2(width)) << 5 if kind == "fpn" else 0
    return flags, struct.pack("<2f4H", first, step, 0, 0, 0, 0) + packed.tobytes()


def grid_bytes(values: np.ndarray, kind: str = "float", name: str = "density") -> bytes:
    """A grid as a file holds it, with leaves wherever the box of `values` reaches.

    Every second leaf of the type fpn has 4 bits a number, the others 16.
    """
    layout = nvdb.LAYOUTS[kind]
    high = LOW + values.shape - 1
    box = struct.pack("<6i", *LOW, *high)
    leaves: dict[tuple[int, ...], np.ndarray] = {}
    for at in np.ndindex(*values.shape):
        index = LOW + at
        leaf = leaves.setdefault(tuple(index // 8), np.zeros((8, 8, 8), "<f4"))
        leaf[tuple(index % 8)] = values[at]
    lowers = sorted({tuple(np.array(leaf) // 16) for leaf in leaves})
    uppers = sorted({tuple(np.array(lower) // 32) for lower in lowers})
    at_root = nvdb.TREE
    at_upper = at_root + layout.root + nvdb.TILE * len(uppers)
    at_lower = at_upper + nvdb.UPPER * len(uppers)
    at_leaf = at_lower + nvdb.LOWER * len(lowers)
    tree = struct.pack(
        "<4q3I3IQ", at_leaf, at_lower, at_upper, at_root, len(leaves), len(lowers), len(uppers),
        0, 0, 0, values.size,
    )  # fmt: skip
    root = (box + struct.pack("<I", len(uppers))).ljust(layout.root, b"\0")
    tiles = upper_bytes = lower_bytes = all_leaves = b""
    begins = {}
    for i, (leaf, held) in enumerate(leaves.items()):
        flags_, data = leaf_bytes(held, kind, 4 if i % 2 else 16)
        begins[leaf] = at_leaf + len(all_leaves)
        head = struct.pack("<3i4B", *(np.array(leaf) * 8), 7, 7, 7, flags_)
        all_leaves += head + b"\xff" * 64 + data

    def node(own: int, inner: list, where: dict, side: int, table: int) -> bytes:
        child, offsets = np.zeros(side**3, bool), np.zeros(side**3, "<i8")
        for each in inner:
            x, y, z = np.array(each) % side
            child[(x * side + y) * side + z] = True
            offsets[(x * side + y) * side + z] = where[each] - own
        head = (box + bytes(8) + bytes(side**3 // 8) + flags(child)).ljust(table, b"\0")
        return head + offsets.tobytes()

    for i, upper in enumerate(uppers):
        own = at_upper + nvdb.UPPER * i
        key = 0
        for part, shift in zip(upper, (42, 21, 0), strict=True):
            key |= (int(part) % (1 << 20)) << shift
        tiles += struct.pack("<QqIfQ", key, own - at_root, 0, 0.0, 0)
        inner = [one for one in lowers if tuple(np.array(one) // 32) == upper]
        where = {one: at_lower + nvdb.LOWER * lowers.index(one) for one in inner}
        upper_bytes += node(own, inner, where, 32, 8256)
    for i, lower in enumerate(lowers):
        own = at_lower + nvdb.LOWER * i
        inner = [one for one in leaves if tuple(np.array(one) // 16) == lower]
        lower_bytes += node(own, inner, begins, 16, 1088)
    assert len(upper_bytes) == nvdb.UPPER * len(uppers)
    assert len(lower_bytes) == nvdb.LOWER * len(lowers)
    after = tree + root + tiles + upper_bytes + lower_bytes + all_leaves
    moved = [
        struct.pack(
            f"<22{form}", *(np.eye(3) * STEP).ravel(), *(np.eye(3) / STEP).ravel(), *ORIGIN, 1
        )
        for form in "fd"
    ]
    head = b"NanoVDB0" + struct.pack("<QIIIIQ", 0, VERSION, 0, 0, 1, nvdb.GRID + len(after))
    head += name.encode().ljust(256, b"\0") + b"".join(moved) + bytes(72)
    return (head + struct.pack("<II", 2, nvdb.TYPES.index(kind))).ljust(nvdb.GRID, b"\0") + after


def file_bytes(grids: dict[str, bytes], codec: int = 0, size: int | None = None) -> bytes:
    """A file of some grids; size: what it says of their length."""
    out = b""
    for name, grid in grids.items():
        packed = zlib.compress(grid) if codec == 1 else grid
        if codec == 2:
            import blosc

            packed = blosc.compress(grid, typesize=4)
        packed = struct.pack("<Q", len(packed)) + packed if codec else packed
        meta = struct.pack("<QQ", len(grid) if size is None else size, len(packed)).ljust(
            136, b"\0"
        )
        meta += struct.pack("<I", len(name) + 1).ljust(32, b"\0") + struct.pack(
            "<HHI", codec, 0, VERSION
        )
        out += b"NanoVDB0" + struct.pack("<IHH", VERSION, 1, codec) + meta + name.encode() + b"\0"
        out += packed
    return out


VALUES = np.random.default_rng(1).random((6, 4, 9), np.float32)
GRID = grid_bytes(VALUES)


@pytest.fixture
def written(tmp_path):
    def of(name: str, data: bytes) -> Path:
        (tmp_path / name).write_bytes(data)
        return tmp_path / name

    return of


@pytest.mark.parametrize("codec", [0, 1, 2])
def test_nvdb(written, codec: int) -> None:
    """Values across the borders of leaves, lower and upper nodes, and where they are."""
    if codec == 2:
        pytest.importorskip("blosc")
    path = written("a.nvdb", file_bytes({"heat": grid_bytes(2 * VALUES), "density": GRID}, codec))
    assert nvdb.names(path) == ("heat", "density")
    found = volumes.read(path)
    assert np.array_equal(found.values[1:-1, 1:-1, 1:-1], VALUES)
    assert not found.values[0].any() and not found.values[..., -1].any()
    first_center = found.to_world @ [*(1.5 / np.array(found.values.shape)), 1.0]
    np.testing.assert_allclose(first_center[:3], LOW * STEP + ORIGIN)
    assert np.array_equal(volumes.read(path, "heat").values[1:-1, 1:-1, 1:-1], 2 * VALUES)
    with pytest.raises(SceneError, match="'heat', 'density'"):
        volumes.read(path, "smoke")
    bare = written("b.nvdb", b"NanoVDB1" + GRID[8:])
    assert np.array_equal(volumes.read(bare).values, found.values)


@pytest.mark.parametrize("kind", ["double", "half", *PACKED])
def test_nvdb_types(written, kind: str) -> None:
    """Numbers of other sizes, and packed ones: within half a step of their leaf."""
    found = volumes.read(written("a.nvdb", file_bytes({"density": grid_bytes(VALUES, kind)})))
    step = {"double": 0.0, "half": 2.0**-11, "fp4": 1 / 15, "fpn": 1 / 15, "fp8": 1 / 255}
    off = np.abs(found.values[1:-1, 1:-1, 1:-1] - VALUES).max()
    assert off <= 0.501 * step.get(kind, 1 / 65535)
    assert kind == "double" or off > 1e-6


def changed(at: int, form: str, value: float) -> bytes:
    data = bytearray(GRID)
    struct.pack_into(form, data, at, value)
    return file_bytes({"density": bytes(data)})


ROOT = nvdb.GRID + nvdb.TREE
LEAF = len(GRID) - nvdb.LAYOUTS["float"].leaf
BROKEN = {
    "is no .nvdb file": b"something else",
    "ends too soon": file_bytes({"density": GRID})[:100],
    "goes beyond its end": file_bytes({"density": GRID})[:-5],
    "bytes as it says": file_bytes({"density": GRID}, codec=1, size=len(GRID) - 8),
    "cannot have": file_bytes({"density": GRID}, codec=1, size=1 << 60),
    "packed in an unknown way": file_bytes({"density": GRID}, codec=7),
    "is a grid of vec3f": changed(636, "<I", 6),
    "root is beyond": changed(nvdb.GRID + 24, "<q", 1 << 40),
    "its root goes beyond": changed(ROOT + 24, "<I", 1 << 30),
    "no active values": changed(ROOT, "<i", 1000),
    "at most": changed(ROOT, "<i", -(1 << 30)),
    "a node is beyond": changed(ROOT + nvdb.ROOT + 8, "<q", -(1 << 50)),
    "is a level set": changed(632, "<I", 1),
    "no inverse": changed(296 + 88, "<d", 0.0),
    "not finite": changed(LEAF + 96, "<f", np.nan),
    "is negative": changed(LEAF + 96, "<f", -1.0),
}


@pytest.mark.parametrize("said", BROKEN)
def test_broken_nvdb(written, said: str) -> None:
    with pytest.raises(SceneError, match=said) as caught:
        volumes.read(written("a.nvdb", BROKEN[said]))
    assert caught.value.file is not None


def test_bombs_and_missing_codecs(written, monkeypatch) -> None:
    bomb = zlib.compress(bytes(1 << 26))
    bomb = file_bytes({"density": GRID}).replace(GRID, struct.pack("<Q", len(bomb)) + bomb)
    data = bytearray(bomb)
    struct.pack_into("<H", data, 16 + 168, 1)
    struct.pack_into("<Q", data, 16 + 8, len(bomb) - 16 - 176 - 8)
    with pytest.raises(SceneError, match="bytes as it says"):
        volumes.read(written("a.nvdb", bytes(data)))
    monkeypatch.setitem(sys.modules, "blosc", None)
    bare = bytearray(file_bytes({"density": GRID}))
    struct.pack_into("<H", bare, 16 + 168, 2)
    with pytest.raises(SceneError, match=r"clpt\[volumes\]"):
        volumes.read(written("b.nvdb", bytes(bare)))


def test_every_byte_may_be_wrong(written) -> None:
    """A file with any changed byte in its heads is read, or says what is wrong."""
    whole = file_bytes({"density": GRID})
    rng = np.random.default_rng(2)
    begin = 16 + nvdb.METADATA + 8
    for _ in range(60):
        data = bytearray(whole)
        head = rng.integers(0, 3) > 0
        at = rng.integers(0, begin) if head else begin + rng.choice([636, 672, 700, 736, 800, 9000])
        data[at] = rng.integers(0, 256)
        with contextlib.suppress(SceneError):
            volumes.read(written("a.nvdb", bytes(data)))


def vol_bytes(values: np.ndarray, box=(0, 0, 0, 1, 1, 1), version: int = 3) -> bytes:
    nx, ny, nz, channels = values.shape
    head = volumes.VOL_HEADER.pack(b"VOL", version, 1, nx, ny, nz, channels, *box)
    return head + np.ascontiguousarray(values.transpose(2, 1, 0, 3), "<f4").tobytes()


def test_vol(written) -> None:
    path = written("a.vol", vol_bytes(VALUES[..., None], (1, 2, 3, 2, 4, 6)))
    found = volumes.read(path)
    assert np.array_equal(found.values, VALUES)
    np.testing.assert_allclose(found.to_world @ [1, 1, 1, 1], [2, 4, 6, 1])
    for data, said in (
        (b"VOX", "begin with VOL"),
        (vol_bytes(VALUES[..., None], version=2), "version 2"),
        (vol_bytes(VALUES[..., None])[:-4], "must have"),
        (vol_bytes(np.repeat(VALUES[..., None], 3, 3)), "3 channels"),
        (vol_bytes(VALUES[..., None], (0, 0, 0, 0, 1, 1)), "box is empty"),
    ):
        with pytest.raises(SceneError, match=said):
            volumes.read(written("b.vol", data))


def test_npy_and_others(tmp_path, written) -> None:
    np.save(tmp_path / "a.npy", VALUES)
    assert np.array_equal(volumes.read(tmp_path / "a.npy").values, VALUES)
    np.save(tmp_path / "b.npy", VALUES[0])
    for name, said in (("b.npy", "nx, ny, nz"), ("c.npy", "cannot be read"), ("d.abc", "known")):
        with pytest.raises(SceneError, match=said):
            volumes.read(tmp_path / name)


SCENE = """{"camera": {"type": "perspective"}, "media": {"smoke": {"type": "grid", "sigma_t": 2,
"density": "%s", "to_world": [{"translate": [1, 0, 0]}]}},
"shapes": [{"type": "sphere", "interior": "smoke", "material": {"type": "null"}}]}"""


def test_scene_files(tmp_path, written) -> None:
    """A density in scene.json, its box moved; it is saved beside the file."""
    written("a.nvdb", file_bytes({"heat": grid_bytes(2 * VALUES), "density": GRID}))
    path = written("scene.json", (SCENE % "a.nvdb#heat").encode())
    medium = load(path).shapes[0].interior
    box = volumes.read(tmp_path / "a.nvdb").to_world
    np.testing.assert_allclose(medium.to_world[:3, 3], box[:3, 3] + [1, 0, 0])
    assert np.array_equal(medium.density[1:-1, 1:-1, 1:-1], 2 * VALUES)
    save(load(path), tmp_path / "again.json")
    again = load(tmp_path / "again.json").shapes[0].interior
    assert np.array_equal(again.density, medium.density)
    np.testing.assert_allclose(again.to_world, medium.to_world)
    with pytest.raises(SceneError, match=r"a.nvdb.*no grid 'x'"):
        load(written("scene.json", (SCENE % "a.nvdb#x").encode()))


PBRT = """Camera "perspective"
WorldBegin
Translate 1 2 3
MakeNamedMedium "fog" "string type" "%s" "float scale" 2 "rgb sigma_a" [1 2 3] %s
MediumInterface "fog" ""
Material "interface"
Shape "sphere"
"""


def test_pbrt(written) -> None:
    numbers = " ".join(map(str, range(6)))
    more = f'"integer nx" 3 "integer ny" 2 "integer nz" 1 "float density" [{numbers}]'
    corners = '"point3 p0" [0 0 0] "point3 p1" [3 4 5]'
    medium = load(written("a.pbrt", (PBRT % ("uniformgrid", more + corners)).encode())).shapes[0]
    medium = medium.interior
    assert medium.density[1:-1, 1:-1, 1:-1].ravel().tolist() == [0, 3, 1, 4, 2, 5]
    np.testing.assert_allclose(medium.to_world @ [0, 0, 0, 1], [0, 0, -2, 1])
    np.testing.assert_allclose(medium.to_world @ [1, 1, 1, 1], [5, 8, 13, 1])
    with pytest.raises(SceneError, match="has 6 numbers"):
        wrong = more.replace('nz" 1', 'nz" 2')
        load(written("a.pbrt", (PBRT % ("uniformgrid", wrong)).encode()))
    written("a.nvdb", file_bytes({"density": GRID}, 1))
    made = load(written("a.pbrt", (PBRT % ("nanovdb", '"string filename" "a.nvdb"')).encode()))
    density = made.shapes[0].interior.density
    assert np.array_equal(density[1:-1, 1:-1, 1:-1], VALUES)


MITSUBA = """<scene version="3.0.0"><shape type="cube"><bsdf type="null"/>
<medium name="interior" type="heterogeneous"><volume name="sigma_t" type="gridvolume">
<string name="filename" value="a.vol"/><transform name="to_world"><scale value="2"/></transform>%s
</volume><float name="scale" value="5"/></medium></shape></scene>"""


def test_mitsuba(written) -> None:
    """A grid of one channel, of colours that a factor divides, and of others."""
    path = written("a.xml", (MITSUBA % "").encode())
    written("a.vol", vol_bytes(VALUES[..., None]))
    medium = load(path).shapes[0].interior
    assert (medium.kind, medium.scale) == ("grid", 5.0)
    assert np.array_equal(medium.density, VALUES)
    np.testing.assert_allclose(medium.to_world @ [1, 1, 1, 1], [2, 2, 2, 1])
    written("a.vol", vol_bytes(VALUES[..., None] * np.array([1.0, 2.0, 3.0], np.float32)))
    medium = load(path).shapes[0].interior
    colours = medium.density.max() * medium.sigma_t.to_rgb("unbounded")
    np.testing.assert_allclose(colours, VALUES.max() * np.array([1.0, 2.0, 3.0]), rtol=1e-5)
    given = np.random.default_rng(3).random((2, 2, 2, 3), np.float32)
    written("a.vol", vol_bytes(given))
    medium = load(path).shapes[0].interior
    colours = medium.density[..., None] * medium.color_grid * medium.sigma_t.to_rgb("unbounded")
    np.testing.assert_allclose(colours, given, rtol=1e-5)
    lambdas, point = np.linspace(400.0, 700.0, 7), (1, 0, 1)
    share = RGB(*medium.color_grid[point].tolist()).sample(lambdas)
    expected = RGBUnbounded(*given.transpose(2, 1, 0, 3)[point].tolist()).sample(lambdas)
    spectrum = medium.density[point] * medium.sigma_t.sample(lambdas) * share
    np.testing.assert_allclose(spectrum, expected, rtol=2e-3)


OURS = """<scene version="3.0.0"><shape type="cube"><bsdf type="null"/>
<medium name="interior" type="%s">%s</medium></shape></scene>"""
VOLUME = """<volume name="%s" type="gridvolume"><string name="filename" value="a.vol"/></volume>"""


def test_mitsuba_light(written) -> None:
    """Words of our own: light, its temperatures, soot, and 8 bits a number."""

    def made(kind: str, *words: str) -> media.Grid:
        return load(written("a.xml", (OURS % (kind, "".join(words))).encode())).shapes[0].interior

    written("a.vol", vol_bytes(100.0 * VALUES[..., None]))
    glow = '<rgb name="emission" value="1, 2, 3"/>'
    emission = made("homogeneous", glow).emission
    assert (emission.r, emission.g, emission.b) == (1.0, 2.0, 3.0)
    bits = '<integer name="bits" value="8"/>'
    lit = made("heterogeneous", VOLUME % "sigma_t", VOLUME % "emission_grid", glow, bits)
    assert (lit.kind, lit.bits) == ("grid", 8)
    assert np.array_equal(lit.emission_grid, lit.density)
    warm = made("heterogeneous", VOLUME % "temperature", '<float name="brightness" value="2"/>')
    assert np.array_equal(warm.temperature, 100.0 * VALUES)
    assert (warm.density.min(), warm.brightness, warm.normalised) == (1.0, 2.0, False)
    flame = made("soot", VOLUME % "density", VOLUME % "temperature")
    assert (flame.kind, flame.share, flame.density.shape) == ("soot", 1e-6, VALUES.shape)
    for wrong, message in (
        (bits.replace("8", "7"), "must be 16 or 8"),
        ('<float name="brightness" value="2"/>', "brightness"),  # of no temperature
    ):
        with pytest.raises(SceneError, match=message):
            made("heterogeneous", VOLUME % "sigma_t", wrong)
    written("a.vol", vol_bytes(np.ones((2, 2, 2, 3))))
    with pytest.raises(SceneError, match="3 channels; read is 1"):
        made("heterogeneous", VOLUME % "temperature")


DYE = """<spectrum name="absorption" value="300:0.7, 350:1, 410:0"/>
<spectrum name="emission" value="380:0, 450:1, 650:0"/><float name="quantum_yield" value="0.5"/>"""


def test_mitsuba_clouds_and_dyes(written) -> None:
    """Words of our own: `cloud`, `dyed` and `reradiating`, with what scene.json has by default."""

    def made(kind: str, words: str = "") -> media.Medium:
        return load(written("a.xml", (OURS % (kind, words)).encode())).shapes[0].interior

    words = """<float name="wispiness" value="2"/><point name="high" value="1, 1, 2"/>
        <float name="sigma_s" value="60"/><integer name="resolution" value="32"/>
        <phase type="hg"><float name="g" value="0.5"/></phase>
        <transform name="to_world"><scale value="3"/></transform>"""
    cloud = made("cloud", words)
    assert (cloud.kind, cloud.wispiness, cloud.frequency) == ("cloud", 2.0, 5.0)
    assert (cloud.low, cloud.high, cloud.size) == ((0, 0, 0), (1, 1, 2), (16, 16, 32))
    assert (cloud.sigma_s.value, cloud.phase.g.value) == (60.0, 0.5)
    np.testing.assert_allclose(cloud.box @ [1, 1, 1, 1], [3, 3, 6, 1])
    dyed = made(
        "dyed", DYE + '<float name="strength" value="330"/><float name="sigma_a" value="2"/>'
    )
    assert (dyed.kind, dyed.strength, dyed.sigma_a.value, dyed.glows) == ("dyed", 330, 2, True)
    assert (dyed.dye.quantum_yield, dyed.dye.absorption.sample(350.0)) == (0.5, 1.0)
    pigment = '<phase type="reradiating"><float name="reflectance" value="0.1"/>' + DYE
    phase = made("homogeneous", pigment + "</phase>").phase
    assert (phase.kind, phase.amount, phase.reradiation) == ("reradiating", 1.0, dyed.dye)
    white = pigment.replace("0.1", "1") + "</phase>"
    for kind, given, said in (
        ("cloud", '<point name="high" value="0, 1, 1"/>', "<medium type=.cloud.>.*is flat"),
        ("cloud", '<float name="wispines" value="2"/>', "wispiness"),
        ("cloud", '<float name="sigma_s" value="-2"/>', "sigma_s: -2"),
        ("cloud", '<integer name="resolution" value="9999"/>', "must be 0 to 1024"),
        ("dyed", "", "<medium type=.dyed.>.*needs the spectrum 'emission'"),
        ("dyed", DYE + '<phase type="hg"/>', "scatters alike in all directions"),
        ("homogeneous", white, "<phase type=.reradiating.>.*would leave"),
    ):
        with pytest.raises(SceneError, match=said) as caught:
            made(kind, given)
        assert (caught.value.file.name, caught.value.line) == ("a.xml", 2)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the volumes of others are not there")
def test_a_volume_of_others() -> None:
    """A cloud with tiles and leaves, of the size that is told beside it."""
    found = volumes.read(SHARED / "assets" / "volumes" / "teapot_cloud" / "teapot_cloud.nvdb")
    assert found.values.shape == (269, 136, 180)
    assert found.values.max() == 50.0


def test_alone_in_the_studio(written) -> None:
    """A file alone: in a box of its size, framed and lit, as thick whatever its numbers mean."""
    first, second = (
        load(written(f"{scale}.nvdb", file_bytes({"density": grid_bytes(VALUES * scale)})))
        for scale in (1, 1000)
    )
    assert first.extra["studio"] == {"camera": True, "shapes": 2, "lights": 1, "up": "y"}
    box, cloud = first.shapes[0], first.shapes[0].interior
    np.testing.assert_allclose(box.to_world @ [-1, -1, -1, 1], cloud.to_world @ [0, 0, 0, 1])
    np.testing.assert_allclose(box.to_world @ [1, 1, 1, 1], cloud.to_world @ [1, 1, 1, 1])
    thickness = [one.shapes[0].interior.sigma_t.value for one in (first, second)]
    assert thickness[0] == pytest.approx(1000 * thickness[1])
    with pytest.raises(SceneError, match="0 everywhere"):
        load(written("empty.vol", vol_bytes(0 * VALUES[..., None])))


def test_mitsuba_albedo(written) -> None:
    """An albedo of colours on a grid, with a density on another or the same everywhere."""
    albedo = np.random.default_rng(3).random((2, 3, 4, 3), np.float32)
    written("b.vol", vol_bytes(albedo))
    written("a.vol", vol_bytes(VALUES[..., None]))
    volume = '<volume name="albedo" type="gridvolume"><string name="filename" value="b.vol"/>'
    text = MITSUBA % ""
    both = text.replace("<float", volume + "</volume><float")
    medium = load(written("a.xml", both.encode())).shapes[0].interior
    assert medium.albedo_grid.shape[:3] == medium.density.shape
    assert all(n >= k for n, k in zip(medium.density.shape, VALUES.shape, strict=True))
    np.testing.assert_allclose(medium.density[0, 0, 0], VALUES[0, 0, 0])
    start = text.index("<volume")
    end = text.index("</volume>") + len("</volume>")
    alone = text[:start] + volume + "</volume>" + text[end:]
    medium = load(written("a.xml", alone.encode())).shapes[0].interior
    np.testing.assert_allclose(medium.albedo_grid, albedo)
    assert medium.density.shape == albedo.shape[:3]
