"""Building and linking of programs, with caches, and errors with clpt's file and line."""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

import pyopencl as cl
from pyopencl.characterize import nv_compute_capability

from clpt.device import compilers, native_programs
from clpt.files import disk_cache

from ..errors import DeviceError, KernelBuildError
from .compilers import Job
from .context import Device
from .program import Program, Signatures, decode, encode, read_signatures
from .source import Source, kernels_folder

log = logging.getLogger(__name__)

OPTIONS = ("-cl-std=CL1.2", "-cl-kernel-arg-info", "-w")
_PART = "a part, to be linked"  # in a key, like _LIMIT
_LIMIT = "the limit of registers that suits it"
_COUNTED = re.compile(r"^<kernel>:(\d+):")
_GUARD = "-D_OPENCL_H_"
_Built = TypeVar("_Built")


def build(device: Device, source: Source, options: Sequence[str] = ()) -> Program:
    """Compile a program for the device, or load it from a cache.

    A program is built once a context. For drivers without a program cache (all but PoCL and
    NVIDIA) the binary is written to the user's cache folder. In a context with several devices the
    program is built for this device only.

    Raises KernelBuildError with clpt's file and line, the log, and the path of the text.
    """
    flags = _flags(device, options)
    on_disk = not has_own_cache(device.info.cl_device)
    program = _known(device, source, flags, on_disk)
    if program is not None:
        return program
    if on_disk:
        device.builds.on_new()
    entry = _entry(device, source, flags)
    device.builds.on_compile(entry)
    start = time.perf_counter()
    with compilers.watched(source):
        program = _from_source(device, source, flags)
        if on_disk:  # a binary is fully compiled; the driver's program may not be
            binary = native_programs.binary(program.cl_program)
            disk_cache.store(entry, encode(program.signatures), binary)
            program = _from_cache(device, source, flags, entry) or program
    device.builds.on_compiled(entry)
    return _built(device, source, flags, program, time.perf_counter() - start)


def has_own_cache(cl_device: cl.Device) -> bool:
    """Return whether the driver caches programs by their text, as PoCL and NVIDIA do.

    Older versions of PyOpenCL have no `has_src_build_cache`.
    """
    pocl = cl_device.platform.name == "Portable Computing Language"
    return pocl or nv_compute_capability(cl_device) is not None


def link(
    device: Device, sources: Mapping[str, Source], main: str, signatures: Signatures
) -> Program:
    """Compile programs and link them; `main` names the program with the kernels.

    signatures: of these kernels, since OpenCL does not report them for linked programs. Parts and
    result are written to the user's cache folder. The device's `compilers`, if any, compile parts
    in other processes. Raises KernelBuildError like `build`, and where parts do not fit together.
    """
    flags, whole = _flags(device, ()), _whole(sources, main)
    compile_ahead(device, sources, main)
    program = _known(device, whole, flags, _has_binaries(device))
    if program is not None:
        return program
    device.builds.on_new()
    entry = _entry(device, whole, flags)
    with disk_cache.exclusive(entry):  # another process may have built it meanwhile
        program = _known(device, whole, flags, _has_binaries(device))
        if program is not None:
            _drop_parts(device, sources, flags)
            return program
        start = time.perf_counter()
        with compilers.watched(whole):
            linked = _linked_with_retry(device, sources, whole, flags)
            program = Program(whole.name, linked, signatures)
            if _has_binaries(device):
                disk_cache.store(entry, encode(signatures), native_programs.binary(linked))
                program = _from_cache(device, whole, flags, entry) or program
        return _built(device, whole, flags, program, time.perf_counter() - start)


def _linked_with_retry(
    device: Device, sources: Mapping[str, Source], whole: Source, flags: list[str]
) -> cl.Program:
    """Link cached parts or, if the driver refuses them, new parts. Raises KernelBuildError."""
    try:
        return _linked(device, sources, flags, _part)
    except cl.Error as refusal:
        log.debug("%s is compiled again: %s", whole.name, refusal)
    try:
        return _linked(device, sources, flags, _compiled)
    except cl.Error as error:
        raise _build_error(whole, str(error)) from error


def compile_ahead(device: Device, sources: Mapping[str, Source], main: str) -> None:
    """Let the device's `compilers` start compiling the parts for `link`; do not wait."""
    flags = _flags(device, ())
    if device.compilers is None or not _has_binaries(device):
        return
    entry = _entry(device, _whole(sources, main), flags)
    if device.programs.find(_key(device, entry)) is not None or disk_cache.holds(entry):
        return
    if disk_cache.is_being_built(entry):  # by another process
        return
    for source in sources.values():
        part = _entry(device, source, [*flags, _PART])
        if not disk_cache.holds(part):
            text, options = next(forms(device, source.text, flags))
            seconds = compilers.seconds_for(source)
            names = device.info.platform, device.info.name
            device.builds.on_compile(part)
            job = Job(source.name, seconds, *names, " ".join(options), text)
            compiled = partial(device.builds.on_compiled, part)
            device.compilers.submit(part, job, first=device.hurries, done=compiled)
    device.builds.on_new()


