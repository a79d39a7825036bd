"""Records: the numpy form, the OpenCL form and what a device makes of it are the same."""

from __future__ import annotations

import re

import numpy as np
import pyopencl as cl
import pytest

from clpt import device
from clpt.device import kernels_folder
from clpt.records import CONSTANTS, LIGHT, PATH, SETTINGS, SHAPE, SLABS
from clpt.records.layout import SLAB_BLOCK, TYPES, Constants, Record, bits
from clpt.render.flow.flags import scene_text
from clpt.render.records import camera as camera_records

UNIFORM = [SETTINGS, *camera_records.RECORDS.values()]


@pytest.fixture(scope="module")
def opened() -> device.Device:
    """The device that the tests run on."""
    return device.choose()


def run(on: device.Device, text: str, lanes: int, *arrays: np.ndarray) -> None:
    """Run `probe` on one work-item; arrays are read and written in place."""
    virtual = {
        "probe.cl": text,
        "generated/scene.cl": scene_text(),
        "generated/spectrum.cl": '#include "spectra/spectral.cl"\n',
        "generated/spectrum_read.cl": '#include "spectra/spectral.cl#read"\n',
    }
    defines = {"LANES": lanes, "SPECTRA_SIZE": 471, "SPECTRA_STEP": "1.0f"}
    defines["SLAB_BLOCK"] = SLAB_BLOCK if lanes == 1 else 0
    program = device.build(on, device.assemble("probe.cl", virtual, defines))
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    buffers = [cl.Buffer(on.context, flags, hostbuf=a) for a in arrays]
    bound = program.kernel("probe").bind(**dict(zip("abcd", buffers, strict=False)))
    bound.enqueue(on.queue, (1,), (1,))
    for array, buffer in zip(arrays, buffers, strict=True):
        cl.enqueue_copy(on.queue, array, buffer)


def test_declared_order_is_memory_order() -> None:
    record = Record("R", "doc", a=("real", ""), b=("vec3", ""), c=("integer", ""), d=("matrix", ""))
    assert [m.word for m in record.members] == [0, 1, 4, 5]
    assert record.words == 21
    assert record.dtype.itemsize == 84
    assert [record.dtype.fields[m.name][1] for m in record.members] == [0, 4, 16, 20]


def test_an_unknown_type_is_refused() -> None:
    with pytest.raises(ValueError, match=r"R\.a: 'float3'"):
        Record("R", "doc", a=("float3", ""))


@pytest.mark.parametrize("record", [*SLABS, SETTINGS, SHAPE, LIGHT], ids=lambda r: r.name)
def test_members_are_words_without_gaps(record: Record) -> None:
    word = 0
    for member in record.members:
        assert member.word == word
        assert record.dtype.fields[member.name][1] == 4 * word
        assert member.words == TYPES[member.type][0]
        assert member.doc
        word += member.words
    assert record.dtype.itemsize == 4 * word


@pytest.mark.parametrize("record", UNIFORM, ids=lambda r: r.name)
def test_offsets_on_the_device(opened: device.Device, record: Record) -> None:
    """The compiler's offset of every member, and its size of the struct."""
    text = record.uniform_text() if record is not SETTINGS else ""
    writes = "".join(
        f"    a[{i}] = (uint)((global char *)&r->{m.name} - (global char *)r);\n"
        for i, m in enumerate(record.members)
    )
    n = len(record.members)
    kernel = (
        f'#include "core/base.cl"\n{text}kernel void probe(global uint *a, global uint *b)\n{{\n'
        f"    global {record.name} *r = (global {record.name} *)b;\n{writes}"
        f"    a[{n}] = sizeof({record.name});\n}}\n"
    )
    found = np.zeros(n + 1, np.uint32)
    run(opened, kernel, 1, found, np.zeros(record.words, np.uint32))
    expected = [4 * m.word for m in record.members]
    assert found.tolist() == [*expected, record.dtype.itemsize]


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_slab_members_go_in_and_out(opened: device.Device, lanes: int) -> None:
    """Every word of a slab, loaded and stored elsewhere member by member, lands where it should."""
    rng = np.random.default_rng(1)
    shape = (2, PATH.step, SLAB_BLOCK) if lanes == 1 else (1, PATH.step, 2 * SLAB_BLOCK)
    source = rng.normal(size=shape).astype(np.float32)
    stride = PATH.step if lanes == 1 else 2 * SLAB_BLOCK
    target = np.zeros_like(source)
    slots = np.arange(48, 48 + lanes, dtype=np.uint32)
    lane_mask = (rng.random(lanes) < 0.6).astype(np.uint32)
    read = "(*(global const integer *)d)" if lanes > 1 else "((integer)d[0])"
    moves = "".join(
        f"    store_path_{m.name}(to, at, m, load_path_{m.name}(from, at));\n" for m in PATH.members
    )
    kernel = (
        '#include "core/base.cl"\n'
        "kernel void probe(global float *a, global float *b, global const uint *c, "
        "global const uint *d)\n{\n"
        f"    Slab from = {{a, {stride}}}, to = {{b, {stride}}};\n"
        f"    uint at = c[0];\n    mask m = {read} != 0;\n{moves}}}\n"
    )
    run(opened, kernel, lanes, source, target, slots, lane_mask)
    expected = np.zeros_like(source)
    kept = slots[lane_mask != 0]
    block, within = kept // shape[2], kept % shape[2]
    expected[block, : PATH.words, within] = source[block, : PATH.words, within]
    assert np.array_equal(target, expected)


