"""Help and errors of the command line come at once: they import no numpy and no OpenCL."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from clpt import choices
from clpt.bvh import layouts
from clpt.cli import COMMANDS, cli
from clpt.cli.options.records import HEADINGS, OTHER, Grouped
from clpt.images import colour
from clpt.render.film import layers
from clpt.scene import kinds
from clpt.scene.layers import LAYERS
from clpt.spectra import sensors, spaces

# Parts of clpt, and other packages, that a command's help may import.
PARTS = {
    "__main__", "choices", "clean_logs", "cli", "errors", "files", "formats",
    "render",  # its records of progress
    "version",
}  # fmt: skip
PACKAGES = {"click", "colorama", "clpt"}
CODE = """
import sys
before = {*sys.modules}
from clpt.__main__ import run
status = run(sys.argv[1:])
print("loaded", *sorted({*sys.modules} - before))
sys.exit(status)
"""


def loaded(*arguments: str, status: int = 0) -> set[str]:
    """The modules that a command imports, without those of Python itself."""
    done = subprocess.run(
        [sys.executable, "-c", CODE, *arguments], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == status, done.stderr
    names = done.stdout.splitlines()[-1].split()[1:]
    return {name for name in names if name.split(".")[0] not in sys.stdlib_module_names}


def unexpected(names: set[str]) -> list[str]:
    """The modules that help has no use for."""
    return sorted(
        name
        for name in names
        if name.split(".")[0] not in PACKAGES
        or (name.startswith("clpt.") and name.split(".")[1] not in PARTS)
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_help_imports_little(command: str) -> None:
    assert unexpected(loaded(command, "--help")) == []


@pytest.mark.parametrize("command", ["render", "view", "warm"])
def test_options_stand_under_a_heading(command: str) -> None:
    """Each once, in a screen of 80 columns, and examples are command lines that are understood."""
    one = cli.get_command(click.Context(cli), command)
    assert isinstance(one, Grouped)
    options = {p.name for p in one.params if isinstance(p, click.Option)}
    grouped = [name for names in HEADINGS.values() for name in names]
    assert options - {*grouped} == {"verbose", "quiet"} and len({*grouped}) == len(grouped)
    told = one.get_help(click.Context(one, info_name=command, max_content_width=80))
    assert max(map(len, told.splitlines())) <= 80
    headings = [line[:-1] for line in told.splitlines() if re.fullmatch(r"[A-Z].*:", line)]
    assert headings[-2:] == [OTHER, "Examples"] or (command == "warm" and headings[-1] == OTHER)
    for line, _ in one.examples:
        program, name, *words = shlex.split(line)
        assert (program, name) == ("clpt", command)
        one.make_context(name, words)


def test_headings_are_of_options_that_there_are() -> None:
    """All that stands under a heading is an option of some command."""
    commands = [cli.get_command(click.Context(cli), name) for name in COMMANDS]
    known = {p.name for one in commands if one for p in one.params}
    assert {name for names in HEADINGS.values() for name in names} - known == set()


@pytest.mark.parametrize(
    "command", ["render", "view", "warm", "info", "inspect", "kernels", "merge"]
)
def test_a_file_that_is_not_there_is_told_at_once(command: str, tmp_path: Path) -> None:
    needed = {"kernels": ["-o", str(tmp_path)], "merge": ["-o", str(tmp_path / "a.exr")]}
    arguments = [command, str(tmp_path / "no.json"), *needed.get(command, [])]
    assert unexpected(loaded(*arguments, status=2)) == []


def test_choices_are_the_names_of_what_there_is() -> None:
    tables = {
        "INTEGRATORS": kinds("integrator"),
        "SAMPLERS": kinds("sampler"),
        "LAYERS": LAYERS,
        "OBSERVERS": sensors.OBSERVERS,
        "SPACES": spaces.SPACES,
        "LAYOUTS": layouts.LAYOUTS,
        "TREES": layouts.TREES,
        "TONES": colour.TONES,
        "CHANNEL_NAMES": layers.SETS,
    }
    for name, table in tables.items():
        assert vars(choices)[name] == (*table,), name
