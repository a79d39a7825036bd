"""Devices: their list, and a device with a context and a queue."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import pyopencl as cl

from clpt.device import (
    forking,
    runtimes,
)
from clpt.files import budget, disk_cache

from ..errors import DeviceError
from .compilers import Compilers
from .program import cache_of

log = logging.getLogger(__name__)

_GPU_SHARE = 0.85  # a desktop and other programs keep some of a GPU's memory


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
    """A context with a queue on a device.

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


def devices() -> tuple[DeviceInfo, ...]:
    """Return every device of every platform, in the order of the platforms' names.

    A platform that fails is left out, with a logged warning.
    """
    return tuple(_info(index, device) for index, device in enumerate(_cl_devices()))


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
