"""Devices: their list, a choice by name or speed, or the device of a caller's queue."""

from __future__ import annotations

import dataclasses
import functools
import logging
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pyopencl as cl

from clpt.device import (
    disk_cache,
    forking,
    native_programs,
    runtimes,
    speed_trial,
)
from clpt.files import budget

from ..errors import DeviceError
from ..scalars import is_whole
from .compilers import Compilers, spare_cores
from .program import cache_of

log = logging.getLogger(__name__)

ENVIRONMENT = "CLPT_DEVICE"
GROUPS = ("all", "gpu")  # of devices, for `choose_all`
_ORDER = ("gpu", "accelerator", "cpu")
_CLOSE = 1.1  # over the least seconds of a trial: runtimes count as equally fast
_GPU_SHARE = 0.85  # a desktop and other programs keep some of a GPU's memory
_TRIAL = "__kernel void trial(__global uint *out) { out[get_global_id(0)] = 7u; }"


@dataclass(frozen=True)
class DeviceInfo:
    """A device, before anything is created on it.

    index: in `devices()`; kind: "gpu", "accelerator" or "cpu"; memory in bytes;
    float_width: the driver's native SIMD width in floats.
    """

    index: int
    platform: str
    name: str
    vendor: str
    version: str
    driver: str
    kind: str
    compute_units: int
    global_mem: int
    max_alloc: int
    float_width: int
    cl_device: cl.Device = field(repr=False)

    @property
    def is_cpu(self) -> bool:
        return self.kind == "cpu"

    @property
    def lanes(self) -> int:
        """Paths that a work-item shades: the SIMD width on a CPU, 1 elsewhere."""
        if not self.is_cpu:
            return 1
        return 16 if self.float_width >= 16 else 8

    @property
    def is_pocl(self) -> bool:
        """Whether the driver is PoCL; only its version tells."""
        return "pocl" in self.version.casefold()

    @property
    def compiles_singly(self) -> bool:
        """Whether the driver compiles a single text at a time in a process: PoCL has a lock."""
        return self.is_pocl

    @property
    def links(self) -> bool:
        """Whether the driver links programs that were compiled separately.

        rusticl (Mesa 22) refuses modules of different SPIR-V versions, and compiles each to the
        lowest version possible.
        """
        return self.platform.casefold() != "rusticl"

    @property
    def limits_registers(self) -> bool:
        """Whether the driver's compiler limits and reports registers, as NVIDIA's does."""
        return "cl_nv_compiler_options" in self.cl_device.extensions.split()

    @cached_property
    def shares_words(self) -> bool:
        """Whether running kernels see writes of the host: fine-grained shared memory."""
        try:
            capabilities = self.cl_device.svm_capabilities
        except (AttributeError, cl.Error):  # a driver before OpenCL 2.0
            return False
        return bool(capabilities & cl.device_svm_capabilities.FINE_GRAIN_BUFFER)

    @cached_property
    def slot(self) -> tuple[int, ...] | None:
        """The device's position on the PCI bus, None if the driver does not report it."""
        try:
            bus = self.cl_device.pci_bus_info_khr
        except (AttributeError, cl.Error):
            return None
        return bus.pci_domain, bus.pci_bus, bus.pci_device, bus.pci_function

    @property
    def label(self) -> str:
        """Platform and device, for people to read."""
        return f"{self.platform} {self.name}"

    def free_memory(self) -> int:
        """Return an estimate of the device's free memory [bytes]; OpenCL has no query for it."""
        if self.is_cpu:
            return min(self.global_mem, budget.free_memory() or self.global_mem)
        if "cl_amd_device_attribute_query" in self.cl_device.extensions:
            try:
                kib = self.cl_device.get_info(cl.device_info.GLOBAL_FREE_MEMORY_AMD)
                return min(self.global_mem, int(kib[0] if isinstance(kib, list) else kib) * 1024)
            except cl.Error:
                pass
        return int(_GPU_SHARE * self.global_mem)


