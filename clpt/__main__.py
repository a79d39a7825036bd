"""The entry point: whatever happens, the user gets a single clear line and an exit status."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from .cli import cli
from .cli.process import allocator, ending, terminal


def main() -> None:
    """Run the command line and leave with its exit status."""
    terminal.make_safe()
    allocator.return_large_blocks()
    allocator.collect_later()
    # PoCL compiles a kernel once for its binary, and once more for each size of groups, if it may
    os.environ.setdefault("POCL_WORK_GROUP_SPECIALIZATION", "0")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's threads take .04 s to start
    try:
        ending.raise_at_signals()
        ending.end_at_second()
        status = run(sys.argv[1:])
    except KeyboardInterrupt as error:  # before `run` handles it, or a second Ctrl-C
        status = ending.ended_by(error)
    sys.exit(status)


def run(arguments: Sequence[str]) -> int:
    """Run the command line and return its exit status.

    0 success, 2 bad input, 1 a fault of clpt's own, 128 + number where a signal ended it: 130 is
    Ctrl-C.
    """
    try:
        status = cli.main(args=list(arguments), prog_name="clpt", standalone_mode=False)
        return status if isinstance(status, int) else 0
    except KeyboardInterrupt as error:
        return ending.ended_by(error)
    except Exception as error:
        interrupt = ending.interrupt_behind(error)
        if interrupt is not None:
            return ending.ended_by(interrupt)
        message, status = ending.message_of(error)
    ending.complain(message)
    return status


if __name__ == "__main__":
    main()
