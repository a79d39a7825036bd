"""How to run: choosing a device, building programs, buffers and timing. Knows no scenes."""

from .array import DeviceArray
from .buffers import Buffers
from .context import Device, DeviceInfo, choose, devices
from .program import Argument, Bound, Kernel, Program, build, build_all
from .source import Source, assemble
from .stream import Events, Stream
from .timing import Timing, Timings

__all__ = [
    "Argument",
    "Bound",
    "Buffers",
    "Device",
    "DeviceArray",
    "DeviceInfo",
    "Events",
    "Kernel",
    "Program",
    "Source",
    "Stream",
    "Timing",
    "Timings",
    "assemble",
    "build",
    "build_all",
    "choose",
    "devices",
]
