"""Renders that Ctrl-C or SIGTERM ends at random moments: what is left, and how soon they are gone.

`python -m tests.cli.interrupting COUNT SEED [ROOT]` prints figures as a line of JSON; ROOT: of
another checkout.
"""

from __future__ import annotations

import json
import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import termios
import threading
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from clpt import images
from clpt.errors import SceneError
from clpt.files.output_files import PARTIAL

ROOT = Path(__file__).resolve().parents[2]
SCENE = str(ROOT / "scenes" / "cornell_box")
CODE = "import clpt_command; clpt_command.main()"
SOON = 3.0  # seconds
MOMENTS = ("start", "any", "any", "render", "write", "cold")


@dataclass
class Figures:
    """What signals have done."""

    moments: Counter[str] = field(default_factory=Counter)
    statuses: Counter[str] = field(default_factory=Counter)
    pictures: Counter[str] = field(default_factory=Counter)  # by moment, where one was written
    seconds: list[tuple[float, str, float]] = field(default_factory=list)  # with moment and when
    faults: list[str] = field(default_factory=list)


@dataclass
class Run:
    """One render in a folder of its own; terminal: whether it writes to one."""

    folder: Path
    moment: str
    terminal: bool
    root: Path = ROOT
    said: bytearray = field(default_factory=bytearray)

    def start(self) -> None:
        for name in ("tmp", "out", "cache"):
            (self.folder / name).mkdir(exist_ok=True)
        env = {**os.environ, "TMPDIR": str(self.folder / "tmp"), "PYTHONPATH": str(self.root)}
        if self.moment == "cold":
            cold = self.folder / "cold"
            env |= {"XDG_CACHE_HOME": str(cold), "POCL_CACHE_DIR": str(cold / "pocl")}
            (cold / "pocl").mkdir(parents=True)
        large = self.moment == "write"
        words = ["render", SCENE, "-o", str(self.folder / "out" / "a.exr"), "--mode", "rgb"]
        words += ["--size", "1000x800" if large else "48x32"]
        words += ["--spp", "2" if large else "100000000"]
        self.master, slave = pty.openpty()
        self.before = termios.tcgetattr(slave)
        pipe = os.pipe() if not self.terminal else None
        self.slave, self.out = slave, pipe[1] if pipe else slave
        self.process = subprocess.Popen(
            [sys.executable, "-c", CODE, *words], cwd=self.folder / "out", env=env,
            stdin=slave, stdout=subprocess.DEVNULL, stderr=self.out,
            preexec_fn=lambda: [signal.signal(n, signal.SIG_DFL) for n in (2, 15)],
            start_new_session=True,
        )  # fmt: skip
        if pipe:
            os.close(pipe[1])
        self.reader = threading.Thread(target=self._read, args=(pipe[0] if pipe else self.master,))
        self.reader.daemon = True
        self.reader.start()

    def _read(self, handle: int) -> None:
        while True:
            try:
                piece = os.read(handle, 4096)
            except OSError:
                return
            if not piece:
                return
            self.said += piece

    def wait_for_moment(self, rng: random.Random) -> bool:
        """Wait; return whether the moment came before the end."""
        if self.moment in ("start", "any", "cold"):
            time.sleep(rng.uniform(0.0, {"start": 1.0, "any": 6.0, "cold": 25.0}[self.moment]))
            return self.process.poll() is None
        end = time.monotonic() + 60
        while self.process.poll() is None and time.monotonic() < end:
            if self.moment == "render" and b"spp" in self.said:
                time.sleep(rng.uniform(0.0, 1.0))
                return True
            if self.moment == "write" and any((self.folder / "out").glob(PARTIAL + "*")):
                time.sleep(rng.choice((0.0, 0.0, 0.01, 0.03)))
                return True
            time.sleep(0.001)
        return False

    def strays(self) -> list[str]:
        """The command lines of processes that it has left."""
        mark, found = f"TMPDIR={self.folder / 'tmp'}".encode(), []
        for path in Path("/proc").iterdir():
            try:
                if path.name.isdigit() and mark in (path / "environ").read_bytes():
                    found.append((path / "cmdline").read_bytes().replace(b"\0", b" ")[:60].decode())
            except OSError:
                continue
        return found


def press(folder: Path, moment: str, rng: random.Random, figures: Figures, root: Path) -> None:
    """Let one render begin and end."""
    number = signal.SIGTERM if rng.random() < 0.25 else signal.SIGINT
    run = Run(folder, moment, terminal=rng.random() < 0.5, root=root)
    run.start()
    began = time.monotonic()
    if not run.wait_for_moment(rng):
        figures.moments["missed"] += 1
        run.process.kill()
        run.process.wait()
        return
    when = time.monotonic() - began
    run.process.send_signal(number)
    sent = time.monotonic()
    faults = []
    try:
        status = run.process.wait(60)
    except subprocess.TimeoutExpired:
        run.process.kill()
        status = run.process.wait()
        faults.append("hung")
    figures.seconds.append((round(time.monotonic() - sent, 2), moment, round(when, 2)))
    figures.moments[moment] += 1
    figures.statuses[f"{signal.Signals(number).name} {status}"] += 1
    time.sleep(0.3)
    said = run.said.decode("utf-8", "replace")
    allowed = (128 + number, -number, 0) if moment == "write" else (128 + number, -number)
    if status not in allowed:
        faults.append(f"status {status}")
    if "Traceback" in said or said.count("clpt: error") > 1:
        faults.append("more than a line")
    if termios.tcgetattr(run.slave) != run.before or said.rfind("\x1b[?25l") > said.rfind(
        "\x1b[?25h"
    ):
        faults.append("the terminal is not as it was")
    left = {path.name for path in (folder / "out").iterdir()} - {"a.exr"}
    left |= {path.name for path in (folder / "tmp").iterdir()}
    if left:
        faults.append(f"left {sorted(left)}")
    if (folder / "out" / "a.exr").exists():
        figures.pictures[moment] += 1
        try:
            images.read(folder / "out" / "a.exr")
        except SceneError as error:
            faults.append(f"picture: {error}")
    elif "spp" in said.replace("building", "") and status > 0 and moment == "render":
        faults.append("no picture")
    if run.strays():
        time.sleep(1.0)
        faults += [f"stray {one}" for one in run.strays()]
    about = f"{moment} at {when:.2f} s, {number.name}"
    figures.faults += [f"{about}: {one}; {said[-300:]!r}" for one in faults]
    print(about, figures.seconds[-1], status, *faults, file=sys.stderr, flush=True)
    for handle in {run.master, run.slave}:
        os.close(handle)


def interrupt(count: int, seed: int, root: Path = ROOT) -> Figures:
    """End so many renders, each at a random moment."""
    rng, figures = random.Random(seed), Figures()
    for _ in range(count):
        folder = Path(tempfile.mkdtemp(prefix="clpt-interrupted-"))
        try:
            press(folder, rng.choice(MOMENTS), rng, figures, root)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    return figures


def main(arguments: Sequence[str]) -> None:
    count, seed = (int(word) for word in arguments[:2])
    figures = interrupt(count, seed, *(Path(word) for word in arguments[2:3]))
    seconds = sorted(figures.seconds)
    print(json.dumps({
        "count": count, "seed": seed, "moments": dict(figures.moments),
        "statuses": dict(figures.statuses), "pictures": dict(figures.pictures),
        "seconds_median": seconds[len(seconds) // 2][0] if seconds else None,
        "slowest": seconds[-8:], "late": sum(one[0] > SOON for one in seconds),
        "faults": figures.faults,
    }, indent=1))  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1:])
