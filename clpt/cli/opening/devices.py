"""Devices of this machine."""

from __future__ import annotations

from ... import device as dev
from ..options.scene_options import Machine


def choose_devices(machine: Machine) -> list[dev.Device]:
    """Open what --device names. Raises DeviceError."""
    which, profiling, threads = machine.device, machine.profiling, machine.threads
    if which is not None and dev.names_several(which):
        return dev.choose_all(which, profiling=profiling, threads=threads)
    return [dev.choose(which, profiling=profiling, threads=threads)]