@dataclass(frozen=True)
class Choice:
    """A chosen device, and the reason as text."""

    info: DeviceInfo
    reason: str


@dataclass
class Builds:
    """The number of programs built so far, and their seconds (summed over threads).

    cached: the number loaded from clpt's cache; drivers do not report their caches.
    on_compile: called with a key before a program or a part goes to a compiler; on_compiled: with
    the same key afterwards. on_new: called when a program is in none of clpt's caches, after its
    parts went to other processes. Building threads call all three.
    """

    programs: int = 0
    cached: int = 0
    seconds: float = 0.0
    on_compile: Callable[[str], None] = lambda key: None
    on_compiled: Callable[[str], None] = lambda key: None
    on_new: Callable[[], None] = lambda: None
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def add(self, seconds: float, cached: bool) -> None:
        with self._lock:
            self.programs += 1
            self.cached += cached
            self.seconds += seconds


class Device:
    """A context with a queue on one device.

    clpt enqueues every command through a Device. `Device.adopt` wraps a caller's queue; its context
    then holds every buffer and program.
    """

    def __init__(self, context: cl.Context, queue: cl.CommandQueue, info: DeviceInfo):
        forking.check(queue)
        self.context, self.queue, self.info = context, queue, info
        self.builds = Builds()
        self.compilers: Compilers | None = None  # compiler processes, set by the caller
        self.hurries = False  # whether its jobs precede those of other devices
        self.programs = cache_of(queue)

    @classmethod
    def open(
        cls, info: DeviceInfo, *, profiling: bool = False, context: cl.Context | None = None
    ) -> Device:
        """Return a device with a new in-order queue. Raises DeviceError.

        context: of the queue; None creates a context.
        """
        try:
            context = context or cl.Context([info.cl_device])
            return cls(context, _queue(context, info.cl_device, profiling), info)
        except cl.Error as error:
            raise DeviceError(f"{info.label} cannot be opened: {error}") from error

    @classmethod
    def adopt(cls, queue: cl.CommandQueue) -> Device:
        """Return the device of a caller's queue, with the caller's context. Raises DeviceError."""
        if not disk_cache.has_home():
            raise DeviceError(
                "PyOpenCL runs no kernel for a user without a home folder: set HOME, or "
                "XDG_CACHE_HOME to a folder for caches"
            )
        try:
            context = queue.context
        except cl.Error as error:
            raise DeviceError(
                "the queue's context is gone: keep it in a variable for as long as the queue, as "
                f"in context = cl.create_some_context(); queue = cl.CommandQueue(context) ({error})"
            ) from error
        info = _info(-1, queue.device)
        log.info("%s: the device of the caller's queue", info.label)
        return cls(context, queue, info)

    @cached_property
    def lanes(self) -> int:
        return self.info.lanes

    def free_memory(self) -> int:
        return self.info.free_memory()

    def __repr__(self) -> str:
        return f"Device({self.info.label!r})"


_opened: dict[tuple[int, DeviceInfo], Device] = {}  # by process and device


def devices() -> tuple[DeviceInfo, ...]:
    """Return every device of every platform, in the order of the platforms' names.

    A platform that fails is left out, with a logged warning.
    """
    return tuple(_info(index, device) for index, device in enumerate(_cl_devices()))


def choose(
    which: str | int | None = None, *, profiling: bool = False, threads: int | None = None
) -> Device:
    """Open a device by its index, or by a part of its names in any case.

    The names are the platform's, the device's and its version, such as "pocl".

    The device has a new queue. All devices of a process share a context for each physical device,
    so that programs are built once; a forked process has other contexts.

    None takes the environment variable CLPT_DEVICE if it is set, otherwise the first working
    device: GPUs, then accelerators, then CPUs. Of a CPU's runtimes it takes PoCL, unless another
    is faster by a tenth in a short trial, whose result stays in clpt's cache folder.

    threads: the largest number of a CPU's cores, by default all.

    Raises DeviceError, which lists the devices, if no device matches or works, and for threads
    that are invalid or not for a CPU.
    """
    choice = selection(which)
    log.info("%s: %s", choice.info.label, choice.reason)
    info = choice.info if threads is None else _limited(choice.info, threads)
    return Device.open(info, profiling=profiling, context=_first(info).context)


