"""A compiler process, see `clpt.device.compilers`.

It runs by its path and imports nothing of clpt, so it starts quickly. It reads requests from its
standard input, which ends with the parent process.
"""

from __future__ import annotations

import math
import os
import pickle
import queue
import sys
import threading
import time
from typing import Any

import pyopencl as cl
from pyopencl import _cl

if sys.platform != "win32":
    import resource


def main() -> None:
    """Answer each (seconds, platform, device, options, text) with a binary, None for an error.

    The system ends the process if a compilation exceeds its seconds of processor time.
    """
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of drivers goes to standard error
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(requests,), daemon=True).start()
    opened: dict[tuple[str, str], cl.Context] = {}
    while True:
        seconds, platform, device, options, text = requests.get()
        _limit(seconds)
        try:
            if (platform, device) not in opened:
                opened[platform, device] = cl.Context([_device(platform, device)])
            binary = _compile(opened[platform, device], options, text)
        except Exception:  # the caller compiles again and reports the error
            binary = None
        pickle.dump(binary, replies)
        replies.flush()


def _limit(seconds: float) -> None:
    """Let the system end the process after further seconds of processor time."""
    if sys.platform != "win32":
        _, most = resource.getrlimit(resource.RLIMIT_CPU)
        end = math.ceil(time.process_time() + seconds) if math.isfinite(seconds) else most
        soft = end if most == resource.RLIM_INFINITY else min(end, most)
        resource.setrlimit(resource.RLIMIT_CPU, (soft, most))


def _read(requests: queue.SimpleQueue[Any]) -> None:
    """Put requests into the queue; end the process at the end of the input."""
    while True:
        try:
            request = pickle.load(sys.stdin.buffer)
        except Exception:  # the end
            os._exit(0)
        requests.put(request)


def _device(platform: str, device: str) -> cl.Device:
    matches = (d for p in cl.get_platforms() if p.name.strip() == platform for d in p.get_devices())
    return next(d for d in matches if d.name.strip() == device)


def _compile(context: cl.Context, options: str, text: str) -> bytes:
    program: Any = _cl._Program(context, text)
    program.compile(options.encode(), context.devices, [])
    binary: bytes = program.get_info(cl.program_info.BINARIES)[0]
    return binary
