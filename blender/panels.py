# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the scene, and the panels that show them."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any, ClassVar

import bpy

from . import measured, preferences, process
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
    """Let viewports and the compositor know that a setting has changed."""
    group.id_data.update_tag()
    for layer in getattr(group.id_data, "view_layers", ()):
        layer.update_render_passes()


def _named(name: str, names: tuple[str, ...], default: str = "", text: str = "") -> Any:
    """Return a text that may be any of the names, which are offered."""
    return bpy.props.StringProperty(
        name=name, default=default, description=text, search=lambda self, context, edit: [
            found for found in names if edit.lower() in found.lower()
        ], search_options={"SUGGESTION"}, update=_tag,
    )  # fmt: skip


def _number(
    name: str, default: float, least: float, most: float, text: str = "", **how: Any
) -> Any:
    return bpy.props.FloatProperty(
        name=name, default=default, min=least, max=most, description=text, precision=3,
        **{"update": _tag, **how},
    )  # fmt: skip


def _count(name: str, default: int, least: int, most: int, text: str) -> Any:
    return bpy.props.IntProperty(
        name=name, default=default, min=least, max=most, description=text, update=_tag
    )


def _flag(name: str, text: str = "") -> Any:
    return bpy.props.BoolProperty(name=name, description=text, update=_tag)


def _text(name: str, text: str = "") -> Any:
    return bpy.props.StringProperty(name=name, description=text, update=_tag)


def _path(name: str) -> Any:
    return bpy.props.StringProperty(name=name, subtype="FILE_PATH", update=_tag)


def _choice(name: str, items: Any, text: str = "") -> Any:
    return bpy.props.EnumProperty(name=name, items=items, description=text, update=_tag)


class ClptSettings(bpy.types.PropertyGroup):
    """How a scene is rendered."""

    mode: _choice("Mode", MODES)
    samples: _count("Samples", 128, 1, 1 << 20, "Paths of each pixel")
    denoise: _flag("Denoise", "Take most of the noise from the finished picture")
    bounces: _count("Max Bounces", 12, 0, 1024, "Of light from surface to surface; 0: direct light")
    noise: _number(
        "Noise Limit", 0.0, 0.0, 1.0,
        "Pixels below this relative noise get no more samples; 0: no limit",
    )  # fmt: skip
    viewport_samples: _count("Viewport Samples", 256, 1, 1 << 20, "Paths of each pixel there")
    viewport_denoise: _flag("Viewport Denoise", "Take most of the noise from viewports' pictures")
    light_passes: _flag("Direct and Indirect", "Light that met one surface at most; other light")
    denoising_passes: _flag("Denoising Data", "What the compositor's node Denoise needs")
    bands: _count("Bands", 0, 0, 64, "Parts of the spectrum, each a pass of its radiance; 0: none")
    first_band: _number("First Band", 400.0, 200.0, 2400.0, "Where the bands begin [nm]")
    last_band: _number("Last Band", 700.0, 300.0, 2500.0, "Where the bands end [nm]")
    sensor: _choice("Sensor", SENSORS)
    sensor_file: _path("Sensor File")
    white_balance: _named(
        "White Balance", measured.LAMPS, "", "A standard or 4000 K becomes white; empty: none"
    )


class ClptMaterial(bpy.types.PropertyGroup):
    """A surface by its substance, in place of the nodes."""

    kind: _choice("Surface", SURFACES, "What the surface is made of")
    glass: _named("Glass", measured.GLASSES, "n-bk7", "A glass, a liquid or a crystal")
    metal: _named("Metal", measured.METALS, "gold", "Its measured index counts")
    roughness: _number("Roughness", 0.0, 0.0, 1.0)
    absorption: _text("Absorption", f"[1/m] {TYPED}")
    film_thickness: _number("Film", 0.0, 0.0, 1e5, "Thickness of a thin film [nm]; 0: none")
    film_ior: _number("Film IOR", 1.33, 1.0, 4.0)
    period: _number("Period", 1600.0, 100.0, 1e5, "From groove to groove [nm]")
    depth: _number("Depth", 150.0, 0.0, 1000.0, "Of a groove [nm]")
    angle: _number("Angle", 0.0, -1e4, 1e4, "From u to v", subtype="ANGLE")
    spectrum: _text("Reflectance", f"A number; {TYPED}")
    absorbed: _number("Absorbed", 450.0, 260.0, 800.0, "Wavelength that the dye takes most of [nm]")
    strength: _number("Strength", 0.8, 0.0, 1.0, "Share of the light there that it takes")
    emitted: _number("Emitted", 550.0, 300.0, 850.0, "Wavelength that it emits most of [nm]")
    quantum_yield: _number("Yield", 0.8, 0.0, 1.0, "Photons that come out of each")
    file: _path("File")
    use_drops: _flag("Drops Inside", "The inside is a fog of small balls, by Mie's theory")
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
    return measured.turbidity(world.haze)


def _set_turbidity(world: Any, value: float) -> None:
    world.haze = measured.haze(value)


