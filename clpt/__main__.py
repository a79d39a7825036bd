"""The entry point: whatever happens, the user gets one clear line and an exit status."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

import click
import platformdirs

from . import output_files
from .cli import allocator, cli, stopping, streams
from .errors import ClptError

BAD_INPUT, BUG = 2, 1


def main() -> None:
    """Run the command line and leave with its exit status."""
    streams.make_safe()
    allocator.return_large_blocks()
    stopping.raise_at_signals()
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """Run the command line and return its exit status.

    0 success, 2 bad input, 1 a fault of clpt's own, 128 + number where a signal ended it: 130 is
    Ctrl-C.
    """
    try:
        status = cli.main(args=list(arguments), prog_name="clpt", standalone_mode=False)
        return status if isinstance(status, int) else 0
    except ClptError as error:
        return _complain(str(error), BAD_INPUT)
    except click.ClickException as error:
        return _complain(error.format_message(), BAD_INPUT)
    except KeyboardInterrupt as error:
        return _complain("interrupted", stopping.status(error))
    except click.Abort as error:
        return _complain("interrupted", stopping.status(error.__cause__))
    except Exception as error:
        return _complain(f"{type(error).__name__}: {error}{_keep_traceback()}", BUG)


def _complain(message: str, status: int) -> int:
    click.echo(f"clpt: error: {' '.join(message.split())}", err=True)
    return status


def _keep_traceback() -> str:
    """Write the current traceback to clpt's log folder; a phrase that tells where."""
    path = Path(platformdirs.user_log_dir("clpt", appauthor=False)) / "traceback.txt"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        output_files.write_text(path, traceback.format_exc())
    except OSError:
        return ""
    return f" (a fault of clpt; please report it with {path})"


if __name__ == "__main__":
    main()
