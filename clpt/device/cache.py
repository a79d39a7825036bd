"""What is kept on disk: the text of programs that did not build."""

from __future__ import annotations

import hashlib
from pathlib import Path

import platformdirs

from .source import Source


def folder() -> Path:
    """clpt's folder in the user's cache folder."""
    return Path(platformdirs.user_cache_dir("clpt", appauthor=False))


def keep_failed(source: Source) -> str | None:
    """Write a program that did not build where it can be read; its path, or None if that fails."""
    digest = hashlib.sha256(source.text.encode()).hexdigest()[:12]
    path = folder() / "failed" / f"{source.name.replace('/', '_').removesuffix('.cl')}-{digest}.cl"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source.text, encoding="utf-8")
    except OSError:
        return None
    return str(path)
