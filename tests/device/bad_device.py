"""PyOpenCL as a bad driver would offer it: between clpt and the driver that is there.

A `BadDevice` passes commands on, and refuses what its hazards tell it to. It says that it is a GPU,
so that clpt runs as on one: a stage a launch, a path a work-item, along queues.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pyopencl as cl
import pytest

from clpt import device as dev
from clpt.device import buffers

CODE = cl.status_code


def driver_error(code: int) -> cl.Error:
    """The error that PyOpenCL makes of a driver's code."""
    cls = cl.MemoryError if code == CODE.MEM_OBJECT_ALLOCATION_FAILURE else cl.RuntimeError
    return cls(cl._cl._ErrorRecord(msg="no", code=code, routine="clEnqueue"))


class Failed:
    """The event of a command that fails while it runs."""

    def __init__(self, code: int):
        self.command_execution_status = self.code = code

    def wait(self) -> None:
        raise driver_error(self.code)


@dataclass(frozen=True)
class Launch:
    """A kernel as it is given to the driver; number: of all launches, from 0 on."""

    number: int
    name: str
    items: int
    group: int
    local_memory: int


@dataclass
class BadDevice:
    """What the driver's commands do.

    changes: of the device's info; buffer: called with each buffer's size; launch: with each launch,
    and may return a code by which it fails while it runs; after that, `dead` is raised by every
    command, if it is given. Both raise what the driver refuses.
    """

    changes: dict[str, Any] = field(default_factory=dict)
    buffer: Callable[[int], None] = lambda _: None
    launch: Callable[[Launch], int | None] = lambda _: None
    dead: int | None = None
    launches: list[Launch] = field(default_factory=list)
    killed: bool = False

    def open(self) -> dev.Device:
        """The device of all tests as a GPU of two units."""
        on = dev.choose()
        info = dataclasses.replace(on.info, kind="gpu", compute_units=2)
        return dev.Device(on.context, on.queue, dataclasses.replace(info, **self.changes))

    def play(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Stand between clpt and the driver."""
        enqueue = cl.enqueue_nd_range_kernel
        bad = self

        class Counted(buffers.CountedBuffer):
            def __init__(self, context: cl.Context, flags: int, size: int, hostbuf: Any):
                bad.buffer(size or hostbuf.nbytes)
                super().__init__(context, flags, size=size, hostbuf=hostbuf)

        def run(queue: cl.CommandQueue, kernel: cl.Kernel, size: Any, group: Any, *more, **named):
            self._refuse()
            local = kernel.get_work_group_info(
                cl.kernel_work_group_info.LOCAL_MEM_SIZE, queue.device
            )
            launch = Launch(
                len(self.launches), kernel.function_name, math.prod(size), math.prod(group or (1,)),
                local,
            )  # fmt: skip
            self.launches.append(launch)
            if code := self.launch(launch):
                self.killed = True
                return Failed(code)
            return enqueue(queue, kernel, size, group, *more, **named)

        def guarded(command: Callable[..., Any]) -> Callable[..., Any]:
            def guard(*args: Any, **named: Any) -> Any:
                self._refuse()
                return command(*args, **named)

            return guard

        monkeypatch.setattr(buffers, "CountedBuffer", Counted)
        monkeypatch.setattr(cl, "enqueue_nd_range_kernel", run)
        for name in ("enqueue_copy", "enqueue_fill_buffer", "enqueue_marker"):
            monkeypatch.setattr(cl, name, guarded(getattr(cl, name)))

    def _refuse(self) -> None:
        if self.killed and self.dead is not None:
            raise driver_error(self.dead)


def no_images(monkeypatch: pytest.MonkeyPatch) -> None:
    """No image can be made."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise driver_error(CODE.INVALID_OPERATION)

    for name in ("Image", "create_image", "ImageFormat"):
        monkeypatch.setattr(cl, name, refuse)


def refuse_standard(monkeypatch: pytest.MonkeyPatch, code: int, log: str) -> list[bytes]:
    """The compiler refuses `-cl-std`, by a code or by its log. Returns the options of each attempt.

    A list that grows as programs are built.
    """
    attempts: list[bytes] = []

    class Program(cl._cl._Program):
        def _refuse(self, options: bytes) -> None:
            attempts.append(options)
            if b"-cl-std" in options:
                raise driver_error(code)

        def _build(self, options: bytes, devices: Any) -> None:
            self._refuse(options)
            super()._build(options, devices)

        def compile(self, options: bytes, devices: Any, headers: Any) -> None:
            self._refuse(options)
            super().compile(options, devices, headers)

        def get_build_info(self, device: cl.Device, what: Any) -> Any:
            return log

    monkeypatch.setattr(cl._cl, "_Program", Program)
    return attempts
