"""What pages of documentation say in code: their blocks, and commands that must exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click

from clpt.cli import cli

FENCED = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[str]:
    """Return the fenced blocks of a language, in their order."""
    found = FENCED.findall(page.read_text("utf-8"))
    return [text for name, text in found if name == language]


def commands(page: Path) -> list[str]:
    """Return the lines of plain and shell blocks that call clpt, without what is said of them."""
    lines = "\n".join([*blocks(page, ""), *blocks(page, "sh")]).splitlines()
    return [line.split("   ")[0] for line in lines if line.startswith("clpt ")]


def lost(line: str, root: Path) -> list[str]:
    """Return the files of the repository that a command names and that are not there."""
    words = shlex.split(line, comments=True)
    named = [word for word in words if word.startswith(("scenes/", "tests/", "examples/"))]
    return [word for word in named if not (root / word).exists()]


def unknown(line: str) -> str:
    """Return what a line names that clpt does not have, a command or options; else nothing."""
    context = cli.make_context("clpt", ["devices"])
    _, name, *words = shlex.split(line, comments=True)
    if name == "--version":
        return ""
    command = cli.get_command(context, name)
    while isinstance(command, click.Group):
        name, *words = words
        command = command.get_command(context, name)
    if command is None:
        return name
    known = {option for parameter in command.params for option in parameter.opts}
    given = {word for word in words if re.match(r"-{1,2}[A-Za-z]", word)}  # not a number below zero
    return " ".join(sorted(given - known))


def smaller(line: str, *, spp: int = 1, size: str = "32x32") -> list[str]:
    """Return the arguments of a command; of a render, with few samples and, if it names no size,
    of a small picture."""
    words = shlex.split(line, comments=True)[1:]
    if words[0] == "render" and "--frames" not in words:
        words += ["--spp", f"{spp}"] + ([] if "--size" in words else ["--size", size])
    return words