@pytest.mark.parametrize("lanes", [1, 8, 16])
@pytest.mark.parametrize("record", [SHAPE, LIGHT], ids=lambda r: r.name)
def test_rows_are_gathered(opened: device.Device, record: Record, lanes: int) -> None:
    """`row` reads the members of one row per lane."""
    rng = np.random.default_rng(2)
    rows = rng.integers(0, 1 << 22, (32, record.words)).astype(np.uint32)
    chosen = rng.integers(0, 32, lanes).astype(np.uint32)
    at = "*(global const integer *)c" if lanes > 1 else "(integer)c[0]"
    name = {"ShapeRow": "shape_row", "LightRow": "light_row"}[record.name]
    writes = "".join(
        f"    block_store(b + {i * lanes}, "
        f"{'as_real(r.%s)' % m.name if m.type == 'integer' else 'r.%s' % m.name});\n"  # noqa: UP031
        for i, m in enumerate(record.members)
    )
    kernel = (
        '#include "core/base.cl"\n'
        "kernel void probe(global const uint *a, global float *b, global const uint *c)\n{\n"
        f"    integer row = {at};\n"
        f"    {record.name} r = {name}_row(a, row * {record.words});\n{writes}}}\n"
    )
    found = np.zeros((record.words, lanes), np.uint32)
    run(opened, kernel, lanes, rows.reshape(-1), found.reshape(-1), chosen)
    assert np.array_equal(found, rows[chosen].T)


@pytest.mark.parametrize("lanes", [1, 8])
def test_records_are_chosen_lane_by_lane(opened: device.Device, lanes: int) -> None:
    """`sel` takes every member from one of two, `nothing` has the values that are declared."""
    record = Record(
        "OddPoint",
        "All types that lanes have.",
        t=("real", "", "FAR"),
        i=("integer", "", "-1"),
        n=("natural", ""),
        uv=("vec2", ""),
        p=("vec3", "", "v3(1.0f, 2.0f, 3.0f)"),
        s=("spectrum", ""),
    )
    rng = np.random.default_rng(3)
    rows = rng.integers(0, 1 << 22, (32, record.words)).astype(np.uint32)
    lane_mask = (rng.random(lanes) < 0.5).astype(np.uint32)
    m = "(*(global const integer *)c)" if lanes > 1 else "((integer)c[0])"
    cast = {"integer": "as_real", "natural": "as_real"}
    members = [f"{m.name}{c}" for m in record.members for c in TYPES[m.type][3]]
    types = {m.name: m.type for m in record.members}
    writes = "".join(
        f"    block_store(b + {(where * record.words + i) * lanes}, "
        f"{cast.get(types[name.split('.')[0]], '')}({value}.{name}));\n"
        for where, value in enumerate(("r", "none"))
        for i, name in enumerate(members)
    )
    text = (
        f'#include "core/base.cl"\n{record.row_text()}'
        + record.select_text().removeprefix(record.lane_text())
        + "kernel void probe(global const uint *a, global float *b, global const uint *c)\n{\n"
        f"    integer row = LANE_INDEX;\n    mask m = {m} != 0;\n"
        f"    OddPoint one = odd_point_row(a, row * {record.words});\n"
        f"    OddPoint two = odd_point_row(a, (row + 16) * {record.words});\n"
        f"    OddPoint r = odd_point_sel(m, one, two), none = odd_point_nothing();\n{writes}}}\n"
    )
    found = np.zeros((2, record.words, lanes), np.uint32)
    run(opened, text, lanes, rows.reshape(-1), found.reshape(-1), lane_mask)
    numbers = np.arange(lanes)
    assert np.array_equal(found[0], rows[np.where(lane_mask, numbers, numbers + 16)].T)
    nothing = np.zeros((), record.dtype)
    nothing["t"], nothing["i"], nothing["p"] = 1e30, -1, (1, 2, 3)
    assert np.array_equal(found[1], np.tile(nothing.reshape(1).view(np.uint32), (lanes, 1)).T)


def test_constants_are_the_same_on_both_sides() -> None:
    """Bits ascend from the first; kernels get each as a number of the right type."""
    both = bits("SIDE_", "Sides.", 1 << 12, front="what is seen", back="")
    assert both.names == ("front", "back") and (both["front"], both["back"]) == (0x1000, 0x2000)
    text = "/* Sides. */\n#define SIDE_FRONT 0x1000 /* what is seen */\n#define SIDE_BACK 0x2000\n"
    assert both.text() == text
    assert "#define A_B 3u /* c */" in Constants("A_", "", unsigned=True, b=(3, "c")).text()


def test_no_kernel_defines_a_constant_anew() -> None:
    """One that both sides know stands in clpt/records alone."""
    shared = {row.split()[1] for own in CONSTANTS.values() for row in own.text().splitlines()[1:]}
    for path in kernels_folder().rglob("*.cl"):
        defined = re.findall(r"#\s*define (\w+)", path.read_text("utf-8"))
        assert shared.isdisjoint(defined), path
