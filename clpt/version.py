"""The version of clpt that is installed, and the commit that it was made from."""

from __future__ import annotations

import subprocess
from importlib import metadata
from pathlib import Path

try:
    VERSION = metadata.version("clpt")
except metadata.PackageNotFoundError:  # a checkout that is not installed
    VERSION = "0.0.0"

PACKAGE = Path(__file__).resolve().parent


def commit() -> str:
    """Return the abbreviated commit of a wheel or of a checkout, "" where nothing tells it.

    A wheel brings it as `commit.txt`, see hatch_build.py. A checkout is asked by git.
    """
    written = PACKAGE / "commit.txt"
    if written.is_file():
        return written.read_text(encoding="ascii").strip()
    if not (PACKAGE.parent / ".git").exists():
        return ""
    command = ["git", "-C", str(PACKAGE.parent), "rev-parse", "--short=8", "HEAD"]
    try:
        asked = subprocess.run(command, capture_output=True, text=True, check=False, timeout=5)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return asked.stdout.strip()


def described() -> str:
    """Return the version with its commit, such as "0.1.0 (1a2b3c4d)"."""
    made_from = commit()
    return f"{VERSION} ({made_from})" if made_from else VERSION
