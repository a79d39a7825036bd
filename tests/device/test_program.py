"""Programs: arguments by name, errors with our lines, the cache."""

from __future__ import annotations

import dataclasses
import logging
import sys
import warnings
import weakref

import numpy as np
import pyopencl as cl
import pytest
from pyopencl import _cl

from clpt.device import (
    Buffers,
    Device,
    assemble,
    build,
    build_all,
    building,
    choosing,
    link,
    native_programs,
)
from clpt.errors import KernelBuildError
from clpt.files import disk_cache

TEXT = """
__kernel void fill(__global float *restrict out, const float4 v, float3 w, uint n, int sign,
                   __global const uint *unused, __local float *scratch)
{
    uint i = get_global_id(0);
    if (i < n) out[i] = v.s1 * w.z + sign;
}
__kernel void other(__global uint *x) { x[0] = 1u; }
"""
BROKEN = """inline int one(void) { return 1; }
int unused(void)
{
    return 2;
}
__kernel void broken(__global int *x) { x[0] = one() + nothing; }
"""


def source(text: str = TEXT, **virtual: str):
    return assemble("test.cl", {"test.cl": text, **virtual})


@pytest.fixture
def fill(device):
    return build(device, source()).kernel("fill")


@pytest.fixture
def out(device):
    return Buffers(device).upload("out", np.zeros(16, np.float32))


def arguments(out, **changed):
    named = {"out": out, "v": (1, 2, 3, 4), "w": (5, 6, 7), "n": 16, "sign": -1}
    return {**named, "unused": None, "scratch": cl.LocalMemory(64), **changed}


def result(device, bound, out):
    bound.enqueue(device.queue, (16,), (16,))
    return Buffers(device).download(out, (16,), np.float32)


def test_signature(fill):
    places = {a.name: (a.type, a.space) for a in fill.arguments}
    assert places["out"] == ("float*", "global")
    assert places["v"] == ("float4", "private")
    assert places["n"] == ("uint", "private")
    assert places["scratch"][1] == "local"


def test_runs_and_sets_again(device, fill, out):
    bound = fill.bind(**arguments(out))
    assert (result(device, bound, out) == 2 * 7 - 1).all()
    bound.set_args(sign=1, v=np.float32([0, 3, 0, 0]))
    assert (result(device, bound, out) == 3 * 7 + 1).all()


def test_two_bindings_do_not_disturb(device, fill, out):
    first, second = fill.bind(**arguments(out)), fill.bind(**arguments(out, sign=100))
    assert (result(device, second, out) == 114).all()
    assert (result(device, first, out) == 13).all()


def test_what_is_lent_lets_go_of_buffers_and_asks_for_all(device, fill, out):
    held = sys.getrefcount(out)
    for sign in (-1, -1, 100):
        named = arguments(out, sign=sign)
        got = fill.program.lend_kernel("fill", named, lambda bound: result(device, bound, out))
        del named
        assert (got == 14 + sign).all()
        assert sys.getrefcount(out) == held
    lent = [fill.program.lend_kernel("fill", arguments(out), lambda bound: bound) for _ in "ab"]
    assert lent[0] is lent[1]
    with pytest.raises(TypeError, match="'fill' also takes out"):
        fill.program.lend_kernel("fill", {"n": 3}, lambda bound: bound)


def test_events_chain(device, fill, out):
    bound = fill.bind(**arguments(out))
    first = bound.enqueue(device.queue, (16,), (16,))
    second = bound.enqueue(device.queue, (16,), (16,), wait_for=[first])
    second.wait()
    assert first.command_execution_status == cl.command_execution_status.COMPLETE


def test_missing_unknown_and_unfit_arguments(fill, out):
    named = arguments(out)
    with pytest.raises(TypeError, match="'fill' takes no 'speed'; it takes out, v, w"):
        fill.bind(**named, speed=1)
    del named["sign"]
    with pytest.raises(TypeError, match="'fill' also takes sign"):
        fill.bind(**named)
    for bad in ({"n": -1}, {"n": 2**32}, {"v": (1, 2)}, {"out": 3.5}, {"sign": "x"}):
        with pytest.raises(TypeError, match=f"{next(iter(bad))} is .* does not fit"):
            fill.bind(**{**arguments(out), **bad})


def test_kernels_are_named(device):
    built = build(device, source())
    assert built.kernel("fill").name == "fill"
    with pytest.raises(KeyError, match="no kernel 'fil'; it has fill, other"):
        built.kernel("fil")


def test_an_error_names_our_file_and_line(device, cache_folder):
    broken = source(
        '#include "part.cl"\n',
        **{"part.cl": BROKEN},
    )
    with pytest.raises(KernelBuildError, match=r"part\.cl:6") as raised:
        build(device, broken)
    error = raised.value
    assert (error.stage, error.file, error.line) == ("test.cl", "part.cl", 6)
    assert "nothing" in error.log
    assert str(cache_folder) in error.kept
    with open(error.kept) as kept:
        assert kept.read() == broken.text


def test_a_log_that_counts_rows_of_the_whole_text(device, monkeypatch):
    """NVIDIA's compiler reads no `#line`."""
    text = source('#include "part.cl"\n', **{"part.cl": BROKEN})
    row = 1 + text.text.splitlines().index(BROKEN.splitlines()[-1])

    def refuse(*_):
        raise cl.Error(f"warnings\n<kernel>:{row}:23: error: undeclared identifier 'nothing'")

    monkeypatch.setattr(native_programs, "build", refuse)
    with pytest.raises(KernelBuildError, match=r"at part\.cl:6: <kernel>"):
        build(device, text)


