"""Devices of this machine, and the processes that compile for them."""

from __future__ import annotations

from contextlib import ExitStack

from ... import device as dev
from ..options.scene_options import Machine


def choose_devices(machine: Machine) -> list[dev.Device]:
    """Open what --device names. Raises DeviceError."""
    which, profiling, threads = machine.device, machine.profiling, machine.threads
    if which is not None and dev.names_several(which):
        return dev.choose_all(which, profiling=profiling, threads=threads)
    return [dev.choose(which, profiling=profiling, threads=threads)]


def share_compilers(devices: list[dev.Device], machine: Machine, resources: ExitStack) -> None:
    """Let other processes compile for devices whose driver compiles one text at a time.

    resources: get these processes.
    """
    slow = [on for on in devices if on.info.compiles_singly]
    cores = [(machine.threads or on.info.compute_units) - 1 for on in slow]
    spare = min([dev.spare_cores(), *cores])
    if slow and spare > 0:
        compilers = resources.enter_context(dev.Compilers(spare))
        for on in slow:
            on.compilers = compilers


def kill_compilers(devices: list[dev.Device]) -> None:
    """End the processes that compile for devices: a process that ends must not wait for them."""
    for on in devices:
        if on.compilers is not None:
            on.compilers.kill()