def _drop_parts(device: Device, sources: Mapping[str, Source], flags: list[str]) -> None:
    """Cancel the parts that the device's `compilers` have not started."""
    if device.compilers is not None:
        for source in sources.values():
            device.compilers.drop(_entry(device, source, [*flags, _PART]))


def _whole(sources: Mapping[str, Source], main: str) -> Source:
    """Join the texts of a linked program, for its key and for errors."""
    files = dict.fromkeys(file for source in sources.values() for file in source.files)
    text = "\n".join(source.text for source in sources.values())
    return Source(sources[main].name, text, tuple(files))


def _linked(
    device: Device,
    sources: Mapping[str, Source],
    flags: list[str],
    part: Callable[[Device, Source, list[str]], cl.Program],
) -> cl.Program:
    """Return a linked program of the parts that `part` returns. Raises pyopencl.Error."""
    parts = [part(device, source, flags) for source in reversed(list(sources.values()))]
    return cl.link_program(device.context, parts, [], [device.info.cl_device])


def _part(device: Device, source: Source, flags: list[str]) -> cl.Program:
    """Return a compiled part: from the cache folder, another process, or this process.

    Raises pyopencl.Error if the driver refuses a foreign binary, here or during the link.
    """
    entry = _entry(device, source, [*flags, _PART])
    stored = disk_cache.load(entry) if _has_binaries(device) else None
    binary = stored[1] if stored else None
    if binary is None and device.compilers is not None:
        binary = device.compilers.take(entry)
        if binary is not None:
            disk_cache.store(entry, _PART, binary)
    if binary is None:
        return _compiled(device, source, flags)
    return cl.Program(device.context, [device.info.cl_device], [binary])


def _compiled(device: Device, source: Source, flags: list[str]) -> cl.Program:
    """Compile a part in this process. Raises KernelBuildError."""
    entry = _entry(device, source, [*flags, _PART])
    device.builds.on_compile(entry)
    try:
        make = partial(native_programs.compile_part, device.context, device.info.cl_device)
        part = first_built(device, source.text, flags, make)
    except cl.Error as error:
        raise _build_error(source, str(error)) from error
    if _has_binaries(device):
        disk_cache.store(entry, _PART, native_programs.binary(part))
    device.builds.on_compiled(entry)
    return part


def _has_binaries(device: Device) -> bool:
    return not _is_oclgrind(device)  # it interprets programs


def _known(device: Device, source: Source, flags: list[str], on_disk: bool) -> Program | None:
    """Return a program from the context's cache or, if `on_disk`, the folder; else None."""
    entry, start = _entry(device, source, flags), time.perf_counter()
    program: Program | None = device.programs.find(_key(device, entry))
    if program is None and on_disk:
        program = _from_cache(device, source, flags, entry)
        if program is not None:
            _built(device, source, flags, program, time.perf_counter() - start, cached=True)
    return program


def _built(
    device: Device,
    source: Source,
    flags: list[str],
    program: Program,
    seconds: float,
    cached: bool = False,
) -> Program:
    """Count a program, keep it in the context's cache, and return it."""
    device.builds.add(seconds, cached)
    log.debug("%s is %s in %.2f s", source.name, "loaded" if cached else "built", seconds)
    device.programs.keep(_key(device, _entry(device, source, flags)), program)
    return program


def _key(device: Device, entry: str) -> tuple[int, str]:
    """Return a program's key in its context, whose devices may have equal names."""
    return device.info.cl_device.int_ptr, entry


def build_all(device: Device, sources: Mapping[str, Source]) -> dict[str, Program]:
    """Build programs in parallel threads. Raises like `build`."""
    start, before = time.perf_counter(), device.builds.programs
    # Oclgrind's compiler is not thread-safe.
    threads = 1 if _is_oclgrind(device) else os.cpu_count() or 1
    with ThreadPoolExecutor(max_workers=max(1, min(len(sources), threads))) as pool:
        futures = {name: pool.submit(build, device, s) for name, s in sources.items()}
        programs = {name: future.result() for name, future in futures.items()}
    seconds, built = time.perf_counter() - start, device.builds.programs - before
    log.info("programs: %d in %.2f s, %d of them by the driver", len(programs), seconds, built)
    return programs


