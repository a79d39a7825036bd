"""Where the repository's own benchmarks keep what they measure."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

from clpt.bench import records
from clpt.bench.records import ROOT, circumstances, processor, vectors

__all__ = [
    "ROOT",
    "append",
    "circumstances",
    "console",
    "kind",
    "processor",
    "scene_name",
    "settle",
]


def kind() -> str:
    """Return a name of this kind of machine, for file names."""
    name = f"{processor()} {vectors()} {os.cpu_count()}cores"
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def console() -> Console:
    """Where tables are printed; a file or a pipe has no edge to wrap at."""
    there = Console()
    return there if there.is_terminal else Console(width=200)


def scene_name(scene: Path) -> str:
    """Return what a scene is called: its file or, where that is `scene.xml`, its folder."""
    return scene.parent.name if scene.stem == "scene" else scene.stem


def append(path: str | Path | None, bench: str, rows: Iterable[dict[str, object]]) -> None:
    """Add records to a file of JSON lines; no file, no record."""
    if path is not None:
        records.append(path, ({"bench": bench, **row} for row in rows))


def settle(caches: Path, quiet: float = 5.0, most: float = 60.0) -> None:
    """Wait till no file has come to a cache folder for `quiet` seconds, or for `most` in all.

    After a first render a process of clpt goes on for some seconds, and writes there.
    """
    began = changed = time.monotonic()
    count = -1
    while time.monotonic() < min(changed + quiet, began + most):
        if count != (count := sum(1 for _ in caches.rglob("*"))):
            changed = time.monotonic()
        time.sleep(0.2)
