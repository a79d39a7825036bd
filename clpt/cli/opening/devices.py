"""Devices of this machine, and the processes that compile for them."""

from __future__ import annotations

from ... import device as dev
from ..options.scene_options import Machine


def choose_devices(machine: Machine) -> list[dev.Device]:
    """Open what --device names. Raises DeviceError."""
    which, profiling, threads = machine.device, machine.profiling, machine.threads
    if which is not None and dev.names_several(which):
        return dev.choose_all(which, profiling=profiling, threads=threads)
    return [dev.choose(which, profiling=profiling, threads=threads)]


def kill_compilers(devices: list[dev.Device]) -> None:
    """End the processes that compile for devices: a process that ends must not wait for them."""
    for on in devices:
        if on.compilers is not None:
            on.compilers.kill()
