"""Devices: listing them, choosing one, or adopting the queue of the caller."""

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
    memory,
    native_programs,
    program_cache,
    runtimes,
    speed_trial,
)

from ..errors import DeviceError
from ..scalars import is_whole
from .compilers import Compilers, spare_cores

log = logging.getLogger(__name__)

ENVIRONMENT = "CLPT_DEVICE"
GROUPS = ("all", "gpu")  # of devices, for `choose_all`
_ORDER = ("gpu", "accelerator", "cpu")
_CLOSE = 1.1  # seconds of a trial over the least, up to which runtimes are as fast
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
        """Paths that one work-item shades: the SIMD width on a CPU, 1 elsewhere."""
        if not self.is_cpu:
            return 1
        return 16 if self.float_width >= 16 else 8

    @property
    def is_pocl(self) -> bool:
        """Whether the driver is PoCL, which only its version says."""
        return "pocl" in self.version.casefold()

    @property
    def compiles_singly(self) -> bool:
        """Whether the driver compiles one text at a time in a process: PoCL has one lock."""
        return self.is_pocl

    @property
    def links(self) -> bool:
        """Whether the driver links what was compiled apart.

        rusticl, of Mesa 22 at least, refuses modules of different versions of SPIR-V, and compiles
        each to the lowest that it needs.
        """
        return self.platform.casefold() != "rusticl"

    @property
    def limits_registers(self) -> bool:
        """Whether the driver's compiler takes and tells numbers of registers: NVIDIA's."""
        return "cl_nv_compiler_options" in self.cl_device.extensions.split()

    @cached_property
    def shares_words(self) -> bool:
        """Whether kernels that run see what the host writes: fine-grained shared memory."""
        try:
            has = self.cl_device.svm_capabilities
        except (AttributeError, cl.Error):  # a driver before OpenCL 2.0
            return False
        return bool(has & cl.device_svm_capabilities.FINE_GRAIN_BUFFER)

    @cached_property
    def slot(self) -> tuple[int, ...] | None:
        """Where the device is on the machine's bus, None where the driver does not tell."""
        try:
            found = self.cl_device.pci_bus_info_khr
        except (AttributeError, cl.Error):
            return None
        return found.pci_domain, found.pci_bus, found.pci_device, found.pci_function

    @property
    def label(self) -> str:
        """Platform and device, for people to read."""
        return f"{self.platform} {self.name}"

    def free_memory(self) -> int:
        """Return an estimate of what may be allocated now [bytes]."""
        return memory.free(self.cl_device, self.is_cpu, self.global_mem)


@dataclass(frozen=True)
class Choice:
    """A device that was chosen, and the reason for people to read."""

    info: DeviceInfo
    reason: str


