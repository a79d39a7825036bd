"""Devices of OpenCL: choosing one, building programs, buffers and timing. Knows no scenes."""

from .array import DeviceArray, supersede
from .buffers import Buffers
from .context import Device, DeviceInfo, choose, devices
from .program import Argument, BoundKernel, Kernel, Program, build, build_all, link
from .source import Part, Source, Virtual, assemble, kernels_folder
from .stream import Events, Stream
from .timing import Timing, Timings

__all__ = [
    "Argument",
    "BoundKernel",
    "Buffers",
    "Device",
    "DeviceArray",
    "DeviceInfo",
    "Events",
    "Kernel",
    "Part",
    "Program",
    "Source",
    "Stream",
    "Timing",
    "Timings",
    "Virtual",
    "assemble",
    "build",
    "build_all",
    "choose",
    "devices",
    "kernels_folder",
    "link",
    "supersede",
]
