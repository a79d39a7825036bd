"""Starts of processes: seconds until a first picture, with empty and with full caches.

A new Python process imports clpt and renders 64x64 pixels with a sample each. In a cold start the
cache folders of clpt and of known drivers are empty.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from clpt.bench.figures import SECONDS, Figure
from clpt.errors import DeviceError
from clpt.files import child_processes, output_files

CACHES = (  # variables for cache folders of clpt and drivers
    "HOME", "XDG_CACHE_HOME", "POCL_CACHE_DIR", "CUDA_CACHE_PATH", "cl_cache_dir",
    "NEO_CACHE_DIR", "AMD_COMGR_CACHE_DIR",
)  # fmt: skip
SIDE = 64


def run(command: Sequence[str], caches: Path, **environment: str) -> tuple[float, float]:
    """Run a command with caches in a folder. Raises DeviceError with its last line.

    Returns the time from start to end, and the processor time [s].
    """
    variables = {name: str(caches / name.lower()) for name in CACHES}
    for folder in variables.values():
        os.makedirs(folder, exist_ok=True)
    with tempfile.TemporaryFile("w+") as output:
        start = time.perf_counter()
        process = subprocess.Popen(
            command, env={**os.environ, **variables, **environment},
            stdout=output, stderr=output,
        )  # fmt: skip
        cpu = float("nan")
        if hasattr(os, "wait4"):
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            cpu = usage.ru_utime + usage.ru_stime
        seconds = time.perf_counter() - start
        if process.wait():
            output.seek(0)
            words = output.read().strip().splitlines()[-1:] or [f"status {process.returncode}"]
            raise DeviceError(f"a measured process failed: {words[0]}")
    return seconds, cpu


def measure(
    scene: str, mode: str | None, device: str | int, rounds: int, name: str
) -> Iterator[Figure]:
    """Yield figures of a cold and a warm start, in seconds.

    scene: see `clpt.bench.opened`; device: an index or a part of a name; name: the scene's, for
    the figures. Raises DeviceError if a process fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        main = f"from {__name__} import main; main(*sys.argv[1:])"
        command = child_processes.command(main, str(report), scene, mode or "", str(device))
        for kind, times in (("cold", 1), ("warm", rounds)):
            run_times, stats = [], []
            for _ in range(times):
                report.unlink(missing_ok=True)
                run_times.append(run(command, Path(folder) / "caches"))
                stats.append(json.loads(report.read_text(encoding="utf-8")))
            yield _figure(f"{kind} start", run_times, stats, name)


def _figure(
    name: str, times: list[tuple[float, float]], stats: list[dict[str, Any]], scene: str
) -> Figure:
    seconds = [wall for wall, _ in times]
    middle = sorted(range(len(times)), key=seconds.__getitem__)[len(times) // 2]
    more = {**stats[middle], "cpu": times[middle][1]}
    figure = Figure("start", name, SECONDS, tuple(seconds), scene, more)
    dark = any(not fact["mean"] > 0.0 for fact in stats)
    longer = any(fact["ready"] > wall for fact, wall in zip(stats, seconds, strict=True))
    return figure.refuse(
        "its picture is black or not finite" if dark else "",
        "it was ready later than its process ended" if longer else "",
    )


def main(target: str, scene: str, mode: str, which: str) -> None:
    """Render a small picture, and write its times: the measured process."""
    start = time.perf_counter()
    import dataclasses

    from clpt.bench.scenes import opened
    from clpt.render.renderer import Renderer

    plan = opened(scene, mode or None)
    film = dataclasses.replace(plan.film, width=SIDE, height=SIDE, crop=None)
    plan = dataclasses.replace(plan, film=film)
    renderer = Renderer(plan, which or None)
    ready = time.perf_counter() - start
    renderer.run(1)
    mean = float(renderer.image().mean())
    builds = renderer.device.builds
    stats = {
        "mode": plan.film.mode,
        "ready": ready,
        "programs": builds.programs,
        "build_seconds": builds.seconds,
        "mean": mean if mean < float("inf") else 0.0,
        "memory": _peak(),
    }
    output_files.write_text(target, json.dumps(stats))


def _peak() -> int:
    """Return the largest resident set of this process [bytes]; 0 if unknown.

    getrusage would report the parent's, if that was larger.
    """
    try:
        peak = re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())
    except OSError:
        peak = None
    return int(peak[1]) * 1024 if peak else 0