@dataclass
class Builds:
    """The programs that have been built so far, and the seconds that took (summed over threads).

    cached: how many of them came from clpt's own cache; drivers do not tell about theirs.
    on_compile: called with a key when a program, or a part of one, is about to be given to a
    compiler, and on_compiled with the same key when it has been. on_new: called when a program is
    in none of clpt's caches, after other processes have got their share. Threads call all three,
    and wait for them.
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

    Everything that clpt runs goes through one of these. `Device.adopt` makes one of a queue of the
    caller, whose context is then used for every buffer and program.
    """

    def __init__(self, context: cl.Context, queue: cl.CommandQueue, info: DeviceInfo):
        forking.check(queue)
        self.context, self.queue, self.info = context, queue, info
        self.builds = Builds()
        self.compilers: Compilers | None = None  # in other processes, where the caller gives some
        self.hurries = False  # whether they compile for it before they do for others
        self.programs = program_cache.of(queue)

    @classmethod
    def open(
        cls, info: DeviceInfo, *, profiling: bool = False, context: cl.Context | None = None
    ) -> Device:
        """Return a device with a new in-order queue. Raises DeviceError.

        context: that of the queue; None for a new one.
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


_opened: dict[tuple[int, DeviceInfo], Device] = {}  # by the process, whose contexts these are


def devices() -> tuple[DeviceInfo, ...]:
    """Return every device of every platform, in the order of the platforms' names.

    A platform that has no devices or fails is left out, with a logged warning.
    """
    return tuple(_info(index, device) for index, device in enumerate(_cl_devices()))


def choose(
    which: str | int | None = None, *, profiling: bool = False, threads: int | None = None
) -> Device:
    """Open the device named by an index, or by a part of its names in any case.

    Its names are the platform's, its own and that in its version, such as "pocl".

    It has a queue of its own. Its context is that of the process, in which programs are built once;
    a process that was forked has another one.

    None takes the environment variable CLPT_DEVICE if it is set, and otherwise the first device
    that works: GPUs, then accelerators, then CPUs; of a CPU's runtimes PoCL, or one that is faster
    by a tenth in a short trial, which is made once and remembered in clpt's cache folder.

    threads: how many cores of a CPU take part at most, by default all.

    Raises DeviceError, which lists the devices, if none matches or none works, and where threads
    make no sense.
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

    which: "all", where of the runtimes of one CPU the fastest is taken, and of a GPU's the first
    that works; "gpu", all GPUs likewise; or names
    or indexes as `choose` takes them, a sequence, or a text with commas such as "0,2". Devices that
    are open already stay as they are. threads: of each of those that are CPUs.

    Raises DeviceError as `choose` does, where a device is named twice, and where there is none.
    """
    if isinstance(which, str) and which.strip().casefold() in GROUPS:
        named: list[Any] = list(_group(which.strip().casefold()))
    else:
        parts = which.split(",") if isinstance(which, str) else which
        named = [one if isinstance(one, Device) else selection(one).info for one in parts]
    if not named:
        raise DeviceError("give at least one device")
    infos = [one for one in named if isinstance(one, DeviceInfo)]
    for info in infos:
        if infos.count(info) > 1:
            raise DeviceError(f"{info.label} is named twice")
    if threads is not None and not any(info.is_cpu for info in infos):
        raise DeviceError("threads are of a CPU that is chosen here, and there is none")
    opened = []
    for one in named:
        if isinstance(one, DeviceInfo):
            info = _limited(one, threads) if threads is not None and one.is_cpu else one
            log.info("%s: one of several devices", info.label)
            one = Device.open(info, profiling=profiling, context=_first(info).context)
        opened.append(one)
    return opened


def names_several(which: str | None) -> bool:
    """Whether a text is for `choose_all`, and not for `choose`."""
    return which is not None and ("," in which or which.strip().casefold() in GROUPS)


def _group(name: str) -> Iterator[DeviceInfo]:
    """All devices, or all GPUs, that work. Raises DeviceError where there is none."""
    found, taken = by_preference(devices()), 0
    slots: set[tuple[int, ...]] = set()
    processors = [info for info in found if info.is_cpu]
    best = _by_speed(processors)[0][0] if processors and name != "gpu" else None
    for info in found:
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
        what = "GPU" if name == "gpu" else "OpenCL device"
        raise DeviceError(f"no {what} works; there is {_listing(tuple(found)) or 'none'}")


def selection(which: str | int | None = None) -> Choice:
    """Return the device that `choose` would open, and why. Raises DeviceError."""
    found = devices()
    if not found:
        raise DeviceError(f"no OpenCL device: {runtimes.advice()}")
    if which is None and os.environ.get(ENVIRONMENT, "").strip():
        which = os.environ[ENVIRONMENT].strip()
        asked = f"{ENVIRONMENT}={which}"
    else:
        asked = f"device {which!r}"
    named = which is not None
    failures: list[str] = []
    reason = f"asked for by {asked}"
    if named:
        order = _matching(which, found)
    else:
        order, seconds = _by_speed(by_preference(found))
    for info in order:
        failure = None if _key(info) in _opened else trial(info)
        if failure is None:
            reason = reason if named else _reason(info, found, seconds)
            return Choice(info, "; ".join([reason, *(f"passed over {f}" for f in failures)]))
        log.warning("%s is passed over: %s", info.label, failure)
        failures.append(f"{info.label} ({failure})")
    if failures:
        raise DeviceError("no OpenCL device works: " + "; ".join(failures))
    raise DeviceError(f"{asked} is not there; there is " + _listing(found))


def by_preference(infos: tuple[DeviceInfo, ...]) -> list[DeviceInfo]:
    """Return GPUs before accelerators before CPUs; among equals, in the order of the platforms."""
    return sorted(infos, key=lambda info: _ORDER.index(info.kind))


def _by_speed(
    infos: list[DeviceInfo],
) -> tuple[list[DeviceInfo], dict[DeviceInfo, float]]:
    """Put the best one first if the first device is a CPU that others serve too.

    It is PoCL, unless another one is faster by more than a trial scatters: of two that are as fast,
    chance would choose, and PoCL reads what it has kept sooner. Their seconds in the trial too,
    which are empty where there was none, or it failed.
    """
    peers = [info for info in infos if _same_processor(info, infos[0])]
    if len(peers) < 2:
        return infos, {}
    runtimes = [f"{i.label} {i.version} {i.driver} {i.compute_units}" for i in peers]
    taken = speed_trial.remembered(runtimes, lambda: _measured(peers))
    if taken is None:
        return infos, {}
    seconds = dict(zip(peers, taken, strict=True))
    close = _CLOSE * min(taken)
    ranked = sorted(peers, key=lambda i: (seconds[i] > close, not i.is_pocl, seconds[i]))
    return ranked + [info for info in infos if info not in ranked], seconds


def _same_processor(one: DeviceInfo, other: DeviceInfo) -> bool:
    """Whether two devices are runtimes of one CPU: PoCL puts words before its name."""
    a, b = one.name.casefold(), other.name.casefold()
    return one.is_cpu and other.is_cpu and (a.endswith(b) or b.endswith(a))


def _measured(infos: Sequence[DeviceInfo]) -> list[float]:
    """Time a trial on devices [s], in the process's own contexts; raises what drivers raise."""
    return speed_trial.measure([(_first(info).queue, info.lanes) for info in infos])


