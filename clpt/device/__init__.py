"""Devices of OpenCL: choosing one, building programs, buffers and timing. Knows no scenes."""

from .array import DeviceArray, supersede
from .buffers import Buffers, host_buffer
from .context import Device, DeviceInfo, choose, devices
from .program import Argument, BoundKernel, Kernel, Program, build, build_all, link
from .refusals import refused, wait
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
    "host_buffer",
    "kernels_folder",
    "link",
    "refused",
    "supersede",
    "wait",
]
