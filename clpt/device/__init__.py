"""OpenCL devices, programs, buffers and times of kernels. Knows no scenes."""

from .array import DeviceArray, supersede
from .buffers import Buffers, Flag, host_buffer
from .building import build, build_all, compile_ahead, link
from .choosing import choose, choose_all, names_several, share_compilers
from .compilers import Compilers, kill_compilers, spare_cores
from .context import Device, DeviceInfo, devices
from .program import Argument, BoundKernel, Kernel, Program
from .runtimes import refused, wait
from .source import Part, Source, Virtual, assemble, kernels_folder
from .stream import Events, Rows, Stream, Timing, Timings, tiles

__all__ = [
    "Argument",
    "BoundKernel",
    "Buffers",
    "Compilers",
    "Device",
    "DeviceArray",
    "DeviceInfo",
    "Events",
    "Flag",
    "Kernel",
    "Part",
    "Program",
    "Rows",
    "Source",
    "Stream",
    "Timing",
    "Timings",
    "Virtual",
    "assemble",
    "build",
    "build_all",
    "choose",
    "choose_all",
    "compile_ahead",
    "devices",
    "host_buffer",
    "kernels_folder",
    "kill_compilers",
    "link",
    "names_several",
    "refused",
    "share_compilers",
    "spare_cores",
    "supersede",
    "tiles",
    "wait",
]
