"""Preparation of OpenCL's runtimes before the loader looks for platforms.

Runtimes that pip installed are made known to the loader.

The loader reads ICD files, each naming a driver's library, from /etc/OpenCL/vendors or from the
folder in OCL_ICD_VENDORS. Intel's CPU runtime as a wheel (extra `clpt[cpu]`) brings such a file
with a placeholder for a path, in a folder that no loader reads. So clpt writes a folder of its own
that names the library where it is, repeats every ICD file of the system, and points
OCL_ICD_VENDORS there while the loader reads it. Where the user has set OCL_ICD_VENDORS, it stays as
it is: whoever sets it wants exactly those drivers.

Drivers and PyOpenCL run what their caches hold. So one rule is for all of them, clpt's own too: no
other user can write the folder, nor put something in its place (`disk_cache.unfit`). Where that
does not hold, where a cache cannot be written (PoCL lists no device then, and PyOpenCL runs no
kernel), and for a user without a home, clpt gives its process another folder. PoCL's cache is
within clpt's own, unless the user has set a safe one.
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

from clpt.device import disk_cache
from clpt.files import output_files, ownership

if sys.platform != "win32":
    import resource

log = logging.getLogger(__name__)

ADVICE = (
    "install a driver (Debian, Ubuntu: apt-get install pocl-opencl-icd) "
    'or a CPU runtime with pip install "clpt[cpu]"'
)
VARIABLE = "OCL_ICD_VENDORS"
# Variables by which users tell drivers where caches are: PoCL, NVIDIA, Intel's two, Mesa, AMD.
CACHES = (
    "POCL_CACHE_DIR", "CUDA_CACHE_PATH", "NEO_CACHE_DIR", "cl_cache_dir", "MESA_SHADER_CACHE_DIR",
    "AMD_COMGR_CACHE_DIR",
)  # fmt: skip
_NVIDIA = "~/.nv/ComputeCache"  # where its driver has it else
_SYSTEM = Path("/etc/OpenCL/vendors")
_WHEEL, _LIBRARY = "intel-opencl-rt", "libintelocl.so"


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
    """Return all platforms, Intel's wheel among them. Raises what PyOpenCL raises.

    The loader reads its variable when it lists platforms for the first time in a process. It is set
    meanwhile, and then as it was.
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
    """Return the variables for another process that is to have the same platforms."""
    folder = vendors()
    return dict(os.environ) if folder is None else {**os.environ, VARIABLE: str(folder)}


@functools.cache
def vendors() -> Path | None:
    """Return the folder of ICD files that has Intel's wheel too, made where it is missing.

    None where there is no such wheel, or the loader finds its drivers without clpt.
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
    """Set the variables by which runtimes find their caches, once a process."""
    if not disk_cache.has_home():
        os.environ["XDG_CACHE_HOME"] = str(disk_cache.user_folder())
    own = disk_cache.folder()
    for variable in CACHES:
        if given := os.environ.get(variable):
            os.environ[variable] = str(disk_cache.private_folder(Path(given)))
    if not os.environ.get("POCL_CACHE_DIR"):
        os.environ["POCL_CACHE_DIR"] = str(_made(own / "pocl"))
    if not os.environ.get("CUDA_CACHE_PATH") and not _is_safe(_NVIDIA):
        os.environ["CUDA_CACHE_PATH"] = str(_made(own / "nvidia"))


def _made(folder: Path) -> Path:
    """Return a folder in clpt's own, made where it is missing and can be."""
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


def _is_safe(path: str) -> bool:
    """Return whether a folder in the user's home is this user's alone."""
    try:
        return ownership.fault(Path(path).expanduser()) is None
    except (OSError, RuntimeError):  # RuntimeError: a user without a home
        return False


def wheel_library() -> Path | None:
    """Return the library of Intel's CPU runtime if its wheel is installed in this environment."""
    try:
        files = importlib.metadata.files(_WHEEL) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    found = (Path(str(file.locate())).resolve() for file in files if file.name == _LIBRARY)
    return next((path for path in found if path.is_file()), None)


def icd_files(folders: Iterable[Path]) -> dict[str, str]:
    """Return the ICD files in the folders by name, without those that name a missing path."""
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
    """Return a folder in the user's cache with these ICD files, named after their content."""
    digest = hashlib.sha256(repr(sorted(drivers.items())).encode()).hexdigest()[:16]
    folder = disk_cache.folder() / "vendors" / digest
    for name, driver in drivers.items():
        if not _says(folder / name, driver):
            disk_cache.write(folder / name, driver.encode())
    output_files.remove_left(folder)  # the loader reads whatever is there
    return folder


def _says(path: Path, driver: str) -> bool:
    """Whether an ICD file of the cache names a driver."""
    try:
        return disk_cache.read(path) == driver.encode()
    except OSError:
        return False