def choose_all(
    which: str | Iterable[Device | str | int] = "all",
    *,
    profiling: bool = False,
    threads: int | None = None,
) -> list[Device]:
    """Open several devices.

    which: "all": each CPU by its fastest runtime, each GPU by its first working runtime; "gpu": all
    GPUs; or names or indexes, see `choose`, as a sequence or a text with commas such as "0,2".
    Open Device objects stay as they are. threads: of each CPU.

    Raises DeviceError like `choose`, if a device is named twice, and without any device.
    """
    if isinstance(which, str) and which.strip().casefold() in GROUPS:
        named: list[Any] = list(_group(which.strip().casefold()))
    else:
        parts = which.split(",") if isinstance(which, str) else which
        named = [part if isinstance(part, Device) else selection(part).info for part in parts]
    if not named:
        raise DeviceError("give at least one device")
    infos = [info for info in named if isinstance(info, DeviceInfo)]
    for info in infos:
        if infos.count(info) > 1:
            raise DeviceError(f"{info.label} is named twice")
    if threads is not None and not any(info.is_cpu for info in infos):
        raise DeviceError("threads limit a CPU, and none is chosen here")
    opened = []
    for device in named:
        if isinstance(device, DeviceInfo):
            info = _limited(device, threads) if threads is not None and device.is_cpu else device
            log.info("%s: one of several devices", info.label)
            device = Device.open(info, profiling=profiling, context=_first(info).context)
        opened.append(device)
    return opened


def names_several(which: str | None) -> bool:
    """Whether a text is for `choose_all` instead of `choose`."""
    return which is not None and ("," in which or which.strip().casefold() in GROUPS)


def _group(name: str) -> Iterator[DeviceInfo]:
    """Yield all working devices, or working GPUs. Raises DeviceError where no device works."""
    infos, taken = by_preference(devices()), 0
    slots: set[tuple[int, ...]] = set()
    processors = [info for info in infos if info.is_cpu]
    best = _by_speed(processors)[0][0] if processors and name != "gpu" else None
    for info in infos:
        slower = best is not None and info.platform != best.platform and _same_processor(info, best)
        if slower or info.slot in slots or (name == "gpu" and info.kind != "gpu"):
            continue
        failure = None if _key(info) in _opened else trial(info)
        if failure is None:
            taken += 1
            slots |= {info.slot} if info.slot else set()
            yield info
        else:
            log.warning("%s is passed over: %s", info.label, failure)
    if not taken:
        kind = "GPU" if name == "gpu" else "OpenCL device"
        raise DeviceError(f"no {kind} works; there is {_listing(tuple(infos)) or 'none'}")


def selection(which: str | int | None = None) -> Choice:
    """Return the device that `choose` would open, with the reason. Raises DeviceError."""
    infos = devices()
    if not infos:
        raise DeviceError(f"no OpenCL device: {runtimes.advice()}")
    if which is None and os.environ.get(ENVIRONMENT, "").strip():
        which = os.environ[ENVIRONMENT].strip()
        request = f"{ENVIRONMENT}={which}"
    else:
        request = f"device {which!r}"
    named = which is not None
    failures: list[str] = []
    reason = f"asked for by {request}"
    if named:
        order = _matching(which, infos)
    else:
        order, seconds = _by_speed(by_preference(infos))
    for info in order:
        failure = None if _key(info) in _opened else trial(info)
        if failure is None:
            reason = reason if named else _reason(info, infos, seconds)
            return Choice(info, "; ".join([reason, *(f"passed over {f}" for f in failures)]))
        log.warning("%s is passed over: %s", info.label, failure)
        failures.append(f"{info.label} ({failure})")
    if failures:
        raise DeviceError("no OpenCL device works: " + "; ".join(failures))
    raise DeviceError(f"{request} is not there; there is " + _listing(infos))


