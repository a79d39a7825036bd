"""Random messages from clients that are quick, slow and broken, to a `clpt view` in a process.

    python -m tests.view.campaign --seconds 900

Of what a client sends, about half are commands with values of their types, of which some are
parameters that the scene has; the rest are values of other types, JSON of any shape, bytes, parts,
pings, floods, and frames that break the protocol. Some clients read nothing, some only connect. The
process is asked all the time, by a client of its own, whether it goes on; its memory is noted.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import logging
import os
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from websockets.exceptions import InvalidHandshake, WebSocketException
from websockets.sync.client import ClientConnection, connect

from clpt.view.messages import COMMANDS, Choice, Flag, Name, Number, Optional, Type, Whole

quiet = logging.getLogger(__name__)
quiet.setLevel(logging.CRITICAL)
CORNELL = Path(__file__).resolve().parents[2] / "scenes" / "cornell_box"
CLIENTS = 8  # of which one only asks whether the viewer goes on
RATE = 40.0  # messages a second of a client that wants to stay
ANSWER_SECONDS = 60.0  # in which the viewer answers; kernels may be compiled meanwhile
WORDS = ("file", "type", "values", "lens", "image", "__class__", "../x", "/etc/passwd", "a\nb")
EDGES = (0, -1, 1, 0.5, 1e-30, -1e30, 1e30, 1e308, 2**31, 2**53, 10**400, float("nan"), "D65",
         "auto", None, True, [], {}, [0.1, 0.2, 0.3], [1e30] * 3, "aces", "bk7")  # fmt: skip


@dataclass
class Tally:
    """What was sent and what came of it."""

    sent: collections.Counter[str] = field(default_factory=collections.Counter)
    came: collections.Counter[str] = field(default_factory=collections.Counter)
    faults: collections.Counter[str] = field(default_factory=collections.Counter)
    paths: list[str] = field(default_factory=list)  # answers with a folder in them
    memory: list[tuple[float, float]] = field(default_factory=list)  # seconds, MiB
    handles: list[int] = field(default_factory=list)
    answered: int = 0
    slowest: float = 0.0  # [s] to an answer
    status: int | None = None  # of the process, None while it lives

    def take(self, text: str, hidden: str) -> None:
        """Note a message of the viewer."""
        if hidden in text:
            self.paths.append(text)
        message = json.loads(text)
        self.came[message["type"]] += 1
        if message["type"] == "error":
            if len(message["text"]) > 300 or not message["text"].isprintable():
                self.faults["not one line"] += 1
            if "fault of clpt" in message["text"] or "render ended" in message["text"]:
                self.faults[message["text"]] += 1


def _interruptible() -> None:
    """Let Ctrl-C end this process, which a shell may have switched off in the background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class View:
    """A `clpt view` in a process of its own; folder: for what is saved."""

    def __init__(self, folder: Path):
        options = ["--size", "48x36", "--mode", "rgb", "--spp", "8", "--quiet", "--no-browser"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "clpt", "view", str(CORNELL), *options, "-o", str(folder)],
            stdout=subprocess.PIPE, text=True,
            preexec_fn=_interruptible,
        )  # fmt: skip
        assert self.process.stdout
        address = self.process.stdout.readline().strip()
        with urllib.request.urlopen(address) as answer:
            self.cookie = answer.headers["Set-Cookie"].split(";")[0]
        self.room = address.partition("?")[0].removeprefix("http://")
        self.own = self.room.split("/")[0]
        host, port = self.own.split(":")
        self.place = host, int(port)

    def connect(self, **how: Any) -> ClientConnection:
        return connect(
            f"ws://{self.room}socket", origin=f"http://{self.own}",  # type: ignore[arg-type]
            additional_headers={"Cookie": self.cookie}, compression=None, max_size=None,
            open_timeout=ANSWER_SECONDS, close_timeout=1, ping_interval=None, logger=quiet, **how,
        )  # fmt: skip

    def memory(self) -> float:
        """What the process holds [MiB]; 0 where it does not tell."""
        status = Path(f"/proc/{self.process.pid}/status")
        found = re.search(r"VmRSS:\s*(\d+) kB", status.read_text()) if status.exists() else None
        return int(found[1]) / 1024 if found else 0.0

    def handles(self) -> int:
        """How many files and sockets it has open."""
        try:
            return len(os.listdir(f"/proc/{self.process.pid}/fd"))
        except OSError:
            return 0

    def end(self) -> int:
        """Send Ctrl-C; return the status."""
        self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(60)
        finally:
            self.process.kill()


