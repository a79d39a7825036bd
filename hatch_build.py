"""Put the commit into wheels and source archives, as clpt/commit.txt: see clpt/version.py."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CommitHook(BuildHookInterface):
    """Writes the commit of a checkout; an unpacked source archive has it already."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file, but to an editable install, which is asked by git itself."""
        if version == "editable" or not (Path(self.root) / ".git").exists():
            return
        command = ["git", "-C", self.root, "rev-parse", "--short=8", "HEAD"]
        try:
            asked = subprocess.run(command, capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return  # without git, or in a folder of another user: the version alone
        self.folder = tempfile.TemporaryDirectory()
        written = Path(self.folder.name) / "commit.txt"
        written.write_text(asked.stdout, encoding="ascii")
        build_data["force_include"][str(written)] = "clpt/commit.txt"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was written."""
        if hasattr(self, "folder"):
            self.folder.cleanup()
