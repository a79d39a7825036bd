"""A camera that moves for long, and random messages: the viewer goes on, and does not grow.

CLPT_SOAK_SECONDS=3600 is an hour.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import re
import time
from pathlib import Path

import pytest

from clpt import device, load
from clpt.cli.process import allocator
from clpt.view.server import Server
from clpt.view.session import Session
from tests.view import campaign
from tests.view.attacker import cookie, do, opened

CORNELL = Path(__file__).resolve().parents[2] / "scenes" / "cornell_box"
SECONDS = float(os.environ.get("CLPT_SOAK_SECONDS", "60"))
WARM = 0.4  # of the time, in which caches fill
RANDOM_GROWTH = 300.0  # [MiB] where kernels are built and renderers are made by chance
GROWTH = 8.0  # [MiB] that the process may take more afterwards: of an allocator's whims


def resident() -> float:
    """What this process holds [MiB]."""
    status = Path("/proc/self/status")
    if not status.exists():
        pytest.skip("this system does not tell what a process holds")
    found = re.search(r"VmRSS:\s*(\d+) kB", status.read_text())
    assert found
    return int(found[1]) / 1024


def check(tally: campaign.Tally) -> None:
    """Assert that a viewer went on, answered all the time, and told of no fault and no folder."""
    print(tally)
    assert tally.status is None and tally.came["ended with 130 by Ctrl-C"] == 1
    assert not tally.faults and not tally.paths
    assert tally.answered > 2 and tally.sent["command"] > 50
    assert not [kind for kind in tally.came if kind.startswith("watch closed")]


@pytest.mark.long
def test_random_messages_end_nothing() -> None:
    """Seven clients, quick, slow and broken, for some seconds."""
    check(campaign.run(8.0))


@pytest.mark.slow
def test_random_messages_for_long() -> None:
    """And the process does not grow: after a while a scene's kinds and renderers have all been."""
    tally = campaign.run(2.0 * SECONDS, seed=1)
    check(tally)
    end = tally.memory[-1][0]
    before = max(size for at, size in tally.memory if at < WARM * end)
    after = max(size for at, size in tally.memory if at >= WARM * end)
    assert after <= before + RANDOM_GROWTH and max(tally.handles) < 100


@pytest.mark.slow
def test_a_moving_camera_takes_no_more_memory() -> None:
    """With edits, probes, maps and regions between moves, over the server's socket."""
    allocator.return_large_blocks()  # as the command does
    scene = load(CORNELL)
    film = dataclasses.replace(scene.film, width=160, height=120)
    server = Server()
    session = Session(dataclasses.replace(scene, film=film, spp=64), device.choose(), server)
    server.show(session)
    session.start()
    held: list[tuple[float, float]] = []
    frames, round_number, began = 0, 0, time.monotonic()
    try:
        with opened(server, cookie(server)) as client:
            while (now := time.monotonic() - began) < SECONDS:
                round_number += 1
                turn = 0.02 * math.cos(round_number / 40)
                do(client, "orbit", dx=turn, dy=0.3 * turn)
                if round_number % 20 == 0:
                    do(client, "inspect", x=round_number % 160, y=60)
                if round_number % 50 == 0:
                    maps = ("picture", "samples", "error", "albedo")
                    do(client, "shows", name=maps[round_number // 50 % 4])
                if round_number % 70 == 0:
                    low = 0.2 + 0.6 * (round_number % 9) / 9
                    do(client, "edit", target="material", index=1, key="reflectance",
                       value=[low, 0.4, 0.4])  # fmt: skip
                if round_number % 300 == 0:
                    half = {"x": 20, "y": 20, "width": 80, "height": 60}
                    do(client, "region", **(half if round_number % 600 else {}))
                end = time.monotonic() + (1.0 if round_number % 100 == 0 else 0.05)
                while (left := end - time.monotonic()) > 0:
                    with contextlib.suppress(TimeoutError):
                        received = client.recv(timeout=left)
                        if isinstance(received, bytes):
                            length = int.from_bytes(received[:4], "little")
                            frame = json.loads(received[4 : 4 + length])["frame"]
                            do(client, "shown", frame=frame)
                            frames += 1
                held.append((now, resident()))
        assert session.error is None
    finally:
        session.close()
        server.close()
    before = max(size for at, size in held if at < WARM * SECONDS)
    after = max(size for at, size in held if at >= WARM * SECONDS)
    print(f"{frames} frames; MiB:", *(f"{size:.1f}" for _, size in held[:: len(held) // 20]))
    assert frames > 5 * SECONDS / 2 and after <= before + GROWTH
