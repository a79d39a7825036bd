"""Measure everything: `python -m bench [NAME ...]`, or `make bench`.

`device` is `clpt bench`; the others compare with other renderers, or answer a question each. Every
part runs in a separate process; records go to bench/results/<date>-<machine>.jsonl, and the
page beside them is made again. The first run renders references for the errors, a few minutes more.
"""

from __future__ import annotations

import datetime
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import click

from bench import machine, report

PARTS: dict[str, tuple[str, ...]] = {
    "device": (),
    "traversal": ("--layout", "wide8"),
    "builders": (),
    "queries": (),
    "renders": (),
    "efficiency": (),
    "spectral": (),
    "effects": (),
    "lights": (),
    "hard_light": (),
    "media": (),
    "noise": (),
    "instancing": (),
    "embedding": (),
    "starting": (),
    "compiling": (),
    "shares": (),
    "devices": (),
    "checkpoints": (),
    "layers": (),
    "lens": (),
    "measured": (),
    "motion": (),
    "hair": (),
    "viewing": (),
    "sizes": ("--plot", str(report.RESULTS / "sizes.png")),
}


@click.command(help=__doc__)
@click.argument("parts", nargs=-1, type=click.Choice(list(PARTS)))
def main(parts: tuple[str, ...]) -> None:
    today = datetime.datetime.now(datetime.timezone.utc).date()
    target = report.RESULTS / f"{today}-{machine.kind()}.jsonl"
    failed = []
    for part in parts or PARTS:
        with tempfile.TemporaryDirectory() as folder:
            records = Path(folder) / "records.jsonl"
            words = ["clpt", "bench"] if part == "device" else [f"bench.{part}"]
            command = [sys.executable, "-m", *words, *PARTS[part], "--json", str(records)]
            if subprocess.run(command, cwd=machine.ROOT).returncode:
                failed.append(part)
            elif records.is_file():
                rows = [json.loads(line) for line in records.read_text().splitlines()]
                machine.append(target, part, rows)
    print(report.write())
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
