"""Renders that are killed again and again, and go on: what was lost, and whether a bit differs.

`python -m tests.cli.killing KILLS SEED` prints figures as a line of JSON.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from clpt.cli.display import Display
from clpt.cli.files import checkpoints
from clpt.cli.files.targets import CHECKPOINT
from clpt.files.output_files import PARTIAL
from clpt.render.film import film_file
from clpt.render.film.film_file import SavedFilm

ROOT = Path(__file__).resolve().parents[2]
SCENE = str(ROOT / "scenes" / "cornell_box")
PERIOD = 0.3  # seconds between checkpoints
MOMENTS = ("start", "render", "write")  # when a process is killed


@dataclass
class Figures:
    """What kills have done: how many at which moment; seconds of work that each has lost."""

    kills: Counter[str] = field(default_factory=Counter)
    lost: list[float] = field(default_factory=list)
    partials: int = 0  # files that killed writers left behind
    former: int = 0  # kills after which only the file before the last one could be read
    left: int = 0  # of these, after a render that came to its end
    samples: int = 0
    equal: bool = False


def command(folder: Path, *more: str) -> list[str]:
    """The command line of a small render."""
    words = ["render", SCENE, "-o", str(folder / "a.film"), "--mode", "rgb", "--size", "160x120"]
    return [sys.executable, "-m", "clpt", *words, *more]


def kill_and_resume(folder: Path, kills: int, seed: int) -> Figures:
    """Kill a render so many times, let it end, and compare its film with that of one run."""
    rng, figures = random.Random(seed), Figures()
    path = folder / ("a" + CHECKPOINT)
    endless = command(folder, "--checkpoint", f"{PERIOD}s", "--spp", "1000000000")
    for _ in range(kills):
        moment = rng.choice(MOMENTS)
        with subprocess.Popen(endless, cwd=ROOT, stderr=subprocess.DEVNULL) as process:
            wait_for(moment, folder, path, rng)
            assert process.poll() is None, "the render ended by itself"
            process.kill()
            killed = time.time()
        figures.kills[moment] += 1
        figures.partials += len(list(folder.glob(PARTIAL + "*")))
        saved = last_film(path, figures)
        if saved is not None and moment != "start":
            figures.lost.append(killed - path.stat().st_mtime)
    figures.samples = saved.film.taken[-1][1] + 5 if saved else 5
    whole = folder / "whole"
    whole.mkdir()
    for into, more in ((folder, ["--checkpoint", "5m"]), (whole, [])):
        given = command(into, *more, "--spp", str(figures.samples), "--quiet")
        subprocess.run(given, cwd=ROOT, check=True)
    figures.left = len(list(folder.glob(PARTIAL + "*")))
    films = [film_file.read(into / "a.film").film for into in (folder, whole)]
    figures.equal = films[0].taken == films[1].taken and all(
        np.array_equal(getattr(films[0], name), getattr(films[1], name))
        for name in ("words", "bands")
    )
    return figures


def wait_for(moment: str, folder: Path, path: Path, rng: random.Random) -> None:
    """Wait for some moment of a render that has just begun."""
    if moment == "start":  # also before there is anything to save
        time.sleep(rng.uniform(0.0, 3.0))
        return
    before = path.stat().st_mtime_ns if path.exists() else 0
    while not path.exists() or path.stat().st_mtime_ns == before:
        time.sleep(0.005)
    if moment == "render":
        time.sleep(rng.uniform(0.0, 2.0 * PERIOD))
        return
    while not any(folder.glob(PARTIAL + "*")):
        time.sleep(0.0002)
    time.sleep(rng.uniform(0.0, 0.03))


def last_film(path: Path, figures: Figures) -> SavedFilm | None:
    """The film that a render would go on with. Raises SceneError if a file is lost."""
    notes: list[str] = []
    shown = Display()
    shown.note = notes.append
    saved = checkpoints.find(path, None, shown)
    figures.former += bool(notes)
    return saved


def main(arguments: Sequence[str]) -> None:
    kills, seed = (int(word) for word in arguments)
    with tempfile.TemporaryDirectory() as folder:
        figures = kill_and_resume(Path(folder), kills, seed)
    lost = figures.lost or [0.0]
    print(json.dumps({
        "kills": dict(figures.kills), "seed": seed, "equal": figures.equal,
        "samples": figures.samples, "period": PERIOD, "former": figures.former,
        "lost_mean": round(sum(lost) / len(lost), 3), "lost_most": round(max(lost), 3),
        "partials": figures.partials, "left": figures.left,
    }))  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1:])
