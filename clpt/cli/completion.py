"""`clpt completion`: the TAB key of a shell completes commands, options and values."""

from __future__ import annotations

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from clpt.files import output_files

from ..errors import ClptError
from .options.values import Choice
from .process import terminal

SHELLS = ("bash", "zsh", "fish")
VARIABLE = "_CLPT_COMPLETE"  # a shell sets it to ask clpt


@click.command()
@click.argument("shell", type=Choice(SHELLS))
@click.option("--print", "printed", is_flag=True, help="Print the script, and install nothing.")
@click.pass_context
def completion(ctx: click.Context, shell: str, printed: bool) -> None:
    """Let the TAB key of a SHELL complete clpt's commands, options and values.

    The script is written to the user's folder for such scripts. It is in force in the next shell.
    """
    completer = get_completion_class(shell)
    assert completer is not None
    script = completer(ctx.find_root().command, {}, "clpt", VARIABLE).source()
    if printed:
        terminal.write(script)
        return
    path = file_of(shell)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        output_files.write_text(path, script)
    except OSError as error:
        raise ClptError(f"{path}: cannot be written: {error}") from error
    terminal.say(f"{path}  {advice(shell, path)}", err=False)


def file_of(shell: str) -> Path:
    """Return where a shell looks for the user's scripts of completion.

    Raises ClptError for a user without a home.
    """
    try:
        home = Path.home()
    except RuntimeError:
        raise ClptError("there is no home folder to write to; use --print") from None
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    settings = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
    return {
        "bash": data / "bash-completion" / "completions" / "clpt",
        "zsh": data / "zsh" / "site-functions" / "_clpt",
        "fish": settings / "fish" / "completions" / "clpt.fish",
    }[shell]


def advice(shell: str, path: Path) -> str:
    """Return the step that is left to the user."""
    if shell == "zsh":
        return f"put fpath+=({path.parent}) into ~/.zshrc, before compinit"
    needs = " with the package bash-completion" if shell == "bash" else ""
    return f"in force in the next {shell}{needs}"