def value_of(kind: Type, chance: random.Random) -> Any:
    """A value of a type, often at its ends."""
    if isinstance(kind, Optional):
        return None if chance.random() < 0.3 else value_of(kind.type, chance)
    if isinstance(kind, Number):
        return chance.choice([kind.low, kind.high, chance.uniform(kind.low, kind.high), 0.01])
    if isinstance(kind, Whole):
        return chance.choice([kind.low, kind.high, chance.randint(0, 50), chance.randint(0, 8)])
    if isinstance(kind, Choice):
        return chance.choice(kind.names)
    if isinstance(kind, Flag):
        return chance.random() < 0.5
    if isinstance(kind, Name):
        names = ("fov", "reflectance", "radiance", "picture", "error", "samples", "albedo", "depth")
        return chance.choice(names)
    return anything(chance)


def anything(chance: random.Random, levels: int = 3) -> Any:
    """JSON of any shape."""
    kind = chance.randrange(8 if levels else 5)
    if kind < 4:
        return chance.choice(EDGES)
    if kind == 4:
        return "".join(map(chr, chance.choices(range(1, 0x3000), k=chance.randrange(20))))
    if kind < 7:
        names = (*WORDS, *(key for one in COMMANDS.values() for key in one.parameters))
        return {chance.choice(names): anything(chance, levels - 1) for _ in range(3)}
    return [anything(chance, levels - 1) for _ in range(chance.randrange(5))]


def near(value: Any, chance: random.Random) -> Any:
    """A value that a scene's parameter may have had, or nearly."""
    if isinstance(value, bool) or value is None or chance.random() < 0.2:
        return chance.choice(EDGES)
    if isinstance(value, (int, float)):
        return chance.choice([value, -value, value * chance.uniform(0, 3), value * 1e6, int(value)])
    if isinstance(value, list):
        return [near(one, chance) for one in value] or value
    if isinstance(value, dict):
        return {key: near(one, chance) for key, one in value.items()}
    return value


