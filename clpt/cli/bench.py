"""`clpt bench`: the benchmarks of the repository, from a checkout."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import click

from ..errors import ClptError

ROOT = Path(__file__).parents[2]


@click.command(context_settings={"ignore_unknown_options": True, "help_option_names": []})
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def bench(arguments: tuple[str, ...]) -> int:
    """Measure speed, start-up and memory, beside Mitsuba and Embree (from a checkout)."""
    if not (ROOT / "bench" / "__main__.py").is_file():
        raise ClptError("the benchmarks are in clpt's repository: run `clpt bench` from a checkout")
    return subprocess.run([sys.executable, "-m", "bench", *arguments], cwd=ROOT).returncode
