"""Choosing a device: order, names, broken drivers, the environment."""

from __future__ import annotations

import dataclasses
import logging
import os
from concurrent.futures import ThreadPoolExecutor

import pyopencl as cl
import pytest

from clpt.device import Device, choose, choosing, context, devices
from clpt.errors import DeviceError


@pytest.fixture
def machine(monkeypatch, device):
    """A machine with three devices of which all are, in truth, the one that is there."""
    kinds = (
        ("cpu", "Alpha", "Old Core", "PoCL 3"),
        ("gpu", "Beta", "Fast 1", "1"),
        ("gpu", "Gamma", "Fast 2", "2"),
    )
    there = tuple(
        dataclasses.replace(
            device.info, index=i, kind=kind, platform=platform, name=name, version=f"CL {version}"
        )
        for i, (kind, platform, name, version) in enumerate(kinds)
    )
    monkeypatch.setattr(choosing, "devices", lambda: there)
    monkeypatch.setattr(choosing, "_opened", {})
    monkeypatch.delenv("CLPT_DEVICE", raising=False)
    return there


def test_devices_tell_what_they_are(device):
    info = devices()[device.info.index]
    assert info == device.info
    assert info.kind in ("gpu", "accelerator", "cpu")
    assert 0 < info.free_memory() <= info.global_mem
    assert info.lanes in ((8, 16) if info.is_cpu else (1,))


def test_a_gpu_is_preferred(machine):
    choice = choosing.selection()
    assert choice.info.name == "Fast 1"
    assert "first GPU" in choice.reason


@pytest.mark.parametrize(
    ("which", "name"),
    [
        (0, "Old Core"),
        ("2", "Fast 2"),
        ("gamma", "Fast 2"),
        ("ALPHA old", "Old Core"),
        ("fast", "Fast 1"),
        ("pocl", "Old Core"),
    ],
)
def test_by_index_or_name(machine, which, name):
    assert choose(which).info.name == name


def test_by_the_environment(machine, monkeypatch):
    monkeypatch.setenv("CLPT_DEVICE", "core")
    choice = choosing.selection()
    assert choice.info.name == "Old Core"
    assert "CLPT_DEVICE=core" in choice.reason
    assert choose("Fast 2").info.name == "Fast 2"  # what is asked for in the call wins


@pytest.mark.parametrize("which", [7, "-1", "radeon"])
def test_an_unknown_one_lists_what_there_is(machine, which):
    with pytest.raises(
        DeviceError, match=r"is not there; there is \[0\] Alpha Old Core, \[1\] Beta"
    ):
        choose(which)


def test_a_driver_that_fails_is_passed_over(machine, monkeypatch, caplog):
    failing = {"Fast 1": "the compiler is broken"}
    monkeypatch.setattr(choosing, "trial", lambda info: failing.get(info.name))
    with caplog.at_level(logging.WARNING):
        choice = choosing.selection()
    assert choice.info.name == "Fast 2"
    assert "passed over Beta Fast 1 (the compiler is broken)" in choice.reason
    assert "the compiler is broken" in caplog.text


def test_a_gpu_of_two_platforms_is_taken_once(machine, monkeypatch):
    """As rusticl and a vendor's driver may both have it; the first that works."""
    gpus = property(lambda info: (0, 1, 0, 0) if info.kind == "gpu" else None)
    monkeypatch.setattr(context.DeviceInfo, "slot", gpus)
    monkeypatch.setattr(choosing, "trial", lambda info: "no" if info.name == "Fast 1" else None)
    assert [one.info.name for one in choosing.choose_all("gpu")] == ["Fast 2"]
    monkeypatch.setattr(choosing, "trial", lambda info: None)
    assert [one.info.name for one in choosing.choose_all("gpu")] == ["Fast 1"]
    assert [one.info.name for one in choosing.choose_all("all")] == ["Fast 1", "Old Core"]
    monkeypatch.setattr(context.DeviceInfo, "slot", None)
    assert [one.info.name for one in choosing.choose_all("gpu")] == ["Fast 1", "Fast 2"]


def test_no_driver_works(machine, monkeypatch):
    monkeypatch.setattr(choosing, "trial", lambda info: "it is broken")
    with pytest.raises(DeviceError, match="no OpenCL device works: Beta Fast 1"):
        choose()


def test_the_trial_reports_instead_of_raising(device, monkeypatch):
    assert choosing.trial(device.info) is None
    monkeypatch.setattr(choosing, "_TRIAL", "__kernel void trial(__global uint *out) { broken }")
    assert "broken" in choosing.trial(device.info)
    monkeypatch.setattr(
        choosing, "_TRIAL", "__kernel void trial(__global uint *out) { out[0] = 1; }"
    )
    assert choosing.trial(device.info) == "a trivial kernel gave a wrong result"


def test_threads_are_limited(device):
    """Commands of a part of the processor run there, in a context that is kept for the next."""
    if not device.info.is_cpu or device.info.compute_units < 2:
        pytest.skip("needs a CPU with two cores")
    one = choose(device.info.index, threads=1)
    assert one.info.compute_units == one.queue.device.max_compute_units == 1
    assert one.context == choose(device.info.index, threads=1).context
    assert choose(device.info.index, threads=10**6).info == device.info
    assert choosing.trial(one.info) is None


@pytest.mark.parametrize("threads", [0, True, "2"])
def test_threads_that_make_no_sense(device, threads):
    with pytest.raises(DeviceError, match="threads must be a whole number above zero"):
        choose(device.info.index, threads=threads)


def test_no_device_tells_what_to_do(monkeypatch):
    monkeypatch.setattr(choosing, "devices", lambda: ())
    with pytest.raises(DeviceError, match="pocl-opencl-icd"):
        choose()


class Platform:
    def __init__(self, name, found):
        self.name, self.found = name, found

    def get_devices(self):
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def test_platforms_without_devices_are_left_out(device, monkeypatch, caplog):
    platforms = [
        Platform("Z", []),
        Platform("B", cl.Error("no")),
        Platform("A", [device.info.cl_device]),
    ]
    monkeypatch.setattr(cl, "get_platforms", lambda: platforms)
    with caplog.at_level(logging.WARNING):
        assert len(devices()) == 1
    assert "Z has no devices" not in caplog.text, "Mesa's are usual, and no fault"
    assert "B is passed over" in caplog.text


def test_adopting_a_queue(device):
    queue = cl.CommandQueue(device.context)
    adopted = Device.adopt(queue)
    assert adopted.queue is queue
    assert adopted.context == device.context
    assert adopted.info.label == device.info.label


def test_a_process_has_one_context(device):
    """Two devices of the same name share it, and what is built in it; each has its own queue."""
    first, second = choose(device.info.index), choose(device.info.index)
    assert first.context == second.context
    assert first.programs is second.programs
    assert first.queue != second.queue


def test_threads_share_the_context(device, monkeypatch):
    monkeypatch.setattr(choosing, "_opened", {})
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: choose(device.info.index), range(8)))
    assert len({one.context.int_ptr for one in found}) == 1


def test_a_forked_process_has_its_own(device, monkeypatch):
    """What a parent has opened is not used in the child: its driver's threads are gone there."""
    monkeypatch.setattr(choosing, "_opened", {})
    first = choose(device.info.index)
    monkeypatch.setattr(os, "getpid", lambda: -1)
    assert choose(device.info.index).context != first.context
