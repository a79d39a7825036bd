"""How soon the page of `clpt view` has a picture, how soon it follows a drag, and what it costs.

The command runs in a separate process, with cached programs; a client of its socket replaces the
browser. `first`: from the start of the process to the first picture; `render`: to the first samples
of `clpt render` of the same scene. `cold`: with empty caches, to the first picture, in plain
colours while kernels compile, and to the first picture by the scene's kernels. `drag`: from a
message to its first picture, while the whole picture is being rendered; `own`: the part without
rendering (the same drag, less the seconds in the picture's header). `per_second`: pictures in a
drag of 2 s. `cost`: processor time of a sample with a viewer, above a sample's without. Medians.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import click
from rich.table import Table
from websockets.sync.client import ClientConnection, connect

import clpt
from bench import machine
from clpt.bench.starting import CACHES
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.view.session import Session

SCENES = ("cornell_box", "glass_caustics", "color_checker", "three_spheres")
PAUSE = 0.7  # [s] between drags: a pass of the whole picture is in flight again
FIRST_SAMPLE = """
import sys, time
from clpt.render.renderer import Renderer
run = Renderer.run
def told(self, samples, progress=None, **how):
    def tell(so_far):
        if so_far.paths:
            print("FIRST", time.monotonic(), flush=True)
            return False
        return True if progress is None else progress(so_far)
    return run(self, samples, tell, **how)
