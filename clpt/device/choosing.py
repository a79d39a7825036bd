"""The choice of devices: by name, by index, or by the speed of their runtimes.

Runtimes of a processor are compared by a short trial, whose results are cached.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import logging
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl

from clpt.files import disk_cache

from ..arrays import is_whole
from ..errors import DeviceError
from . import native_programs, runtimes
from .compilers import Compilers, spare_cores
from .context import Device, DeviceInfo, devices
from .source import Source, assemble

log = logging.getLogger(__name__)

ENVIRONMENT = "CLPT_DEVICE"
GROUPS = ("all", "gpu")  # of devices, for `choose_all`
_ORDER = ("gpu", "accelerator", "cpu")
Run = Callable[[], object]  # runs a kernel and waits
_CLOSE = 1.1  # over the least seconds of a trial: runtimes count as equally fast
_TRIAL = "__kernel void trial(__global uint *out) { out[get_global_id(0)] = 7u; }"
_opened: dict[tuple[int, DeviceInfo], Device] = {}  # by process and device


@dataclass(frozen=True)
class Choice:
    """A chosen device, and the reason as text."""

    info: DeviceInfo
    reason: str


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
    texts = [_source(lanes).text for lanes in (8, 16)]
    times = remembered([*map(identity, peers), *texts], lambda: _measured(peers))
    if times is None:
        return infos, {}
    seconds = dict(zip(peers, times, strict=True))
    close = _CLOSE * min(times)
    ranked = sorted(peers, key=lambda i: (seconds[i] > close, not i.is_pocl, seconds[i]))
    return ranked + [info for info in infos if info not in ranked], seconds


def identity(info: DeviceInfo) -> str:
    """Return a text that identifies a device and its driver in clpt's cache."""
    return f"{info.label} {info.version} {info.driver} {info.compute_units}"


def _same_processor(info: DeviceInfo, other: DeviceInfo) -> bool:
    """Return whether two devices are runtimes of a CPU: PoCL puts a prefix before its name."""
    a, b = info.name.casefold(), other.name.casefold()
    return info.is_cpu and other.is_cpu and (a.endswith(b) or b.endswith(a))


def _measured(infos: Sequence[DeviceInfo]) -> list[float]:
    """Return the seconds of a trial on each device, in the process's contexts."""
    return measure_speed([(_first(info).queue, info.lanes) for info in infos])


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


_NODES, _ITEMS, _ROUNDS = 512, 64, 50


def measure_speed(runtimes: Sequence[tuple[cl.CommandQueue, int]]) -> list[float]:
    """Return the trial kernel's time on a core by each runtime [s].

    runtimes: a queue and its number of lanes for each. They run in turn, and the least of many
    short rounds counts, since other processes disturb only some rounds. Raises errors of drivers.
    """
    return least_seconds([_trial(queue, lanes) for queue, lanes in runtimes], _ROUNDS)


def least_seconds(
    runs: Sequence[Run], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> list[float]:
    """Return the least time of each of some runs, which take turns [s]; the first may compile."""
    least = [math.inf] * len(runs)
    for number in range(1 + rounds):
        for which, run in enumerate(runs):
            start = clock()
            run()
            seconds = clock() - start
            if number:
                least[which] = min(least[which], seconds)
    return least


def _trial(queue: cl.CommandQueue, lanes: int) -> Run:
    """Return a run of the trial kernel."""
    source, context = _source(lanes), queue.context
    options = ("-cl-std=CL1.2", "-w")
    program = native_programs.build(context, queue.device, source.text, options)
    table = np.random.default_rng(1).random((_NODES, 64), np.float32)
    flags = cl.mem_flags
    nodes = cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=table)
    out = cl.Buffer(context, flags.WRITE_ONLY, 4 * lanes * _ITEMS)
    kernel = cl.Kernel(program, "trial")
    return lambda: kernel(queue, (_ITEMS,), (_ITEMS,), nodes, out).wait()


def remembered(names: Sequence[str], measured: Callable[[], list[float]]) -> list[float] | None:
    """Return the seconds of a trial, cached or measured; None after a failure.

    names: texts that identify drivers, processors and what runs; measured: runs the trial.

    A trial that started and did not end counts as failed: a driver that crashes the process does so
    once. Without a writable cache no trial runs. Another driver has another entry.
    """
    key = hashlib.sha256(repr(names).encode()).hexdigest()
    stored = disk_cache.load(key)
    if stored is None:
        disk_cache.store(key, "null", b"")
        stored = disk_cache.load(key)
        if stored is None:
            return None
        try:
            stored = json.dumps(measured()), b""
        except Exception as error:  # any exception of a broken driver
            log.debug("a trial failed: %s", error)
            return None
        except BaseException:  # Ctrl-C says nothing about the driver
            disk_cache.forget(key)
            raise
        disk_cache.store(key, *stored)
    seconds: list[float] | None = json.loads(stored[0])
    return seconds


def _source(lanes: int) -> Source:
    return assemble("stage/trial.cl", defines={"LANES": lanes, "TRIAL_NODES": _NODES})
