# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences of the extension: of this computer, and of no file that comes from elsewhere."""

from __future__ import annotations

from typing import Any

import bpy


class ClptPreferences(bpy.types.AddonPreferences):
    """Where clpt is."""

    bl_idname = __package__

    python: bpy.props.StringProperty(
        name="Python", subtype="FILE_PATH",
        description="A Python that has clpt; empty: the extension's own",
    )  # fmt: skip

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(self, "python")


def python() -> str:
    """Return the Python that the preferences name, or nothing."""
    addon: Any = bpy.context.preferences.addons.get(__package__)
    return "" if addon is None else addon.preferences.python


def register() -> None:
    """Register the preferences."""
    bpy.utils.register_class(ClptPreferences)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(ClptPreferences)
