"""A process that compiles, see `clpt.device.compilers`.

It is run by its path, and imports nothing of clpt to begin with, so it begins soon. It reads
requests from its standard input until that ends, as it does when whoever started it ends. What it
then still has to keep in the cache folder it finishes, in some seconds, at a low priority.
"""

from __future__ import annotations

import os
import pickle
import queue
import sys
import threading
from typing import Any

import pyopencl as cl
from pyopencl import _cl


def main() -> None:
    """Answer (job, platform, device, options, text) with a binary or None.

    (job, platform, device, options, binaries, place) has no answer: the result is kept.
    """
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what drivers print is no reply
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(requests,), daemon=True).start()
    opened: dict[tuple[str, str], cl.Context] = {}
    while True:
        request = requests.get()
        if request is None:
            os._exit(0)
        _, platform, device, options, given, place = request
        try:
            if (platform, device) not in opened:
                opened[platform, device] = cl.Context([_device(platform, device)])
            context = opened[platform, device]
            if place is not None:
                _keep(_link(context, given), *place)
                continue
            binary = _compile(context, options, given)
        except Exception:  # the caller compiles it again, and finds the error
            if place is not None:
                continue
            binary = None
        pickle.dump(binary, replies)
        replies.flush()


def _read(requests: queue.SimpleQueue[Any]) -> None:
    """Hand requests on; at the end of them end the process, or let it do first what is kept."""
    keeps = False
    while True:
        try:
            request = pickle.load(sys.stdin.buffer)
        except Exception:  # the end
            if not keeps:
                os._exit(0)
            request = None
        requests.put(request)
        if request is None:
            return
        keeps |= request[-1] is not None


def _device(platform: str, device: str) -> cl.Device:
    found = (d for p in cl.get_platforms() if p.name.strip() == platform for d in p.get_devices())
    return next(d for d in found if d.name.strip() == device)


def _compile(context: cl.Context, options: str, text: str) -> bytes:
    program = _cl._Program(context, text)
    program.compile(options.encode(), context.devices, [])
    return _binary(program)


def _link(context: cl.Context, binaries: list[bytes]) -> bytes:
    if hasattr(os, "nice"):
        os.nice(10)  # a picture may be rendered meanwhile
    parts = [cl.Program(_cl._Program(context, context.devices, [it])) for it in binaries]
    return _binary(cl.link_program(context, parts, [], context.devices))


def _keep(binary: bytes, entry: str, header: str, folder: Any) -> None:
    from clpt.device import disk_cache  # here: it imports all of clpt

    disk_cache.store(entry, header, binary, folder)


def _binary(program: Any) -> bytes:
    binary: bytes = program.get_info(cl.program_info.BINARIES)[0]
    return binary
