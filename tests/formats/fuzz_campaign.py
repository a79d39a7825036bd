"""Many damaged files of each format: `python -m tests.formats.fuzz_campaign --inputs 20000`.

A worker reads them in a process with limits of memory and of time for each; where it dies, the
input counts as a crash and another one goes on behind it. Prints JSON: of each format how many
inputs were read, how many gave an error of one short line, and which gave anything else.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from clpt import errors
from tests.formats import fuzz_formats

ROOT = Path(__file__).resolve().parents[2]
MEMORY, SECONDS = 4 << 30, 20  # of a worker, and of an input
MARK = "outcome: "  # before what is ours: libraries print too
MOST_TOLD = 20  # inputs of a format that are named


class TooLong(BaseException):
    """An input takes more than its seconds."""


def outcome(name: str, number: int, folder: Path) -> str:
    """Return "read" or "refused" for what is right, else what an input gave."""
    form = fuzz_formats.FORMATS[name]
    path = folder / f"fuzz{form.suffix}"
    path.write_bytes(fuzz_formats.damaged(name, number))
    try:
        form.read(path)
    except errors.SceneError as error:
        text = str(error)
        if len(text) > errors.LONGEST or not text.isprintable():
            return f"a message of {len(text)} characters: {text[:60]!r}"
        return "refused"
    except TooLong:
        return f"more than {SECONDS} s"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:100]}"
    return "read"


def work(name: str, first: int, last: int) -> None:
    """Read inputs of a format, and print the outcome of each."""

    def end(*_: Any) -> None:
        raise TooLong

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGALRM, end)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(first, last):
            signal.setitimer(signal.ITIMER_REAL, SECONDS)
            print(MARK + outcome(name, number, Path(folder)), flush=True)
            signal.setitimer(signal.ITIMER_REAL, 0)


def campaign(name: str, first: int, inputs: int) -> dict[str, Any]:
    """Return what came of the inputs of a format."""
    began, at, last = time.perf_counter(), first, first + inputs
    counts: Counter[str] = Counter()
    faults: list[dict[str, Any]] = []
    while at < last:
        command = [sys.executable, "-m", "tests.formats.fuzz_campaign", "--work", name]
        done = subprocess.run(
            [*command, "--first", str(at), "--inputs", str(last - at)],
            cwd=ROOT, capture_output=True, text=True, check=False,
        )  # fmt: skip
        told = [line.partition(MARK) for line in done.stdout.splitlines()]
        lines = [line for _, mark, line in told if mark]
        if at + len(lines) < last:
            lines.append(f"the process ended: {done.returncode} {done.stderr.strip()[-200:]}")
        for number, line in enumerate(lines, at):
            counts[line if line in ("read", "refused") else "faults"] += 1
            if line not in ("read", "refused") and len(faults) < MOST_TOLD:
                faults.append({"input": number, "outcome": line})
        at += len(lines)
    seconds = round(time.perf_counter() - began, 1)
    return {"format": name, "inputs": inputs, **counts, "seconds": seconds, "told": faults}


def main() -> None:
    """Run the campaign that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--inputs", type=int, default=20_000, help="of each format")
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--formats", nargs="*", choices=list(fuzz_formats.FORMATS))
    parser.add_argument("--work", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.work:
        work(given.work, given.first, given.first + given.inputs)
        return
    for name in given.formats or fuzz_formats.FORMATS:
        print(json.dumps(campaign(name, given.first, given.inputs)), flush=True)


if __name__ == "__main__":
    main()
