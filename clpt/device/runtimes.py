"""Preparation of OpenCL's runtimes before the loader lists platforms.

The loader reads ICD files, each with the path of a driver's library, from /etc/OpenCL/vendors or
the folder in OCL_ICD_VENDORS. The wheel of Intel's CPU runtime (extra `clpt[cpu]`) has such a file
with a placeholder for the path, in a folder that no loader reads. So clpt writes a folder with the
library's path and a copy of every ICD file of the system, and sets OCL_ICD_VENDORS while the loader
reads it. A user's OCL_ICD_VENDORS stays as it is.

Drivers and PyOpenCL run code from their caches. So no other user may write to a cache folder or
replace it (`disk_cache.unfit`). If a folder breaks this rule, if it cannot be written (PoCL then
lists no device, and PyOpenCL runs no kernel), and for a user without a home, clpt sets another
folder for its process. PoCL's cache lies in clpt's, unless the user has set a safe folder.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import logging
import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import pyopencl as cl

from clpt.files import disk_cache, output_files

from ..errors import DeviceError, MemoryBudgetError

MEMORY_ADVICE = "lower the size of the image or simplify the scene, or choose another device"

_code = cl.status_code
_NO_MEMORY = (_code.MEM_OBJECT_ALLOCATION_FAILURE, _code.OUT_OF_HOST_MEMORY)
_ADVICE = {
    _code.OUT_OF_RESOURCES: "the device has no resources left, or its driver stopped a kernel "
    "that took too long: take a smaller picture or fewer slots, and make a new object",
    **dict.fromkeys(
        (_code.DEVICE_NOT_AVAILABLE, _code.INVALID_COMMAND_QUEUE, _code.INVALID_CONTEXT),
        "the device was reset or removed: open it again in a new process; if that fails too, the "
        "system's log may tell why",
    ),
    -9999: "a kernel read or wrote beyond its buffers, as NVIDIA's driver says by this number: a "
    "fault of clpt or of the compiler, which to report; go on in a new process",
    _code.EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST: "a command or an event that it waits for "
    "failed before it: look at that one",
}  # fmt: skip
if sys.platform != "win32":
    import resource

log = logging.getLogger(__name__)

ADVICE = (
    "install a driver (Debian, Ubuntu: apt-get install pocl-opencl-icd) "
    'or a CPU runtime with pip install "clpt[cpu]"'
)
VARIABLE = "OCL_ICD_VENDORS"
# Variables for drivers' cache folders: PoCL, NVIDIA, Intel (two), Mesa, AMD.
CACHES = (
    "POCL_CACHE_DIR", "CUDA_CACHE_PATH", "NEO_CACHE_DIR", "cl_cache_dir", "MESA_SHADER_CACHE_DIR",
    "AMD_COMGR_CACHE_DIR",
)  # fmt: skip
_NVIDIA = "~/.nv/ComputeCache"  # its driver's default
_SYSTEM = Path("/etc/OpenCL/vendors")
_WHEEL, _LIBRARY = "intel-opencl-rt", "libintelocl.so"


def refused(
    subject: str,
    error: cl.Error,
    nbytes: int | None = None,
    available: int | None = None,
    advice: str = MEMORY_ADVICE,
) -> DeviceError:
    """Return clpt's error for a driver's error.

    It is a MemoryBudgetError if memory of the device or the host has run out. Drivers of GPUs
    allocate late, so any command may fail so.

    subject: of the message, such as "a copy"; nbytes: needed, available: free, where known; advice:
    for missing memory.
    """
    if error.code in _NO_MEMORY or isinstance(error, cl.MemoryError):
        return MemoryBudgetError(subject, nbytes, available, f"{advice} ({error})")
    known = _ADVICE.get(error.code)
    return DeviceError(f"{subject} failed: {f'{known} ({error})' if known else error}")


def failed_before(event: cl.Event) -> DeviceError:
    """Return the error for a caller's event that has already failed."""
    status = event.command_execution_status
    name = cl.status_code.to_string(status, "%d")
    return DeviceError(f"an event in `wait_for` has failed with {name}: nothing can wait for it")


def wait(event: cl.Event, subject: str = "a command") -> None:
    """Wait until an event has ended. Raises DeviceError, MemoryBudgetError."""
    try:
        event.wait()
    except cl.Error as error:
        raise refused(subject, error) from error


