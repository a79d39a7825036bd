"""The command `clpt`: until everything is imported, Ctrl-C ends it without a word.

This module stands outside of the package, whose import takes its time.
"""

import signal


def main() -> None:
    """Run the command line and leave with its exit status."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from clpt.__main__ import main

    main()
