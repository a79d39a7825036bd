"""A quarter of an hour with a GPU, by itself: what is measured first, in this order, a line each.

    python -m bench.first_hour FILE [--device NAME] [--minutes 14] [--scenes FOLDER] [--small]

FILE has a JSON line for each figure, written at once, and a line for each part that has ended. A
part has a process of its own and a limit of time. Started again with the same FILE it goes on with
the parts that have not ended; parts that ran out of time or failed come last. `--small` is a dry
run, on any device, of small sizes. FOLDER has scenes of Mitsuba's, which renders them beside clpt.
`python -m bench.report` makes a table of the lines in bench/results/first_hour*.jsonl.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import click

from bench.hour_steps import Row

BENCH = "first_hour"
END = "end"  # the figure of a part's last line
LIMITS = [f"{s}, {how}" for s in ("cornell", "spheres", "atrium") for how in ("limited", "free")]
SIX = ("cornell", "atrium", "spheres", "glass", "mist", "scenes/pool")
GPU_TESTS = (
    "tests/bvh",
    "tests/rays",
    "tests/kernels",
    "tests/embedding",
    "tests/render/wavefront",
)


@dataclass(frozen=True)
class Step:
    """A step: its name in `bench.hour_steps`, seconds that a part may take, and its parts.

    parts: of the lines so far and the folder of Mitsuba's scenes; the first `few` are enough for a
    dry run.
    """

    name: str
    limit: float
    parts: Callable[[Sequence[Row], str], Sequence[str]]
    few: int = 1


def fixed(*parts: str) -> Callable[[Sequence[Row], str], Sequence[str]]:
    """Return parts that do not depend on anything."""
    return lambda rows, scenes: parts


def checks(rows: Sequence[Row], scenes: str) -> list[str]:
    """Return the checks of first light."""
    from clpt.bench import first_light

    return [check.name for check in first_light.checks()]


def wrong_stages(rows: Sequence[Row], scenes: str) -> list[str]:
    """Return the stages that first light has found wrong."""
    wrong = [row for row in rows if row["step"] == "light" and row.get("wrong") and row["scene"]]
    return [f"{row['scene']}: {stage}" for row in wrong for stage in _texts(row["wrong"])]


def peers(rows: Sequence[Row], scenes: str) -> list[str]:
    """Return Mitsuba's scenes, each with a variant for CUDA."""
    root = Path(scenes)
    files = [str(file.relative_to(root)) for file in sorted(root.rglob("*.xml"))] if scenes else []
    return [f"{file} cuda_ad_{mode}" for mode in ("rgb", "spectral") for file in files]


def failed_tests(rows: Sequence[Row]) -> list[str]:
    """Return the tests that failed when they last ran."""
    last = {
        row["figure"]: _texts(row["wrong"])
        for row in rows
        if row["step"] == "tests" and "wrong" in row
    }
    return [test for failed in last.values() for test in failed]


def tests(rows: Sequence[Row], scenes: str) -> list[str]:
    return ["failed before"] * bool(failed_tests(rows)) + list(GPU_TESTS)


def _texts(value: object) -> list[str]:
    return [str(text) for text in value] if isinstance(value, list) else []


STEPS = (
    Step("light", 60, checks, few=3),
    Step("trees", 40, fixed("wide8 1", "compact 1", "binary 1", "wide8 32", "compact 32"), few=3),
    Step("rays", 40, fixed("wide8", "compact", "binary")),
    Step("stages", 30, fixed(*SIX)),
    Step("sorting", 30, fixed("scenes/pool", "atrium", "scenes/bulb", "scenes/table_glasses")),
    Step("layouts", 40, fixed("atrium", "glass")),
    Step("registers", 30, fixed(*LIMITS), few=2),
    Step("host", 20, fixed("cornell", "atrium")),
    Step("starting", 60, fixed("cornell")),
    Step("repro", 40, wrong_stages),
    Step("mitsuba", 60, peers),
    Step("tests", 120, tests),
)  # fmt: skip