Renderer.run = told
sys.argv[0] = "clpt"
from clpt.__main__ import main
main()
"""


def command(scene: Path, size: str, *more: str) -> list[str]:
    return [str(scene), "--size", size, "--quiet", *more]


def first_of_render(scene: Path, size: str, out: Path) -> float:
    """Seconds from the start of a process to the first samples of `clpt render`."""
    start = time.monotonic()
    options = command(scene, size, "-o", str(out))
    process = subprocess.run(
        [sys.executable, "-c", FIRST_SAMPLE, "render", *options], stdout=subprocess.PIPE, text=True
    )
    match = re.search(r"FIRST (\S+)", process.stdout)
    assert match, process.stdout
    return float(match[1]) - start


class Client:
    """A viewer without a browser, of a `clpt view` in a process of its own."""

    def __init__(self, scene: Path, size: str, caches: Mapping[str, str] = MappingProxyType({})):
        self.start, self.changes = time.monotonic(), 0
        options = command(scene, size, "--no-browser", "--spp", "1000000")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "clpt", "view", *options],
            env={**os.environ, **caches}, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stdout
        address = self.process.stdout.readline().strip()
        self.address_after = time.monotonic() - self.start
        with urllib.request.urlopen(address) as answer:
            cookie = answer.headers["Set-Cookie"].split(";")[0]
        room = address.partition("?")[0].removeprefix("http://")
        host = room.split("/")[0]
        self.stack = contextlib.ExitStack()
        origin: Any = f"http://{host}"
        headers, free = {"Cookie": cookie}, {"compression": None, "max_size": None}
        opened = connect(f"ws://{room}socket", origin=origin, additional_headers=headers, **free)
        self.socket: ClientConnection = self.stack.enter_context(opened)

    def frame(self) -> dict[str, Any]:
        """The header of the next frame, which is confirmed."""
        while True:
            received = self.socket.recv(timeout=300)
            if isinstance(received, bytes):
                length = int.from_bytes(received[:4], "little")
                header = json.loads(received[4 : 4 + length])
                self.do("shown", frame=header["frame"])
                return header

    def do(self, name: str, **values: Any) -> None:
        self.socket.send(json.dumps({"do": name, **values}))

    def read_for(self, seconds: float) -> int:
        """Take what comes; return how many frames did."""
        frames, end = 0, time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            with contextlib.suppress(TimeoutError):
                received = self.socket.recv(timeout=left)
                if isinstance(received, bytes):
                    length = int.from_bytes(received[:4], "little")
                    self.do("shown", frame=json.loads(received[4 : 4 + length])["frame"])
                    frames += 1
        return frames

    def drag(self) -> tuple[float, dict[str, Any]]:
        """Turn the camera; return the seconds to the first picture of that, and its header."""
        start = time.monotonic()
        self.do("orbit", dx=0.01, dy=0.0)
        while True:
            header = self.frame()
            if header["changes"] > self.changes:
                self.changes = header["changes"]
                return time.monotonic() - start, header

    def close(self) -> None:
        self.stack.close()
        self.process.send_signal(signal.SIGINT)
        self.process.wait()


def first_pictures(client: Client) -> tuple[float, float]:
    """Return seconds from the start to the first picture, and to the first in full colours."""
    first: float | None = None
    while True:
        is_solid, after = client.frame()["solid"], time.monotonic() - client.start
        first = after if first is None else first
        if not is_solid:
            return first, after


def cold(scene: Path, size: str) -> dict[str, float]:
    """The first pictures with empty caches."""
    with tempfile.TemporaryDirectory() as folder:
        caches = {name: str(Path(folder) / name.lower()) for name in CACHES}
        for name in caches.values():
            os.makedirs(name)
        client = Client(scene, size, caches)
        first, first_own = first_pictures(client)
        client.close()
    return {"cold_first": first, "cold_own": first_own}


def drags(client: Client, rounds: int) -> dict[str, float]:
    """Return seconds from drags to their pictures; the whole picture continues between drags."""
    while client.frame()["divider"] > 1:
        pass
    taken, latencies = [], []
    for _ in range(rounds):
        client.read_for(PAUSE)
        seconds, header = client.drag()
        taken.append(seconds)
        latencies.append(seconds - header["waited"] - header["rendered"])
    client.read_for(PAUSE)
    start, frames = time.monotonic(), 0
    while time.monotonic() < start + 2.0:
        client.do("orbit", dx=0.002, dy=0.0)
        frames += client.read_for(1 / 30)
    return {
        "drag_ms": 1e3 * statistics.median(taken),
        "own_ms": 1e3 * statistics.median(latencies),
        "divider": header["divider"],
        "per_second": frames / (time.monotonic() - start),
    }


class Silent:
    """An outlet that sends nothing: what is left is what the session itself takes."""

    samples = 0.0

    def picture(self, header: dict[str, Any], data: bytes) -> None: ...

    def message(self, message: dict[str, Any]) -> None:
        self.samples = message.get("samples", self.samples)


def cost(scene: Scene, seconds: float, rounds: int) -> float:
    """Processor time of a sample in a session, above that in `Renderer.run`, in turns."""
    shares = []
    with Renderer(scene) as renderer:
        renderer.run(1)
        for _ in range(rounds):
            outlet = Silent()
            session = Session(scene, renderer.device, outlet)
            session.watched(1)
            session.start()
            while outlet.samples < 2:
                time.sleep(0.02)
            before, first = time.process_time(), outlet.samples
            time.sleep(seconds)
            gained = outlet.samples - first
            each = (time.process_time() - before) / max(gained, 1e-9)
            session.close()
            renderer.reset()
            renderer.run(2)
            before, many = time.process_time(), max(1, round(gained))
            renderer.run(many)
            alone = (time.process_time() - before) / many
            shares.append(each / alone - 1.0)
    return statistics.median(shares)


@click.command(help=__doc__)
@click.argument("names", nargs=-1)
@click.option("--size", default="1280x720", show_default=True)
@click.option("--rounds", default=5, show_default=True)
@click.option("--seconds", default=20.0, show_default=True, help="of a round of `cost`; 0: none")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    names: tuple[str, ...], size: str, rounds: int, seconds: float, json_file: str | None
) -> None:
    columns = (
        "scene", "cold: first, own [s]", "render [s]", "first [s]", "drag [ms]", "own [ms]",
        "at 1/n", "pictures/s",
    )  # fmt: skip
    table = Table(*columns, "cost", title=f"{machine.processor()}, {size}")
    for name in names or SCENES:
        file = machine.ROOT / "scenes" / name  # or the path of any other
        row: dict[str, Any] = {"scene": machine.scene_name(file), "size": size, **cold(file, size)}
        first: list[float] = []
        render: list[float] = []
        for i in range(rounds + 1):  # the first fills caches
            with tempfile.TemporaryDirectory() as folder:
                render.append(first_of_render(file, size, Path(folder) / "out.png"))
            client = Client(file, size)
            first.append(first_pictures(client)[0])
            if i == rounds:
                row |= drags(client, 4 * rounds)
            client.close()
        row |= {"first": statistics.median(first[1:]), "render": statistics.median(render[1:])}
        if seconds:
            scene = clpt.load(file)
            width, height = map(int, size.split("x"))
            film = dataclasses.replace(scene.film, width=width, height=height)
            plan = dataclasses.replace(scene, film=film, spp=1 << 20, noise=None)
            row["cost"] = cost(plan, seconds, rounds)
        machine.append(json_file, "viewing", [row])
        shown = (row["render"], row["first"], row["drag_ms"], row["own_ms"])
        table.add_row(
            name, f"{row['cold_first']:.3g}, {row['cold_own']:.3g}",
            *(f"{value:.3g}" for value in shown), f"{row['divider']}",
            f"{row['per_second']:.1f}", f"{100 * row['cost']:.1f} %" if seconds else "",
        )  # fmt: skip
    machine.console().print(table)


if __name__ == "__main__":
    main()
