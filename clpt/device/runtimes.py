"""OpenCL runtimes that pip installed: told to the loader before it looks for platforms."""

from __future__ import annotations

ADVICE = (
    "install a driver (Debian, Ubuntu: apt-get install pocl-opencl-icd) "
    'or a CPU runtime with pip install "clpt[cpu]"'
)


def announce() -> None:
    """Make the runtimes of this Python environment known to the OpenCL loader."""
