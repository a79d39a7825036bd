"""Devices of this machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from ... import device as dev
from ...device import compile_limits
from ..options.scene_options import Machine
from ..process import failures


def choose_devices(machine: Machine) -> list[dev.Device]:
    """Open what --device names. Raises DeviceError."""
    which, profiling, threads = machine.device, machine.profiling, machine.threads
    if which is not None and dev.names_several(which):
        return dev.choose_all(which, profiling=profiling, threads=threads)
    return [dev.choose(which, profiling=profiling, threads=threads)]


@contextmanager
def ending_at_limit() -> Iterator[None]:
    """End the process with an error if a driver's compiler hangs in it: nothing else would."""

    def end(said: str) -> None:
        dev.kill_compilers()
        failures.complain(said)
        os._exit(failures.BAD_INPUT)

    before, compile_limits.at_limit = compile_limits.at_limit, end
    try:
        yield
    finally:
        compile_limits.at_limit = before