def command_of(state: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    """A command: of any name, or one that edits what the scene has."""
    panels = state.get("panels") or []
    kind = chance.random()
    if panels and kind < 0.3:
        panel = chance.choice(panels)
        one = chance.choice(panel["parameters"] or [{"key": "x", "value": 1}])
        where = {"target": panel["target"], "index": panel["index"], "key": one["key"]}
        return {"do": "edit", **where, "value": near(one["value"], chance)}
    if panels and kind < 0.4:
        names = ("perspective", "thin_lens", "lens", "orthographic", "spherical", "matrix")
        camera = {one["key"]: near(one["value"], chance) for one in panels[0]["parameters"]}
        kept = {key: camera[key] for key in camera if chance.random() < 0.3}
        rows = [[chance.choice([0, 1, -1, 1e9]) for _ in range(4)] for _ in range(4)]
        extra = chance.choice([{}, {"to_world": rows}, {"medium": "x"}, {"view": rows}])
        given = {"type": chance.choice(names), **kept, **extra}
        return {"do": "open_view", "camera": given, "exposure": 0, "tone": "none"}
    names = [name for name in COMMANDS if name != "save" or chance.random() < 0.02]
    name = chance.choice(names)
    values = {key: value_of(one, chance) for key, one in COMMANDS[name].parameters.items()}
    if values and chance.random() < 0.2:
        values[chance.choice([*values])] = anything(chance)
    return {"do": name, **values}


def frame(opcode: int, payload: bytes = b"", fin: bool = True) -> bytes:
    """A frame of a client, of at most 125 bytes; its mask is zero."""
    return bytes([fin << 7 | opcode, 0x80 | len(payload)]) + bytes(4) + payload


def misbehave(client: ClientConnection, chance: random.Random) -> str:
    """Send bytes that end the socket or are not a command; return their name."""
    raw = client.socket
    kind = chance.choice(
        ["bytes", "json", "deep", "parts", "pings", "flood", "utf-8", "noise", "long"]
    )
    if kind == "bytes":
        client.send(chance.randbytes(chance.randrange(2000)))
    elif kind == "json":
        client.send(json.dumps(anything(chance)))
    elif kind == "deep":
        client.send(chance.choice(["[" * 60_000, '{"do":' * 9_000, "1" * 60_000, "[[]," * 15_000]))
    elif kind == "parts":
        raw.sendall(frame(1, b"{", False) + frame(0, b"", False) * chance.randrange(200))
    elif kind == "pings":
        raw.sendall(frame(9, b"x" * 125) * chance.randrange(2000))
    elif kind == "flood":
        for _ in range(300):
            client.send('{"do": "pause", "paused": false}')
    elif kind == "utf-8":
        raw.sendall(frame(1, chance.randbytes(20)))
    elif kind == "noise":
        raw.sendall(chance.randbytes(chance.randrange(200)))
    else:
        client.send("x" * chance.choice([65_536, 65_537, 1_000_000]))
    return kind


def talk(view: View, tally: Tally, chance: random.Random, end: float, hidden: str) -> None:
    """Be a client, again and again."""
    while time.monotonic() < end:
        state: dict[str, Any] = {}
        how = chance.choice(["steady"] * 3 + ["rude"] * 3 + ["deaf", "half", "leaves"])
        last = min(end, time.monotonic() + chance.uniform(1, 20))
        if how == "half":
            tally.sent["half a request"] += 1
            with contextlib.suppress(OSError), socket.create_connection(view.place, 10) as raw:
                raw.sendall(
                    chance.choice([b"", b"GET / HT", b"\0" * 100, b"GET / HTTP/1.1\r\nA: "])
                )
                time.sleep(chance.uniform(0, 2))
            continue
        try:
            with view.connect() as client:
                if chance.random() < 0.5:
                    client.send('{"do": "steer"}')
                while time.monotonic() < last:
                    if how == "rude" and chance.random() < 0.03:
                        tally.sent[misbehave(client, chance)] += 1
                    else:
                        client.send(json.dumps(command_of(state, chance)))
                        tally.sent["command"] += 1
                    if how == "leaves" and chance.random() < 0.02:
                        client.socket.close()
                        break
                    pause = time.monotonic() + 1 / RATE
                    while (left := pause - time.monotonic()) > 0:
                        if how == "deaf":
                            time.sleep(left)
                            continue
                        with contextlib.suppress(TimeoutError):
                            received = client.recv(timeout=left)
                            if isinstance(received, bytes):
                                length = int.from_bytes(received[:4], "little")
                                number = json.loads(received[4 : 4 + length])["frame"]
                                client.send(json.dumps({"do": "shown", "frame": number}))
                                tally.came["frame"] += 1
                                continue
                            tally.take(received, hidden)
                            if '"type": "state"' in received[:40]:
                                state = json.loads(received)
        except (WebSocketException, InvalidHandshake, OSError, EOFError, TimeoutError) as error:
            tally.came[f"closed: {type(error).__name__}"] += 1
            time.sleep(0.1)


def watch(view: View, tally: Tally, end: float, hidden: str) -> None:
    """Ask again and again whether the viewer goes on: the server, and the session behind it."""
    began = time.monotonic()
    while time.monotonic() < end and view.process.poll() is None:
        try:
            with view.connect() as client:
                while time.monotonic() < end:
                    asked = time.monotonic()
                    client.send('{"do": "copy_view"}')
                    while True:
                        received = client.recv(timeout=ANSWER_SECONDS)
                        if isinstance(received, str):
                            tally.take(received, hidden)
                            if '"type": "view"' in received[:40]:
                                break
                            if "left out" in received or "not ready" in received:
                                tally.came["asked again"] += 1
                                break
                    tally.answered += 1
                    tally.slowest = max(tally.slowest, time.monotonic() - asked)
                    tally.memory.append((time.monotonic() - began, view.memory()))
                    tally.handles.append(view.handles())
                    time.sleep(1.0)
        except (WebSocketException, InvalidHandshake, OSError, EOFError) as error:
            tally.came[f"watch closed: {type(error).__name__}"] += 1
            time.sleep(0.2)


def run(seconds: float, seed: int = 0) -> Tally:
    """Let all clients talk for some seconds; return what came of it."""
    tally = Tally()
    with tempfile.TemporaryDirectory(prefix="hidden-") as hidden:
        view = View(Path(hidden))
        end = time.monotonic() + seconds
        threads = [
            threading.Thread(
                target=talk, args=(view, tally, random.Random((seed << 8) + i), end, hidden)
            )
            for i in range(CLIENTS - 1)
        ]
        for thread in threads:
            thread.start()
        watch(view, tally, end, hidden)
        for thread in threads:
            thread.join()
        tally.status = view.process.poll()
        if tally.status is None:
            code = view.end()
            tally.came[f"ended with {code} by Ctrl-C"] += 1
    return tally


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    tally = run(given.seconds, given.seed)
    print("sent", dict(tally.sent), sum(tally.sent.values()))
    print("came", dict(tally.came))
    print("faults", dict(tally.faults), "paths", tally.paths[:3])
    print("answered", tally.answered, "slowest", round(tally.slowest, 2), "status", tally.status)
    step = max(1, len(tally.memory) // 20)
    print("MiB", [round(size) for _, size in tally.memory[::step]])
    print("handles", tally.handles[::step])


if __name__ == "__main__":
    main()