def trial(info: DeviceInfo) -> str | None:
    """Build and run a trivial kernel; return None if it worked, else the error in one line."""
    try:
        # The process's own context: in each one PoCL reads its library anew, which takes a second.
        device = _opened.get(_key(info)) or Device.open(info)
        program = native_programs.build(device.context, info.cl_device, _TRIAL)
        result = np.zeros(4, np.uint32)
        buffer = cl.Buffer(device.context, cl.mem_flags.WRITE_ONLY, result.nbytes)
        cl.Kernel(program, "trial")(device.queue, result.shape, None, buffer)
        cl.enqueue_copy(device.queue, result, buffer)
    except Exception as error:  # whatever a broken driver raises, the next one is tried
        rows = str(error).splitlines() or [type(error).__name__]
        return next((row for row in rows if "error:" in row), rows[0]).strip()[:200]
    if not (result == 7).all():
        return "a trivial kernel gave a wrong result"
    _opened.setdefault(_key(info), device)
    return None


def _key(info: DeviceInfo) -> tuple[int, DeviceInfo]:
    return os.getpid(), info


def _limited(info: DeviceInfo, threads: int) -> DeviceInfo:
    """A part of a CPU that has so many cores, or all of it. Raises DeviceError."""
    if not is_whole(threads) or threads < 1:
        raise DeviceError(f"threads must be a whole number above zero, not {threads!r}")
    if not info.is_cpu:
        raise DeviceError(f"threads are of a CPU, and {info.label} is none")
    return info if threads >= info.compute_units else _part(info, int(threads))


@functools.cache
def _part(info: DeviceInfo, threads: int) -> DeviceInfo:
    """A part of a CPU, the same each time, so that its context is kept. Raises DeviceError."""
    by_counts = [cl.device_partition_property.BY_COUNTS, threads, 0]
    try:
        part = info.cl_device.create_sub_devices(by_counts)[0]
    except cl.Error as error:
        raise DeviceError(
            f"{info.label} cannot be limited to {threads} threads: {error}"
        ) from error
    return dataclasses.replace(info, cl_device=part, compute_units=threads)


def _first(info: DeviceInfo) -> Device:
    """The device in the process's context, which is opened the first time. Raises DeviceError."""
    # Of two threads at once both open a context, and the first is kept: a lock might be held by
    # another thread when the process is forked.
    return _opened.get(_key(info)) or _opened.setdefault(_key(info), Device.open(info))


def share_compilers(devices: Sequence[Device], threads: int | None, resources: ExitStack) -> None:
    """Let other processes compile for devices whose driver compiles one text at a time.

    threads: cores of a CPU to use, at most; resources: get these processes.
    """
    slow = [on for on in devices if on.info.compiles_singly]
    spare = min([spare_cores(), *((threads or on.info.compute_units) - 1 for on in slow)])
    if slow and spare > 0:
        compilers = resources.enter_context(Compilers(spare))
        for on in slow:
            on.compilers = compilers


def _matching(which: str | int | None, infos: tuple[DeviceInfo, ...]) -> list[DeviceInfo]:
    """The devices with an index or a part of a name, the preferred ones first.

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
        taken = ", ".join(f"{1e3 * s:.2f} ms by {i.platform}" for i, s in seconds.items())
        return f"in a short trial no runtime of this CPU was faster by a tenth, remembered: {taken}"
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
        log.info("no OpenCL platform: %s", error)  # who needs a device says so
        return
    for platform in sorted(platforms, key=lambda platform: platform.name):
        try:
            found = platform.get_devices()
        except cl.Error as error:
            log.warning("platform %s is passed over: %s", platform.name, error)
            continue
        if not found:
            log.debug("platform %s has no devices", platform.name)
        yield from found


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
