# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the scene, and the panels that show them."""

from __future__ import annotations

from typing import Any, ClassVar

import bpy

from . import measured
from .nodes import told

MODES = (
    ("spectral", "Spectral", "Light has wavelengths: dispersion, fluorescence, measured metals"),
    ("rgb", "RGB", "Light has three colors, as in Cycles"),
)
SURFACES = (
    ("NODES", "Nodes", "What the material's nodes say"),
    ("GLASS", "Glass", "A measured glass, liquid or crystal; it disperses in spectral mode"),
    ("METAL", "Metal", "A measured metal"),
    ("GRATING", "Grating", "A metal with grooves along u of the UV map"),
    ("FLUORESCENT", "Fluorescent", "Paint with a dye that emits at longer wavelengths"),
    ("SPECTRUM", "Spectrum", "Matte, by the spectrum of its reflectance"),
    ("MEASURED", "Measured", "A measured surface: .bsdf (Dupuy and Jakob) or .binary (MERL)"),
)
FIELDS = {  # which settings matter to a surface
    "GLASS": ("glass", "roughness", "absorption", "film_thickness", "film_ior"),
    "METAL": ("metal", "roughness", "film_thickness", "film_ior"),
    "GRATING": ("metal", "period", "angle", "depth"),
    "FLUORESCENT": ("spectrum", "absorbed", "strength", "emitted", "quantum_yield"),
    "SPECTRUM": ("spectrum",), "MEASURED": ("file",),
}  # fmt: skip
SENSORS = (
    ("cie1931", "CIE 1931", "The eye, 2 degrees"), ("cie1964", "CIE 1964", "The eye, 10 degrees"),
    ("FILE", "File", "Three curves of a camera, columns of a file"),
)  # fmt: skip
TYPED = "Typed, 400:0.1 700:0.6; or a file of columns, nm and values"


def _tag(group: Any, context: Any) -> None:
    """Let viewports know that a setting has changed."""
    group.id_data.update_tag()


def _named(name: str, names: tuple[str, ...], default: str = "", text: str = "") -> Any:
    """Return a text that may be any of the names, which are offered."""
    return bpy.props.StringProperty(
        name=name, default=default, description=text, search=lambda self, context, edit: [
            found for found in names if edit.lower() in found.lower()
        ], search_options={"SUGGESTION"}, update=_tag,
    )  # fmt: skip


