"""How to run: choosing a device, building programs, buffers and timing. Knows no scenes."""

from .context import Device, DeviceInfo, choose, devices
from .program import Argument, Bound, Kernel, Program, build, build_all
from .source import Source, assemble

__all__ = [
    "Argument",
    "Bound",
    "Device",
    "DeviceInfo",
    "Kernel",
    "Program",
    "Source",
    "assemble",
    "build",
    "build_all",
    "choose",
    "devices",
]
