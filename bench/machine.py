"""Where and when something was measured, and the JSON lines that keep it."""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

ROOT = Path(__file__).parent.parent


def processor() -> str:
    """What the processor calls itself."""
    try:
        found = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    except OSError:
        found = None
    return found[1].strip() if found else platform.processor() or platform.machine()


def vectors() -> str:
    """The widest vector instructions of an x86 processor, which a virtual one's name may hide."""
    try:
        flags = set(Path("/proc/cpuinfo").read_text().split())
    except OSError:
        return ""
    return next((name for name in ("avx512f", "avx2", "avx", "sse2") if name in flags), "")


def kind() -> str:
    """A name for machines like this one that can be part of a file's name."""
    name = f"{processor()} {vectors()} {os.cpu_count()}cores"
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def commit() -> str:
    """The commit that is checked out, with a plus sign where files differ from it."""

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(ROOT), *arguments]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return ""
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", "clpt", "kernels")
    return git("rev-parse", "--short", "HEAD") + ("+" if changed else "")


def circumstances() -> dict[str, object]:
    """What every record tells: when, on what, at which commit, and how busy the machine was."""
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "commit": commit(),
        "processor": f"{processor()} {vectors()}".strip(),
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
    }


def console() -> Console:
    """Where tables are printed; a file or a pipe has no edge to wrap at."""
    there = Console()
    return there if there.is_terminal else Console(width=200)


def append(path: str | Path | None, bench: str, rows: Iterable[dict[str, object]]) -> None:
    """Add records to a file of JSON lines; no file, no record."""
    if path is None:
        return
    about = circumstances()
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    with open(path, "a", encoding="utf-8") as file:
        for row in rows:
            file.write(json.dumps({"bench": bench, **about, **row}) + "\n")