def _number(name: str, default: float, least: float, most: float, text: str = "") -> Any:
    return bpy.props.FloatProperty(
        name=name,
        default=default,
        min=least,
        max=most,
        description=text,
        precision=3,
        update=_tag,
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
    viewport_denoise: bpy.props.BoolProperty(
        name="Viewport Denoise", description="Take most of the noise from pictures of viewports",
        update=_tag,
    )  # fmt: skip
    bands: bpy.props.IntProperty(
        name="Bands", description="Parts of the spectrum, each a pass of its radiance; 0: none",
        min=0, max=64,
    )  # fmt: skip
    first_band: _number("First Band", 400.0, 200.0, 2400.0, "Where the bands begin [nm]")
    last_band: _number("Last Band", 700.0, 300.0, 2500.0, "Where the bands end [nm]")
    sensor: bpy.props.EnumProperty(name="Sensor", items=SENSORS)
    sensor_file: bpy.props.StringProperty(name="Sensor File", subtype="FILE_PATH")
    white_balance: _named(
        "White Balance", measured.LAMPS, "", "A standard or 4000 K becomes white; empty: none"
    )


class ClptMaterial(bpy.types.PropertyGroup):
    """A surface by its substance, in place of the nodes."""

    kind: bpy.props.EnumProperty(
        update=_tag, name="Surface", items=SURFACES, description="What the surface is made of"
    )
    glass: _named("Glass", measured.GLASSES, "n-bk7", "A glass, a liquid or a crystal")
    metal: _named("Metal", measured.METALS, "gold", "Its measured index counts")
    roughness: _number("Roughness", 0.0, 0.0, 1.0)
    absorption: bpy.props.StringProperty(
        update=_tag, name="Absorption", description=f"[1/m] {TYPED}"
    )
    film_thickness: _number("Film", 0.0, 0.0, 1e5, "Thickness of a thin film [nm]; 0: none")
    film_ior: _number("Film IOR", 1.33, 1.0, 4.0)
    period: _number("Period", 1600.0, 100.0, 1e5, "From groove to groove [nm]")
    depth: _number("Depth", 150.0, 0.0, 1000.0, "Of a groove [nm]")
    angle: bpy.props.FloatProperty(
        update=_tag, name="Angle", subtype="ANGLE", description="From u to v"
    )
    spectrum: bpy.props.StringProperty(
        update=_tag, name="Reflectance", description=f"A number; {TYPED}"
    )
    absorbed: _number("Absorbed", 450.0, 260.0, 800.0, "Wavelength that the dye takes most of [nm]")
    strength: _number("Strength", 0.8, 0.0, 1.0, "Share of the light there that it takes")
    emitted: _number("Emitted", 550.0, 300.0, 850.0, "Wavelength that it emits most of [nm]")
    quantum_yield: _number("Yield", 0.8, 0.0, 1.0, "Photons that come out of each")
    file: bpy.props.StringProperty(update=_tag, name="File", subtype="FILE_PATH")
    use_drops: bpy.props.BoolProperty(
        update=_tag,
        name="Drops Inside",
        description="The inside is a fog of small balls, by Mie's theory",
    )
    drops: _named("Of", ("water", *measured.GLASSES), "water", "What the drops are made of")
    radius: _number("Radius", 8.0, 0.01, 1000.0, "Of drops [micrometres]")
    spread: _number("Spread", 0.1, 0.001, 2.0, "Standard deviation of the radii's logarithm")
    share: _number("Share", 0.1, 0.0, 1e6, "Cubic centimetres of drops in a cubic metre")


class ClptLamp(bpy.types.PropertyGroup):
    """What a lamp emits, by a standard."""

    spectrum: _named(
        "Spectrum", measured.LAMPS, "",
        "A standard, or 3000 K, or typed as 400:0.1 700:0.6, or a file; empty: the color's",
    )  # fmt: skip


class ClptCamera(bpy.types.PropertyGroup):
    """A lens of glass surfaces, in place of the ideal one."""

    lens: _named("Lens", measured.LENSES, "", "A real lens, or its file; empty: the ideal one")


def _turbidity(world: Any) -> float:
    """Return the turbidity of the haze: Angstrom's coefficient after Preetham 1999."""
    return (world.haze * 0.55**1.3 + 0.04586) / 0.04608


def _set_turbidity(world: Any, value: float) -> None:
    world.haze = max(0.04608 * value - 0.04586, 0.0) / 0.55**1.3


class ClptWorld(bpy.types.PropertyGroup):
    """A clear sky by the physics of air."""

    use_sky: bpy.props.BoolProperty(update=_tag, name="Clear Sky")
    elevation: bpy.props.FloatProperty(
        update=_tag, name="Sun Elevation", subtype="ANGLE", default=0.6, min=-0.2, max=1.5707
    )
    azimuth: bpy.props.FloatProperty(
        update=_tag,
        name="Sun Azimuth",
        description="From +X toward +Y",
        subtype="ANGLE",
        min=-6.2831,
        max=6.2831,
    )
    haze: _number("Haze", 0.1, 0.0, 2.0, "Optical depth straight up at 550 nm")
    turbidity: bpy.props.FloatProperty(
        name="Turbidity", description="The same haze as in other skies", min=1.0, max=20.0,
        get=_turbidity, set=_set_turbidity,
    )  # fmt: skip
    ozone: _number("Ozone", 300.0, 0.0, 1000.0, "Column of ozone [Dobson units]")
    altitude: bpy.props.FloatProperty(
        update=_tag, name="Altitude", unit="LENGTH", min=0.0, max=60000.0
    )
    ground: bpy.props.FloatVectorProperty(
        update=_tag, name="Ground", subtype="COLOR", default=(0.2, 0.2, 0.2), min=0.0, max=1.0
    )
    strength: bpy.props.FloatProperty(update=_tag, name="Strength", default=1.0, min=0.0)


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

    @classmethod
    def shown(cls, settings: Any) -> tuple[str, ...]:
        return cls.names

    @classmethod
    def settings(cls, owner: Any) -> Any:
        return owner.clpt

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        owner = self.owner(context)
        settings = self.settings(owner)
        for name in self.shown(settings):
            if name == "lightgroup":
                self.layout.prop_search(settings, name, context.view_layer, "lightgroups")
            else:
                self.layout.prop(settings, name)
        for line in told.get(owner.name_full, ()):
            self.layout.label(text=line, icon="INFO")


class CLPT_PT_sampling(Panel):
    """Samples and mode."""

    bl_label = "Sampling"
    bl_context = "render"
    names = ("mode", "samples", "noise", "denoise", "viewport_samples", "viewport_denoise")


class CLPT_PT_film(Panel):
    """How the film sees wavelengths."""

    bl_label = "Film Response"
    bl_context = "render"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}
    names = ("sensor", "sensor_file", "white_balance", "bands", "first_band", "last_band")