def order(rows: Sequence[Row], scenes: str, small: bool) -> list[tuple[Step, str]]:
    """Return the parts that have not ended well, those that were tried already last."""
    ends = {(row["step"], row["part"]): row for row in rows if row.get("figure") == END}
    fresh, again = [], []
    for step in STEPS:
        parts = step.parts(rows, scenes)
        for part in parts[: step.few] if small else parts:
            end = ends.get((step.name, part))
            if end is None:
                fresh.append((step, part))
            elif end["ended"] != "well":
                again.append((step, part))
    return fresh + again


def run(step: str, part: str, settings: Row, limit: float) -> Iterator[Row]:
    """Run a part; yield its lines, then a line that tells how it ended."""
    command = [sys.executable, "-m", "bench.hour_steps", step, part, json.dumps(settings)]
    begin, ended, lines = time.monotonic(), "well", queue.Queue[str | None]()
    with (
        tempfile.TemporaryFile("w+") as errors,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=errors, text=True, start_new_session=True
        ) as process,
    ):
        assert process.stdout is not None
        threading.Thread(target=_pass_on, args=(process.stdout, lines), daemon=True).start()
        try:
            while (
                line := lines.get(timeout=max(0.0, begin + limit - time.monotonic()))
            ) is not None:
                yield json.loads(line)
            if process.wait():
                errors.seek(0)
                said = errors.read().strip().splitlines()
                ended = said[-1][:300] if said else f"exit status {process.returncode}"
        except queue.Empty:
            ended = f"out of time after {limit:.0f} s"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
    yield {"figure": END, "ended": ended, "seconds": round(time.monotonic() - begin, 1)}


def _pass_on(stream: IO[str], lines: queue.Queue[str | None]) -> None:
    for line in stream:
        if line.startswith("{"):
            lines.put(line)
    lines.put(None)


def read(file: Path) -> list[Row]:
    """Return the lines of this kind; a last line that was cut is passed over."""
    rows = []
    for line in file.read_text("utf-8").splitlines() if file.exists() else []:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return [row for row in rows if row.get("bench") == BENCH]


def measure(file: Path, settings: Row, minutes: float) -> Iterator[Row]:
    """Run parts until the time is over; yield each line after it was written."""
    from clpt import device
    from clpt.bench.records import circumstances, of_device

    until = time.monotonic() + 60 * minutes
    scenes, small = str(settings["scenes"]), bool(settings["small"])
    about = {
        "bench": BENCH,
        **circumstances(),
        **of_device(device.choose(str(settings["device"])).info),
    }
    tried: set[tuple[str, str]] = set()
    while (left := until - time.monotonic()) > 5:
        rows = read(file)
        parts = [(s, p) for s, p in order(rows, scenes, small) if (s.name, p) not in tried]
        if not parts:
            return
        step, part = parts[0]
        tried.add((step.name, part))
        more = {**settings, "failed": failed_tests(rows)}
        for row in run(step.name, part, more, min(step.limit * (4 if small else 1), left)):
            whole = {**about, "step": step.name, "part": part, **row}
            with file.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(whole) + "\n")
            yield whole


@click.command(help=__doc__)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--device", default="", help="index or part of the name")
@click.option("--minutes", default=14.0, show_default=True)
@click.option("--scenes", default="", help="a folder with scenes of Mitsuba's")
@click.option("--small", is_flag=True, help="a dry run")
def main(file: Path, device: str, minutes: float, scenes: str, small: bool) -> None:
    from clpt.device import choose

    name = choose(device or None).info.label
    folder = str(file.with_suffix(".repro"))
    settings: Row = {"device": name, "small": small, "scenes": scenes, "folder": folder}
    for row in measure(file, settings, minutes):
        if row["figure"] == END:
            print(
                f"{row['step']:10}{row['part']:32}{row['seconds']:6} s  {row['ended']}", flush=True
            )
        else:
            says = row.get("says") or row.get("refused") or f"{row['value']:.4g} {row['unit']}"
            print(f"{'':10}{row['figure']:40}  {says}", flush=True)


if __name__ == "__main__":
    main()
