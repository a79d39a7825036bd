# SPDX-License-Identifier: GPL-3.0-or-later
"""clpt as a render engine of Blender."""

from __future__ import annotations

from . import engine, panels


def register() -> None:
    """Make Blender know the engine and its panels."""
    panels.register()
    engine.register()


def unregister() -> None:
    """Take the engine and its panels away."""
    engine.unregister()
    panels.unregister()