def _flags(device: Device, options: Sequence[str]) -> list[str]:
    # Oclgrind cannot interpret everything that its compiler's optimiser emits.
    plain = ["-cl-opt-disable", "-DNOT_INLINED"] if _is_oclgrind(device) else []
    return [*OPTIONS, *options, *plain]


def _is_oclgrind(device: Device) -> bool:
    return "oclgrind" in device.info.platform.casefold()


def _from_source(device: Device, source: Source, flags: list[str]) -> Program:
    try:
        native = _natively(device, source, flags)
    except cl.Error as error:
        raise _build_error(source, str(error)) from error
    try:
        return Program(source.name, native, read_signatures(native))
    except cl.Error as error:
        raise DeviceError(
            f"{device.info.label} does not tell the arguments of its kernels ({error}); "
            "clpt cannot run on this driver"
        ) from error


def _natively(device: Device, source: Source, flags: list[str]) -> cl.Program:
    """Let the driver build a text, within a limit of registers if it takes limits.

    Raises pyopencl.Error.
    """
    cl_device = device.info.cl_device
    make = partial(native_programs.build, device.context, cl_device)
    if not (source.registers and device.info.limits_registers):
        return first_built(device, source.text, flags, make)
    entry = _entry(device, source, [*flags, _LIMIT, *map(str, source.registers)])
    if chosen := disk_cache.load(entry):
        options = native_programs.register_options(int(chosen[0]))
        return make(source.text, [*flags, *options])

    def limited(limit: int) -> tuple[cl.Program, tuple[int, int]]:
        program = make(source.text, [*flags, *native_programs.register_options(limit)])
        return program, native_programs.registers_used(native_programs.log_of(program, cl_device))

    program, limit = native_programs.with_fewest_registers(source.registers, limited)
    if limit is not None:
        disk_cache.store(entry, str(limit), b"")
    return program


def _from_cache(device: Device, source: Source, flags: list[str], entry: str) -> Program | None:
    """Load a program from the cache folder; None if it is missing, or the driver refuses it."""
    stored = disk_cache.load(entry)
    if stored is None:
        return None
    try:
        loaded = native_programs.build(device.context, device.info.cl_device, stored[1], flags)
        return Program(source.name, loaded, decode(stored[0]))
    except (cl.Error, TypeError, ValueError) as error:
        log.debug("%s is built again: %s", source.name, error)
        return None


def _entry(device: Device, source: Source, flags: list[str]) -> str:
    """Return the cache's key: a hash of everything that the binary depends on."""
    info = device.info
    parts = (source.text, *flags, info.platform, info.name, info.version, info.driver)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _build_error(source: Source, log: str) -> KernelBuildError:
    """Return the first error of a log with clpt's file and line; write the text to disk."""
    names = "|".join(rf"(?:kernels/)?{re.escape(name)}" for name in source.files)
    location = re.compile(rf"""(?<![\w/.])({names})["']?(?::|, line |\()(\d+)""")
    rows = [row for row in log.splitlines() if re.search(r"\berror\b", row)]
    first = next(filter(None, map(location.search, rows)), None)
    file: str | None = None
    line: int | None = None
    if first:
        file, line = first[1], int(first[2])
    elif counted := next(filter(None, map(_COUNTED.search, rows)), None):
        file, line = source.location(int(counted[1]))  # NVIDIA's compiler ignores `#line`
    return KernelBuildError(
        source.name, file, line, log, disk_cache.keep_failed(source.name, source.text)
    )


def forms(device: Device, text: str, flags: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield the texts and options of a program, in the order of attempts."""
    if device.info.is_pocl:
        yield declarations() + text, [*flags, _GUARD]
    yield text, [*flags]


def first_built(
    device: Device, text: str, flags: Sequence[str], build: Callable[[str, list[str]], _Built]
) -> _Built:
    """Return the result of `build` for the first form that builds.

    Raises the pyopencl.Error of the last form.
    """
    *others, last = forms(device, text, flags)
    for form in others:
        try:
            return build(*form)
        except cl.Error:
            continue
    return build(*last)


@functools.cache
def declarations() -> str:
    """Return declarations of OpenCL's built-in functions, followed by #undef of their macros.

    PoCL puts clang's header before each text: 18,000 lines, which take longer than most of clpt's
    programs. With its guard macro defined the header is empty, and these declarations
    (`kernels/core/builtins.cl`) precede the text. A text that calls other functions, such as a
    user's, fails to build, and is built again with the header.
    """
    text = (kernels_folder() / "core" / "builtins.cl").read_text(encoding="utf-8")
    text = re.sub(r"/\*.*?\*/|\\\n\s*|\n(?=\n)", "", text, flags=re.DOTALL)
    macros = dict.fromkeys(re.findall(r"^#define (\w+)", text, re.MULTILINE))
    return text + "".join(f"#undef {name}\n" for name in macros)
