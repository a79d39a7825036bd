# SPDX-License-Identifier: GPL-3.0-or-later
"""clpt as a render engine of Blender."""

from __future__ import annotations

from . import engine, panels, preferences, process, viewport

PARTS = (preferences, panels, viewport, engine)


def register() -> None:
    """Make Blender know the engine and its panels."""
    for part in PARTS:
        part.register()


def unregister() -> None:
    """Take the engine and its panels away."""
    for part in reversed(PARTS):
        part.unregister()
    process.end_all()
