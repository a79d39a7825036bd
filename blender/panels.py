# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the scene, and the panels that show them."""

from __future__ import annotations

from typing import Any, ClassVar

import bpy

MODES = (
    ("spectral", "Spectral", "Light has wavelengths: dispersion, fluorescence, measured metals"),
    ("rgb", "RGB", "Light has three colors, as in Cycles"),
)
SURFACES = (
    ("NODES", "Nodes", "What the material's nodes say"),
    ("GLASS", "Glass", "A measured glass, liquid or crystal; it disperses in spectral mode"),
    ("METAL", "Metal", "A measured metal"),
)


class ClptSettings(bpy.types.PropertyGroup):
    """How a scene is rendered."""

    mode: bpy.props.EnumProperty(name="Mode", items=MODES, default="spectral")
    samples: bpy.props.IntProperty(
        name="Samples", description="Paths of each pixel", default=128, min=1, max=1 << 20
    )
    denoise: bpy.props.BoolProperty(
        name="Denoise", description="Take most of the noise from the finished picture"
    )
    noise: bpy.props.FloatProperty(
        name="Noise Limit",
        description="Pixels below this relative noise get no more samples; 0: no limit",
        min=0.0,
        max=1.0,
        precision=3,
    )
    viewport_samples: bpy.props.IntProperty(
        name="Viewport Samples", description="Paths of each pixel there", default=256, min=1,
        max=1 << 20,
    )  # fmt: skip


class ClptMaterial(bpy.types.PropertyGroup):
    """A surface by its substance, in place of the nodes."""

    kind: bpy.props.EnumProperty(
        name="Surface", items=SURFACES, description="What the surface is made of"
    )
    glass: bpy.props.StringProperty(
        name="Glass",
        default="n-bk7",
        description="A glass, a liquid or a crystal: n-bk7, n-sf11, water, diamond, sapphire, ...",
    )
    metal: bpy.props.StringProperty(
        name="Metal", default="gold", description="Its measured index: gold, copper, silver, W, ..."
    )
    roughness: bpy.props.FloatProperty(name="Roughness", min=0.0, max=1.0)
    film_thickness: bpy.props.FloatProperty(
        name="Film", description="Thickness of a thin film on it [nm]; 0: none", min=0.0, max=1e5
    )
    film_ior: bpy.props.FloatProperty(name="Film IOR", default=1.33, min=1.0, max=4.0)


class ClptLamp(bpy.types.PropertyGroup):
    """What a lamp emits, by a standard."""

    spectrum: bpy.props.StringProperty(
        name="Spectrum",
        description="A, D65, F1 to F12, HP1 to HP5, LED-B1, sodium, ...; empty: the color's",
    )


class ClptWorld(bpy.types.PropertyGroup):
    """A clear sky by the physics of air."""

    use_sky: bpy.props.BoolProperty(name="Clear Sky")
    elevation: bpy.props.FloatProperty(
        name="Sun Elevation", subtype="ANGLE", default=0.6, min=-0.2, max=1.5707
    )
    azimuth: bpy.props.FloatProperty(
        name="Sun Azimuth",
        description="From +X toward +Y",
        subtype="ANGLE",
        min=-6.2831,
        max=6.2831,
    )
    haze: bpy.props.FloatProperty(
        name="Haze",
        description="Optical depth straight up at 550 nm",
        default=0.1,
        min=0.0,
        max=2.0,
    )
    altitude: bpy.props.FloatProperty(name="Altitude", unit="LENGTH", min=0.0, max=60000.0)
    ground: bpy.props.FloatVectorProperty(
        name="Ground", subtype="COLOR", default=(0.2, 0.2, 0.2), min=0.0, max=1.0
    )
    strength: bpy.props.FloatProperty(name="Strength", default=1.0, min=0.0)


class Panel(bpy.types.Panel):
    """A panel of this engine; `names` are the settings that it shows."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES: ClassVar = {"CLPT"}
    names: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.scene

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and cls.owner(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        for name in self.names:
            self.layout.prop(self.owner(context).clpt, name)


class CLPT_PT_sampling(Panel):
    """Samples and mode."""

    bl_label = "Sampling"
    bl_context = "render"
    names = ("mode", "samples", "noise", "denoise", "viewport_samples")


class CLPT_PT_material(Panel):
    """Measured glasses and metals, and films on them."""

    bl_label = "Measured Surface"
    bl_context = "material"
    names = ("kind", "glass", "metal", "roughness", "film_thickness", "film_ior")

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.material


class CLPT_PT_lamp(Panel):
    """The spectrum of a lamp."""

    bl_label = "Spectrum"
    bl_context = "data"
    names = ("spectrum",)

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.light


class CLPT_PT_world(Panel):
    """The physical sky."""

    bl_label = "Clear Sky"
    bl_context = "world"
    names = (
        "use_sky", "elevation", "azimuth", "haze", "altitude", "ground", "strength",
    )  # fmt: skip

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.world


GROUPS = {
    "Scene": ClptSettings, "Material": ClptMaterial, "Light": ClptLamp, "World": ClptWorld,
}  # fmt: skip
PANELS = (CLPT_PT_sampling, CLPT_PT_material, CLPT_PT_lamp, CLPT_PT_world)


def register() -> None:
    """Register settings and panels."""
    for name, group in GROUPS.items():
        bpy.utils.register_class(group)
        getattr(bpy.types, name).clpt = bpy.props.PointerProperty(type=group)
    for panel in PANELS:
        bpy.utils.register_class(panel)


def unregister() -> None:
    """Undo `register`."""
    for panel in reversed(PANELS):
        bpy.utils.unregister_class(panel)
    for name, group in GROUPS.items():
        del getattr(bpy.types, name).clpt
        bpy.utils.unregister_class(group)