def test_an_unwritable_cache_does_not_hide_the_error(device, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(disk_cache, "folder", lambda: tmp_path / "file")
    with pytest.raises(KernelBuildError) as raised:
        build(device, source(BROKEN))
    assert raised.value.kept is None


def test_build_all(device):
    before = device.builds.programs
    texts = {
        f"p{i}": source(f"__kernel void k{i}(__global int *x) {{ x[0] = {i}; }}") for i in (1, 2)
    }
    built = build_all(device, texts)
    assert [list(built[name].signatures) for name in texts] == [["k1"], ["k2"]]
    assert device.builds.programs == before + 2
    with pytest.raises(KernelBuildError):
        build_all(device, {**texts, "broken": source(BROKEN)})


def test_our_cache(device, cache_folder, monkeypatch):
    """As for a driver without a cache of its own: kept, taken again, rebuilt when damaged."""
    monkeypatch.setattr(building, "has_own_cache", lambda device: False)
    from_source = building._from_source
    built = []
    monkeypatch.setattr(building, "_from_source", lambda *a: built.append(1) or from_source(*a))

    first, again = Device.open(device.info), Device.open(device.info)
    cold, warm = build(first, source()), build(again, source())
    assert len(built) == 1
    assert (first.builds.cached, again.builds.cached, again.builds.programs) == (0, 1, 1)
    assert warm.signatures == cold.signatures

    (entry,) = (cache_folder / "programs").iterdir()
    entry.write_bytes(entry.read_bytes()[:-1])
    build(Device.open(device.info), source())
    assert len(built) == 2

    build(Device.open(device.info), source(), ["-DX=1"])
    assert len(built) == 3


def test_a_context_keeps_its_programs(device):
    """Whoever has a queue there finds them; with the last queue they go, and the context."""
    context = cl.Context([device.info.cl_device])
    queue = cl.CommandQueue(context)
    first = Device.adopt(queue)
    built = build(first, source())
    assert build(Device.adopt(queue), source()) is built
    assert build(Device.adopt(cl.CommandQueue(context)), source()) is built
    assert build(Device.open(device.info), source()) is not built
    assert build(first, source(), ["-DX=1"]) is not built
    assert first.builds.programs == 2
    bound = built.kernel("other").bind(x=None)
    built.lend_kernel("other", {"x": None}, lambda bound: None)
    gone = weakref.ref(built)
    del first, queue, built, bound
    assert gone() is None, "at once, without the collector of cycles"


def test_remarks_of_a_driver_are_no_warnings(device, cache_folder, monkeypatch, caplog):
    """Intel's runtime remarks on every kernel. A user who makes warnings errors sees none."""

    class Remarking(_cl._Program):
        def get_build_info(self, *of):
            return super().get_build_info(*of) + "kernel was vectorised"

    monkeypatch.setattr(native_programs._cl, "_Program", Remarking)
    monkeypatch.setattr(building, "has_own_cache", lambda device: False)
    with warnings.catch_warnings(), caplog.at_level(logging.DEBUG, "clpt"):
        warnings.simplefilter("error")
        before = list(warnings.filters)
        with pytest.raises(Warning, match="Non-empty compiler output"):  # what PyOpenCL does
            Remarking(device.context, TEXT).build(b"", [device.info.cl_device])
        assert choosing.trial(device.info) is None
        opened = Device.open(device.info)
        build_all(opened, {name: source(TEXT + f"/* {name} */") for name in "abc"})
        link(opened, {"main": source()}, "main", build(opened, source()).signatures)
        assert warnings.filters == before
    assert "kernel was vectorised" in caplog.text


@pytest.mark.parametrize(
    ("spills", "kept"), [({}, 96), ({96}, 128), ({96, 128}, None)], ids=["none", "some", "all"]
)
def test_few_registers_are_tried_where_a_driver_tells(
    device, cache_folder, monkeypatch, spills, kept
):
    """In its log, as NVIDIA's. What it takes alone is the most that is tried.

    It tells nothing of a program that it has in its cache: the choice is clpt's to keep.
    """
    limits, cached = {}, set()

    def made(_context, _device, _code, options):
        (*_, last) = options
        limit = int(last.split("=")[1]) if "maxrregcount" in last else None
        program = native(device.context, device.info.cl_device, TEXT, list(building.OPTIONS))
        limits[program.int_ptr] = limit
        return program

    def log_of(program, _device):
        limit = limits[program.int_ptr]
        if limit in cached:
            return ""
        cached.add(limit)
        spilled = 8 if limit in spills else 0
        return f"{spilled} bytes spill stores\nptxas info : Used {limit or 150} registers"

    native = native_programs.build
    monkeypatch.setattr(native_programs, "build", made)
    monkeypatch.setattr(native_programs, "log_of", log_of)
    limited = dataclasses.replace(source(), registers=(96, 128, 160))
    assert building._natively(device, limited, []) and not limits.popitem()[1]
    monkeypatch.setattr(choosing.DeviceInfo, "limits_registers", True)
    program = building._natively(device, limited, [])
    assert limits[program.int_ptr] == kept and 160 not in limits.values()
    limits.clear()
    again = building._natively(device, limited, [])
    assert limits == {again.int_ptr: kept}
    unknown = building._natively(device, dataclasses.replace(limited, registers=(96, 100)), [])
    assert limits[unknown.int_ptr] is None and 100 not in limits.values()
