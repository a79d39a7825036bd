"""Textures on their way to the device."""

from __future__ import annotations

from collections.abc import Iterable


def dispatch_text(kinds: Iterable[str], roles: Iterable[tuple[str, str]]) -> str:
    """Return the functions that look textures up, for the (kind, role) pairs in the scene."""
    return ""