def by_preference(infos: tuple[DeviceInfo, ...]) -> list[DeviceInfo]:
    """Return GPUs before accelerators before CPUs, otherwise in the order of platforms."""
    return sorted(infos, key=lambda info: _ORDER.index(info.kind))


def _by_speed(
    infos: list[DeviceInfo],
) -> tuple[list[DeviceInfo], dict[DeviceInfo, float]]:
    """Put the best runtime first if the first device is a CPU with several runtimes.

    The best is PoCL, unless another is faster by more than the scatter of a trial: PoCL loads its
    cached programs faster. The second result is each runtime's seconds in the trial, empty where
    no trial ran or it failed.
    """
    peers = [info for info in infos if _same_processor(info, infos[0])]
    if len(peers) < 2:
        return infos, {}
    names = [f"{i.label} {i.version} {i.driver} {i.compute_units}" for i in peers]
    times = speed_trial.remembered(names, lambda: _measured(peers))
    if times is None:
        return infos, {}
    seconds = dict(zip(peers, times, strict=True))
    close = _CLOSE * min(times)
    ranked = sorted(peers, key=lambda i: (seconds[i] > close, not i.is_pocl, seconds[i]))
    return ranked + [info for info in infos if info not in ranked], seconds


def _same_processor(info: DeviceInfo, other: DeviceInfo) -> bool:
    """Return whether two devices are runtimes of a CPU: PoCL puts a prefix before its name."""
    a, b = info.name.casefold(), other.name.casefold()
    return info.is_cpu and other.is_cpu and (a.endswith(b) or b.endswith(a))


def _measured(infos: Sequence[DeviceInfo]) -> list[float]:
    """Return the seconds of a trial on each device, in the process's contexts."""
    return speed_trial.measure([(_first(info).queue, info.lanes) for info in infos])


def trial(info: DeviceInfo) -> str | None:
    """Build and run a trivial kernel; return None on success, else the error as a line."""
    try:
        # The process's context: in each new context PoCL reads its library, which takes a second.
        device = _opened.get(_key(info)) or Device.open(info)
        program = native_programs.build(device.context, info.cl_device, _TRIAL)
        result = np.zeros(4, np.uint32)
        buffer = cl.Buffer(device.context, cl.mem_flags.WRITE_ONLY, result.nbytes)
        cl.Kernel(program, "trial")(device.queue, result.shape, None, buffer)
        cl.enqueue_copy(device.queue, result, buffer)
    except Exception as error:  # any exception of a broken driver: the next device is tried
        rows = str(error).splitlines() or [type(error).__name__]
        return next((row for row in rows if "error:" in row), rows[0]).strip()[:200]
    if not (result == 7).all():
        return "a trivial kernel gave a wrong result"
    _opened.setdefault(_key(info), device)
    return None


def _key(info: DeviceInfo) -> tuple[int, DeviceInfo]:
    return os.getpid(), info


def _limited(info: DeviceInfo, threads: int) -> DeviceInfo:
    """Return a part of a CPU with `threads` cores, or all of it. Raises DeviceError."""
    if not is_whole(threads) or threads < 1:
        raise DeviceError(f"threads must be a whole number above zero, not {threads!r}")
    if not info.is_cpu:
        raise DeviceError(f"threads limit a CPU, and {info.label} is none")
    return info if threads >= info.compute_units else _part(info, int(threads))


@functools.cache
def _part(info: DeviceInfo, threads: int) -> DeviceInfo:
    """Return a part of a CPU, equal at each call, so that its context is kept.

    Raises DeviceError.
    """
    by_counts = [cl.device_partition_property.BY_COUNTS, threads, 0]
    try:
        part = info.cl_device.create_sub_devices(by_counts)[0]
    except cl.Error as error:
        raise DeviceError(
            f"{info.label} cannot be limited to {threads} threads: {error}"
        ) from error
    return dataclasses.replace(info, cl_device=part, compute_units=threads)