class ClptWorld(bpy.types.PropertyGroup):
    """A clear sky by the physics of air."""

    use_sky: _flag("Clear Sky")
    elevation: _number("Sun Elevation", 0.6, -0.2, 1.5707, subtype="ANGLE")
    azimuth: _number("Sun Azimuth", 0.0, -6.2831, 6.2831, "From +X toward +Y", subtype="ANGLE")
    haze: _number("Haze", 0.1, 0.0, 2.0, "Optical depth straight up at 550 nm")
    turbidity: bpy.props.FloatProperty(
        name="Turbidity", description="The same haze as in other skies", min=1.0, max=20.0,
        get=_turbidity, set=_set_turbidity,
    )  # fmt: skip
    ozone: _number("Ozone", 300.0, 0.0, 1000.0, "Column of ozone [Dobson units]")
    altitude: _number("Altitude", 0.0, 0.0, 60000.0, unit="LENGTH")
    ground: bpy.props.FloatVectorProperty(
        name="Ground", subtype="COLOR", default=(0.2, 0.2, 0.2), min=0.0, max=1.0, update=_tag
    )
    strength: _number("Strength", 1.0, 0.0, 3.4e38)


Names = tuple[str, ...]


def of_material(settings: Any) -> Names:
    """Return the settings that matter to a material."""
    drops = ("drops", "radius", "spread", "share") if settings.use_drops else ()
    return ("kind", *FIELDS.get(settings.kind, ()), "use_drops", *drops)


class Panel(bpy.types.Panel):
    """A panel of this engine.

    owner: what has to be there, settings: what it shows, both by their places in the context; names
    are the settings, or a function of them.
    """

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES: ClassVar = {"CLPT"}
    owner: ClassVar[str] = "scene"
    settings: ClassVar[str] = "scene.clpt"
    names: ClassVar[Names | Callable[[Any], Names]] = ()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and attrgetter(cls.owner)(context) is not None

    @classmethod
    def shown(cls, context: Any) -> tuple[Any, Names]:
        """Return settings, and the names of those that are shown."""
        settings = attrgetter(cls.settings)(context)
        return settings, cls.names(settings) if callable(cls.names) else cls.names

    def draw(self, context: bpy.types.Context) -> None:
        process.prepare(preferences.python())  # it loads clpt while people look for a button
        self.layout.use_property_split = True
        settings, names = self.shown(context)
        for name in names:
            if name == "lightgroup":
                self.layout.prop_search(settings, name, context.view_layer, "lightgroups")
            elif name == "lightgroups":
                self._groups(context.view_layer)
            else:
                self.layout.prop(settings, name)
        for line in told.get(attrgetter(self.owner)(context).name_full, ()):
            self.layout.label(text=line, icon="INFO")

    def _groups(self, layer: bpy.types.ViewLayer) -> None:
        """Show Blender's list of a view layer's light groups."""
        row, name = self.layout.row(), "lightgroups"
        row.template_list("UI_UL_list", name, layer, name, layer, "active_lightgroup_index", rows=3)
        column = row.column(align=True)
        for what in ("add", "remove"):
            column.operator(f"scene.view_layer_{what}_lightgroup", icon=what.upper(), text="")


ROWS: tuple[tuple[str, str, str, str, str, Any], ...] = (  # tab, label, owner, settings, names
    ("sampling", "render", "Sampling", "scene", "scene.clpt",
     ("mode", "samples", "noise", "bounces", "denoise", "viewport_samples", "viewport_denoise")),
    ("motion", "render", "Alpha and Motion", "scene", "scene.render",
     ("film_transparent", "use_motion_blur", "motion_blur_position", "motion_blur_shutter")),
    ("film", "render", "Film Response", "scene", "scene.clpt",
     ("sensor", "sensor_file", "white_balance", "bands", "first_band", "last_band")),
    ("passes", "view_layer", "Passes", "scene", "view_layer",
     ("use_pass_z", "use_pass_position", "use_pass_normal", "use_pass_uv",
      "use_pass_diffuse_color", "use_pass_cryptomatte_object", "use_pass_cryptomatte_material",
      "pass_cryptomatte_depth")),
    ("own_passes", "view_layer", "Passes of clpt", "scene", "scene.clpt",
     ("light_passes", "denoising_passes")),
    ("groups", "view_layer", "Light Groups", "scene", "view_layer", ("lightgroups",)),
    ("object", "object", "Light Group", "object", "object", ("lightgroup",)),
    ("material", "material", "Measured Surface", "material", "material.clpt", of_material),
    ("lamp", "data", "Spectrum", "light", "light.clpt", ("spectrum",)),
    ("camera", "data", "Real Lens", "camera", "camera.clpt", ("lens",)),
    ("world", "world", "Clear Sky", "world", "world.clpt",
     ("use_sky", "elevation", "azimuth", "turbidity", "haze", "ozone", "altitude", "ground",
      "strength")),
    ("world_group", "world", "Light Group", "world", "world", ("lightgroup",)),
)  # fmt: skip
KEYS = "bl_context", "bl_label", "owner", "settings", "names"
PANELS = tuple(
    type(f"CLPT_PT_{name}", (Panel,), dict(zip(KEYS, row, strict=True))) for name, *row in ROWS
)
PANELS[2].bl_options = {"DEFAULT_CLOSED"}  # the film's
GROUPS = {
    "Scene": ClptSettings, "Material": ClptMaterial, "Light": ClptLamp, "World": ClptWorld,
    "Camera": ClptCamera,
}  # fmt: skip


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
