# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the scene, and the panels that show them."""

from __future__ import annotations

from typing import ClassVar

import bpy

MODES = (
    ("spectral", "Spectral", "Light has wavelengths: dispersion, fluorescence, measured metals"),
    ("rgb", "RGB", "Light has three colors, as in Cycles"),
)


class ClptSettings(bpy.types.PropertyGroup):
    """How a scene is rendered."""

    mode: bpy.props.EnumProperty(name="Mode", items=MODES, default="spectral")
    samples: bpy.props.IntProperty(
        name="Samples", description="Paths of each pixel", default=128, min=1, max=1 << 20
    )
    python: bpy.props.StringProperty(
        name="Python", subtype="FILE_PATH",
        description="A Python that has clpt; empty: CLPT_PYTHON, or Blender's own",
    )  # fmt: skip


class CLPT_PT_sampling(bpy.types.Panel):
    """Samples, mode, and the Python that renders."""

    bl_label = "Sampling"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES: ClassVar = {"CLPT"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        settings = context.scene.clpt
        for name in ("mode", "samples", "python"):
            self.layout.prop(settings, name)


CLASSES = (ClptSettings, CLPT_PT_sampling)


def register() -> None:
    """Register settings and panels."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.clpt = bpy.props.PointerProperty(type=ClptSettings)


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.Scene.clpt
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