def _first(info: DeviceInfo) -> Device:
    """Return the device with the process's context, opened on first use. Raises DeviceError."""
    # Two threads may both open a context, and the first is kept. With a lock, another thread might
    # hold it when the process is forked.
    return _opened.get(_key(info)) or _opened.setdefault(_key(info), Device.open(info))


def share_compilers(devices: Sequence[Device], threads: int | None, resources: ExitStack) -> None:
    """Start compiler processes for devices whose driver compiles a single text at a time.

    threads: the largest number of a CPU's cores; resources: ends these processes.
    """
    slow = [device for device in devices if device.info.compiles_singly]
    cores = [threads or device.info.compute_units for device in slow]
    spare = min([spare_cores(), *(count - 1 for count in cores)])
    if slow and spare > 0:
        compilers = resources.enter_context(Compilers(spare))
        for device in slow:
            device.compilers = compilers


def _matching(which: str | int | None, infos: tuple[DeviceInfo, ...]) -> list[DeviceInfo]:
    """Return devices by an index or a part of a name, in the order of preference.

    PoCL calls its platform "Portable Computing Language"; only versions say "PoCL".
    """
    text = str(which).strip()
    if text.isdecimal():
        return [info for info in infos if info.index == int(text)]
    names = {info: f"{info.label} {info.version}".casefold() for info in by_preference(infos)}
    return [info for info in names if text.casefold() in names[info]]


def _reason(
    info: DeviceInfo, infos: tuple[DeviceInfo, ...], seconds: dict[DeviceInfo, float]
) -> str:
    if info in seconds:
        times = ", ".join(f"{1e3 * s:.2f} ms by {i.platform}" for i, s in seconds.items())
        return f"in a short trial no runtime of this CPU was faster by a tenth, remembered: {times}"
    if len(infos) == 1:
        return "the only device"
    peers = [other for other in infos if other.kind == info.kind]
    kind = {"gpu": "GPU", "cpu": "CPU"}.get(info.kind, info.kind)
    which = f"the only {kind}" if len(peers) == 1 else f"the first {kind}"
    return f"{which}; GPUs are preferred, then accelerators, then CPUs"


def _listing(infos: tuple[DeviceInfo, ...]) -> str:
    return ", ".join(f"[{info.index}] {info.label}" for info in infos)


def _cl_devices() -> Iterator[cl.Device]:
    try:
        platforms = runtimes.platforms()
    except cl.Error as error:
        log.info("no OpenCL platform: %s", error)  # callers report a missing device
        return
    for platform in sorted(platforms, key=lambda platform: platform.name):
        try:
            cl_devices = platform.get_devices()
        except cl.Error as error:
            log.warning("platform %s is passed over: %s", platform.name, error)
            continue
        if not cl_devices:
            log.debug("platform %s has no devices", platform.name)
        yield from cl_devices


def _info(index: int, device: cl.Device) -> DeviceInfo:
    types = cl.device_type
    kinds = {"gpu": types.GPU, "cpu": types.CPU}
    kind = next((name for name, flag in kinds.items() if device.type & flag), "accelerator")
    return DeviceInfo(
        index=index,
        platform=device.platform.name.strip(),
        name=device.name.strip(),
        vendor=device.vendor.strip(),
        version=device.version.strip(),
        driver=device.driver_version.strip(),
        kind=kind,
        compute_units=device.max_compute_units,
        global_mem=device.global_mem_size,
        max_alloc=device.max_mem_alloc_size,
        float_width=device.native_vector_width_float,
        cl_device=device,
    )


def _queue(context: cl.Context, device: cl.Device, profiling: bool) -> cl.CommandQueue:
    flags = cl.command_queue_properties.PROFILING_ENABLE if profiling else 0
    return cl.CommandQueue(context, device, flags)