class CLPT_PT_motion(Panel):
    """Alpha of what is not covered, and blur of what moves: Blender's own settings."""

    bl_label = "Alpha and Motion"
    bl_context = "render"
    names = (
        "film_transparent", "use_motion_blur", "motion_blur_position", "motion_blur_shutter",
    )  # fmt: skip

    @classmethod
    def settings(cls, owner: Any) -> Any:
        return owner.render


class CLPT_PT_passes(Panel):
    """Passes for the compositor: Blender's own settings."""

    bl_label = "Passes"
    bl_context = "view_layer"
    names = (
        "use_pass_z", "use_pass_position", "use_pass_normal", "use_pass_uv",
        "use_pass_diffuse_color", "use_pass_cryptomatte_object", "use_pass_cryptomatte_material",
        "pass_cryptomatte_depth",
    )  # fmt: skip

    @classmethod
    def settings(cls, owner: Any) -> Any:
        return bpy.context.view_layer


class CLPT_PT_lightgroups(Panel):
    """Groups of lights, each with a pass: Blender's own list."""

    bl_label = "Light Groups"
    bl_context = "view_layer"
    names = ("lightgroups",)

    @classmethod
    def settings(cls, owner: Any) -> Any:
        return bpy.context.view_layer

    def draw(self, context: bpy.types.Context) -> None:
        row, layer, name = self.layout.row(), context.view_layer, "lightgroups"
        row.template_list("UI_UL_list", name, layer, name, layer, "active_lightgroup_index", rows=3)
        column = row.column(align=True)
        for what in ("add", "remove"):
            column.operator(f"scene.view_layer_{what}_lightgroup", icon=what.upper(), text="")


class CLPT_PT_object(Panel):
    """The light group of an object that emits."""

    bl_label = "Light Group"
    bl_context = "object"
    names = ("lightgroup",)

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.object

    @classmethod
    def settings(cls, owner: Any) -> Any:
        return owner


class CLPT_PT_world_group(CLPT_PT_object):
    """The light group of a world."""

    bl_context = "world"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.world


class CLPT_PT_material(Panel):
    """What a surface and its inside are made of, and what its nodes lose."""

    bl_label = "Measured Surface"
    bl_context = "material"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.material

    @classmethod
    def shown(cls, settings: Any) -> tuple[str, ...]:
        drops = ("drops", "radius", "spread", "share") if settings.use_drops else ()
        return ("kind", *FIELDS.get(settings.kind, ()), "use_drops", *drops)


class CLPT_PT_camera(Panel):
    """A real lens."""

    bl_label = "Real Lens"
    bl_context = "data"
    names = ("lens",)

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.camera


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
        "use_sky", "elevation", "azimuth", "turbidity", "haze", "ozone", "altitude", "ground",
        "strength",
    )  # fmt: skip

    @classmethod
    def owner(cls, context: bpy.types.Context) -> Any:
        return context.world


GROUPS = {
    "Scene": ClptSettings, "Material": ClptMaterial, "Light": ClptLamp, "World": ClptWorld,
    "Camera": ClptCamera,
}  # fmt: skip
PANELS = (
    CLPT_PT_sampling, CLPT_PT_motion, CLPT_PT_film, CLPT_PT_passes, CLPT_PT_lightgroups,
    CLPT_PT_object, CLPT_PT_material, CLPT_PT_lamp, CLPT_PT_camera, CLPT_PT_world,
    CLPT_PT_world_group,
)  # fmt: skip


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