def advice() -> str:
    """Return what to do where there is no device: a limit may keep drivers from being loaded."""
    if sys.platform == "win32":
        return ADVICE
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return ADVICE
    told = f"the limit of {limit >> 20:,} MiB of address space (ulimit -v) may keep drivers out"
    return f"{told}; raise it, or {ADVICE}"


def platforms() -> list[cl.Platform]:
    """Return all platforms, including Intel's wheel. Raises pyopencl.Error.

    The loader reads its variable when it first lists platforms in a process. The variable is set
    during the call only.
    """
    _make_caches_writable()
    folder, before = vendors(), os.environ.get(VARIABLE)
    if folder is None:
        return cl.get_platforms()
    os.environ[VARIABLE] = str(folder)
    try:
        return cl.get_platforms()
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def environment() -> dict[str, str]:
    """Return environment variables for another process with the same platforms."""
    folder = vendors()
    return dict(os.environ) if folder is None else {**os.environ, VARIABLE: str(folder)}


@functools.cache
def vendors() -> Path | None:
    """Return a folder of ICD files including Intel's wheel; write it if missing.

    None without such a wheel, or if the loader finds its driver without clpt.
    """
    library = wheel_library()
    if library is None or os.environ.get(VARIABLE) or not sys.platform.startswith("linux"):
        return None
    drivers = icd_files((_SYSTEM, Path(sys.prefix) / "etc/OpenCL/vendors"))
    if any(Path(driver).name == _LIBRARY for driver in drivers.values()):
        return None
    drivers["clpt-intel-cpu.icd"] = str(library)
    try:
        return write_vendors(drivers)
    except OSError as error:
        log.warning("%s cannot be made known to the OpenCL loader: %s", library, error)
        return None


@functools.cache
def _make_caches_writable() -> None:
    """Set the variables of runtimes' cache folders, once a process."""
    if not disk_cache.has_home():
        os.environ["XDG_CACHE_HOME"] = str(disk_cache.user_folder())
    clpt_folder = disk_cache.folder()
    for variable in CACHES:
        if path := os.environ.get(variable):
            os.environ[variable] = str(disk_cache.private_folder(Path(path)))
    if not os.environ.get("POCL_CACHE_DIR"):
        os.environ["POCL_CACHE_DIR"] = str(_created(clpt_folder / "pocl"))
    if not os.environ.get("CUDA_CACHE_PATH") and not _is_safe(_NVIDIA):
        os.environ["CUDA_CACHE_PATH"] = str(_created(clpt_folder / "nvidia"))


def _created(folder: Path) -> Path:
    """Return a folder, created if possible."""
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def _is_safe(path: str) -> bool:
    """Return whether other users cannot write to a folder in the user's home."""
    try:
        return output_files.ownership_fault(Path(path).expanduser()) is None
    except (OSError, RuntimeError):  # RuntimeError: a user without a home
        return False


def wheel_library() -> Path | None:
    """Return the library of Intel's CPU runtime, None if its wheel is not installed."""
    try:
        files = importlib.metadata.files(_WHEEL) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    paths = (Path(str(file.locate())).resolve() for file in files if file.name == _LIBRARY)
    return next((path for path in paths if path.is_file()), None)


def icd_files(folders: Iterable[Path]) -> dict[str, str]:
    """Return drivers' paths by ICD file, without missing paths."""
    drivers = {}
    for folder in folders:
        for path in sorted(folder.glob("*.icd")):
            try:
                driver = path.read_text(encoding="utf-8").strip()
            except (OSError, UnicodeDecodeError):
                continue
            if driver and (not os.path.isabs(driver) or os.path.exists(driver)):
                drivers[path.name] = driver
    return drivers


def write_vendors(drivers: dict[str, str]) -> Path:
    """Return a folder in the user's cache with these ICD files, named by their content."""
    digest = hashlib.sha256(repr(sorted(drivers.items())).encode()).hexdigest()[:16]
    folder = disk_cache.folder() / "vendors" / digest
    for name, driver in drivers.items():
        if not _names_driver(folder / name, driver):
            disk_cache.write(folder / name, driver.encode())
    output_files.remove_left(folder)  # the loader reads every file
    return folder


def _names_driver(path: Path, driver: str) -> bool:
    try:
        return disk_cache.read(path) == driver.encode()
    except OSError:
        return False
