"""Sensors, films, filters, samplers and integrators of a Mitsuba scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import lenses
from clpt.choices import AUTO
from clpt.errors import UnknownKindError
from clpt.formats.mitsuba.media import around
from clpt.formats.mitsuba.properties import Context, PluginReader, Properties, unknown
from clpt.formats.mitsuba.xml import Element
from clpt.scene import cameras, integrators
from clpt.scene.integrators import Film, Filter, Integrator
from clpt.scene.motion import Shutter
from clpt.scene.params import params
from clpt.spectra import read_sensor, spaces
from clpt.spectra.sensors import OBSERVERS

FULL_FRAME = math.hypot(36.0, 24.0)  # diagonal of 35 mm film [mm], which focal_length refers to
LENS_NUMBERS = (
    "film_width", "focus_distance", "film_shift", "f_number", "blade_angle", "ghosts", "unit",
)  # fmt: skip
LENS_CHOICES = {
    "coating": tuple(lenses.COATINGS), "exposure": params(cameras.Lens)["exposure"].choices,
}  # fmt: skip
FILMS = ("hdrfilm", "clptfilm")
FILTERS = ("box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos")
SAMPLERS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
HOLDERS = ("adaptive", "irrcache", "multichannel")  # integrators of Mitsuba 0.6 around another
NO_LIGHT = ("ao", "field", "motion")  # integrators of Mitsuba 0.6 whose values are no light
REPLAYED_DEPTH = 6  # default of integrators that differentiate
# Parameters of integrators that differentiate at edges; they change derivatives alone.
OF_EDGES = (
    *("sppc", "sppp", "sppi", "guiding", "guiding_proj", "guiding_rounds"),
    *("reparam_max_depth", "reparam_rays", "reparam_kappa", "reparam_exp"),
    *("reparam_antithetic", "reparam_unroll"),
)
DEFAULT_SAMPLER = "independent"
LAYERS = {  # of the values that the integrator aov names
    "depth": "depth",
    "position": "position",
    "uv": "uv",
    "geo_normal": "geometric_normal",
    "sh_normal": "shading_normal",
    "albedo": "albedo",
    "shape_index": "shape_id",
    "prim_index": "primitive_id",
}
NO_LAYERS = ("dp_du", "dp_dv", "duv_dx", "duv_dy", "boundary_test")


@dataclass
class Sensor:
    """A <sensor> with its children; sampler: the plugin's name; name: the sensor's id, or ""."""

    camera: cameras.Camera
    film: Film
    sampler: str
    spp: int
    seed: int
    name: str = ""


def sensor(element: Element, context: Context) -> Sensor:
    """Make the camera, film and sampler that a <sensor> describes."""
    if element.type not in CAMERAS:
        raise unknown(element, CAMERAS)
    props = Properties(element, context)
    film, sampler, spp, seed = _film_and_sampler(props, context)
    opens = props.number("shutter_open", 0.0)
    closes = props.number("shutter_close", opens)
    if element.type not in ("thinlens", "lens"):
        props.ignore("focus_distance")
    with element.locating():
        camera = CAMERAS[element.type](props, film)
        shutter = Shutter(opens, closes)
    camera = replace(camera, medium=around(props), motion=props.motion, shutter=shutter)
    props.finish()
    return Sensor(camera, film, sampler, spp, seed, element.attributes.get("id", ""))


def batch(element: Element, context: Context) -> list[Sensor]:
    """Make the sensors in a <sensor type="batch">: each has its part of the film's width.

    Mitsuba shows them in a row; here each is a camera of its own.
    """
    props = Properties(element, context)
    film, sampler, spp, seed = _film_and_sampler(props, context)
    inner = props.objects("sensor")
    props.ignore("srf")
    props.finish()
    if not inner or film.width % len(inner) or film.crop is not None:
        raise element.error("needs a film whose width is a multiple of its sensors, without a crop")
    width = film.width // len(inner)
    context.warn(
        element,
        f"its {len(inner)} pictures of {width} pixels are no row: one is shown;"
        " `clpt render --camera all` writes each",
    )
    part = replace(film, width=width)
    result = [sensor(item, context) for item in inner]
    if any(
        not math.isclose(item.film.width / item.film.height, width / film.height) for item in result
    ):
        context.warn(element, "sensors whose own films have other sides see more or less")
    return [replace(item, film=part, sampler=sampler, spp=spp, seed=seed) for item in result]


def _film_and_sampler(props: Properties, context: Context) -> tuple[Film, str, int, int]:
    film = default_film() if (child := props.object("film")) is None else _film(child, context)
    return film, *_sampler(props.object("sampler"), context)


def default_film() -> Film:
    """Mitsuba's film: 768 x 576 with a Gaussian filter."""
    return Film(filter=integrators.Gaussian())


def _perspective(props: Properties, film: Film) -> cameras.Camera:
    return cameras.Perspective(**_pinhole(props, film))


def _thin_lens(props: Properties, film: Film) -> cameras.Camera:
    if "aperture_radius" not in props.named:
        raise props.element.error("needs the parameter 'aperture_radius'")
    pinhole = _pinhole(props, film)
    return cameras.ThinLens(
        aperture_radius=props.number("aperture_radius", 0.0),
        focus_distance=props.number("focus_distance", pinhole["far"]),
        **_glass(props),
        **pinhole,
    )


def _glass(props: Properties) -> dict[str, Any]:
    """Ours, see docs/mitsuba_plugins.md: what a lens that disperses is made of."""
    values: dict[str, Any] = {}
    child = props.take("glass")
    if child is not None:
        if child.tag != "string":
            raise child.error("must be a <string> with the name of a glass")
        values["glass"] = child.attribute("value")
    if "lens_focal_length" in props.named:
        values["focal_length"] = props.number("lens_focal_length", 0.0)
    return values


def _lens(props: Properties, film: Film) -> cameras.Camera:
    """Ours, see docs/mitsuba_plugins.md."""
    values: dict[str, Any] = {"to_world": _unscaled(props)}
    if "filename" in props.named:
        values["lens"] = lenses.read(props.file())
    elif "lens" in props.named:
        values["lens"] = props.text("lens", "", lenses.names())
    for name in LENS_NUMBERS:
        if name in props.named:
            values[name] = props.number(name, 0.0)
    for name, choices in LENS_CHOICES.items():
        if name in props.named:
            values[name] = props.text(name, "", choices)
    values["blades"] = props.integer("blades", 0)
    values["losses"] = props.flag("losses", False)
    return cameras.Lens(**values)


def _orthographic(props: Properties, _: Film) -> cameras.Camera:
    near, far = _clip(props)
    return cameras.Orthographic(to_world=props.placement(), near=near, far=far)


CAMERAS = {
    "perspective": _perspective,
    "thinlens": _thin_lens,
    "lens": _lens,
    "orthographic": _orthographic,
}


def _pinhole(props: Properties, film: Film) -> dict[str, Any]:
    to_world = _unscaled(props)
    fov, axis = _field_of_view(props, film)
    near, far = _clip(props)
    return {
        "to_world": to_world,
        "fov": fov,
        "fov_axis": axis,
        "near": near,
        "far": far,
        "offset_x": props.number("principal_point_offset_x", 0.0),
        "offset_y": props.number("principal_point_offset_y", 0.0),
    }


def _unscaled(props: Properties) -> NDArray[Any]:
    to_world = props.placement()
    if not np.allclose(np.linalg.norm(to_world[:3, :3], axis=0), 1.0, atol=1e-3):
        raise props.element.error("to_world must not scale")
    return to_world


def _clip(props: Properties) -> tuple[float, float]:
    near, far = props.number("near_clip", 1e-2), props.number("far_clip", 1e4)
    if not 0.0 <= near < far:
        raise props.element.error("near_clip must be below far_clip, and neither negative")
    return near, far


def _field_of_view(props: Properties, film: Film) -> tuple[float, str]:
    """Return the angle [degrees] and its axis; a diagonal angle becomes that along x."""
    axes = ("x", "y", "diagonal", "smaller", "larger")
    axis = props.text("fov_axis", "x", axes)
    if "fov" in props.named:
        props.ignore("focal_length")
        fov = props.number("fov", 0.0)
    else:
        fov, axis = from_focal_length(props), "diagonal"
    if not 0.0 < fov < 180.0:
        raise props.element.error(f"the field of view must lie between 0 and 180, not {fov:g}")
    if axis == "diagonal":
        share = film.width / math.hypot(film.width, film.height)
        fov, axis = math.degrees(2.0 * math.atan(math.tan(math.radians(fov) / 2.0) * share)), "x"
    return fov, axis


def from_focal_length(props: Properties) -> float:
    """Take a focal length of 35 mm film, and return the angle along its diagonal [degrees]."""
    text = props.text("focal_length", "50mm")
    try:
        length = float(text.removesuffix("mm"))
    except ValueError:
        length = 0.0
    if not 0.0 < length < math.inf:
        raise props.element.error(f"focal_length looks like 50mm, not {text[:20]!r}")
    return math.degrees(2.0 * math.atan(FULL_FRAME / (2.0 * length)))


def _film(element: Element, context: Context) -> Film:
    if element.type not in FILMS and not context.old:
        raise unknown(element, FILMS)
    if element.type not in FILMS:
        context.read_as(element, f"film {element.type!r}", "hdrfilm")
    props = Properties(element, context)
    # How a file is stored is decided when it is written.
    props.ignore("file_format", "pixel_format", "component_format", "sample_border", "compensate")
    props.ignore("banner")
    child = props.object("rfilter")
    width, height = props.integer("width", 768, 1), props.integer("height", 576, 1)
    with element.locating():
        film = Film(
            width=width,
            height=height,
            crop=_crop(props, width, height),
            filter=integrators.Gaussian() if child is None else _filter(child, context),
            **(_own_film(props) if element.type == "clptfilm" else {}),
        )
    props.finish()
    return film


def _own_film(props: Properties) -> dict[str, Any]:
    """Return the parameters that only clpt's film has: see docs/mitsuba_plugins.md."""
    values: dict[str, Any] = {"bands": props.integer("bands", 0)}
    for name, choices in (("output_space", spaces.SPACES), ("mode", ("spectral", "rgb"))):
        if name in props.named:
            values[name] = props.text(name, "", choices)
    for name in ("lambda_min", "lambda_max"):
        if name in props.named:
            values[name] = props.number(name, 0.0)
    if "sensor_filename" in props.named:
        values["sensor"] = read_sensor(props.file("sensor_filename"))
    elif "sensor" in props.named:
        values["sensor"] = props.text("sensor", "", tuple(OBSERVERS))
    if (white := props.named.get("white_balance")) is not None:
        if white.tag == "string":
            values["white_balance"] = props.text("white_balance", "")
        else:
            values["white_balance"] = props.number("white_balance", 0.0)
    return values


def _filter(element: Element, context: Context) -> Filter:
    props = Properties(element, context)
    if element.type not in RECONSTRUCTION:
        raise unknown(element, RECONSTRUCTION)
    with element.locating():
        chosen = RECONSTRUCTION[element.type](props)
    props.finish()
    return chosen


def _lanczos(props: Properties) -> Filter:
    lobes = float(props.integer("lobes", 3, 1))
    return integrators.Lanczos(radius=lobes, lobes=lobes)


RECONSTRUCTION: dict[str, PluginReader[Filter]] = {
    "box": lambda _: integrators.Box(),
    "tent": lambda props: integrators.Tent(radius=props.number("radius", 1.0)),
    "gaussian": lambda props: integrators.Gaussian(stddev=props.number("stddev", 0.5)),
    "mitchell": lambda props: integrators.Mitchell(
        b=props.number("b", 1 / 3), c=props.number("c", 1 / 3)
    ),
    "catmullrom": lambda _: integrators.Mitchell(b=0.0, c=0.5),
    "lanczos": _lanczos,
}


def _crop(props: Properties, width: int, height: int) -> tuple[int, int, int, int] | None:
    names = ("crop_offset_x", "crop_offset_y", "crop_width", "crop_height")
    if not any(name in props.named for name in names):
        return None
    x, y = (props.integer(name, 0) for name in names[:2])
    return x, y, props.integer(names[2], width - x, 1), props.integer(names[3], height - y, 1)


def _sampler(element: Element | None, context: Context) -> tuple[str, int, int]:
    """Return the sampler's name, the samples of a pixel and the seed."""
    if element is None:
        return DEFAULT_SAMPLER, 4, 0
    if element.type not in SAMPLERS and not context.old:
        raise unknown(element, SAMPLERS)
    if element.type not in SAMPLERS:
        context.read_as(element, f"sampler {element.type!r}", DEFAULT_SAMPLER)
    props = Properties(element, context)
    spp, seed = props.integer("sample_count", 4, 1), props.integer("seed", 0)
    props.ignore("jitter", "strength")
    props.finish()
    return element.type, spp, seed


def integrator(element: Element, context: Context) -> Integrator:
    """Make the integrator that an <integrator> describes."""
    return context.once(element, lambda _: _integrator(element, context))


def _integrator(element: Element, context: Context) -> Integrator:
    kind = element.type
    if kind not in INTEGRATORS and (not context.old or kind in NO_LIGHT):
        raise unknown(element, INTEGRATORS)
    props = Properties(element, context)
    props.ignore("block_size", "samples_per_pass", "timeout")
    if kind.endswith(("_reparam", "_projective")):
        props.ignore(*OF_EDGES)
    with element.locating():
        if kind in HOLDERS and context.old:
            chosen = _inner(props)
        elif kind in INTEGRATORS:
            chosen = INTEGRATORS[kind](props)
        else:
            context.read_as(element, f"integrator {kind!r}", "path")
            chosen = _path(props)
    props.finish()
    return chosen


def _inner(props: Properties) -> Integrator:
    """Make the integrator inside an integrator of Mitsuba 0.6 that speeds it up or divides it."""
    nested = props.object("integrator")
    if nested is None:
        raise props.element.error("needs a nested <integrator>")
    props.context.read_as(props.element, f"integrator {props.element.type!r}", nested.type)
    return integrator(nested, props.context)


def _depths(props: Properties, usual: int = -1) -> dict[str, Any]:
    depth = props.integer("max_depth", usual, -1)
    if depth == 0:
        props.context.warn(props.element, "max_depth of 0: black in Mitsuba, lights are seen here")
    return {
        "max_depth": depth or 1,
        "rr_depth": props.integer("rr_depth", integrators.Path.rr_depth, 1),
        "hide_lights": props.flag("hide_emitters", False),
    }


def _path(props: Properties) -> Integrator:
    depths = _depths(props)
    # with free panes lights behind them are hidden too, as by `volpath`
    free = integrators.is_long(depths["max_depth"]) and not depths["hide_lights"]
    return integrators.Path(**depths, light_paths=_light_paths(props), free_panes=free)


def _light_paths(props: Properties) -> float | str:
    """Ours, see docs/mitsuba_plugins.md: Mitsuba's path has no such parameter."""
    child = props.named.get("light_paths")
    if child is not None and child.tag == "string":
        return props.text("light_paths", "", (AUTO,))
    return AUTO if child is None else props.number("light_paths", 0.0)


def _vcm(props: Properties) -> Integrator:
    """Ours, see docs/mitsuba_plugins.md."""
    usual = integrators.Vcm
    return usual(
        **_depths(props),
        light_paths=props.integer("light_paths", usual.light_paths),
        light_tracing=props.flag("light_tracing", usual.light_tracing),
        merging=props.flag("merging", usual.merging),
        radius=props.number("radius", usual.radius),
        wavelength_groups=props.integer("wavelength_groups", usual.wavelength_groups),
        photon_memory=props.integer("photon_memory", usual.photon_memory),
    )


def _direct(props: Properties) -> Integrator:
    # How many samples each strategy gets changes the noise, not the picture; but none at all does.
    for name in ("emitter_samples", "bsdf_samples"):
        if props.integer(name, 1) == 0:
            props.context.warn(props.element, f"{name} of 0: both ways to find light are used")
    props.ignore("shading_samples")
    return integrators.Direct(hide_lights=props.flag("hide_emitters", False))


def _particle_tracer(props: Properties) -> Integrator:
    depths = _depths(props)
    free = integrators.is_long(depths["max_depth"])
    return integrators.ParticleTracer(**depths, free_panes=free)


def _volume_path(props: Properties) -> Integrator:
    """The path integrator follows light through media too; what is null there is no depth."""
    props.ignore("use_spectral_mis")
    return integrators.Path(**_depths(props), light_paths=_light_paths(props), free_panes=True)


def _replayed(free_panes: bool) -> PluginReader[Integrator]:
    """Return the reader of an integrator for derivatives, whose picture is that of `path`."""

    def read(props: Properties) -> Integrator:
        depths = _depths(props, REPLAYED_DEPTH)
        return integrators.Path(**depths, light_paths=_light_paths(props), free_panes=free_panes)

    return read


def _aov(props: Properties) -> Integrator:
    """Its values become layers of the film. A nested integrator makes the picture."""
    nested = props.object("integrator")
    for entry in filter(None, props.text("aovs", "").split(",")):
        name = entry.strip().rpartition(":")[2]
        if name in LAYERS:
            props.context.layers[LAYERS[name]] = None
        elif name in NO_LAYERS:
            props.context.warn(props.element, f"the values {name} are left out")
        else:
            raise UnknownKindError("aov", name, LAYERS, **props.element.location())
    return _no_light() if nested is None else integrator(nested, props.context)


def _depth(props: Properties) -> Integrator:
    props.context.layers["depth"] = None
    return _no_light()


def _no_light() -> Integrator:
    """Return an integrator whose paths end at the first surface, for the layers of the film."""
    return integrators.Path(max_depth=1, light_paths=0)


def _stokes(props: Properties) -> Integrator:
    """Its picture is that of the nested integrator: light has no polarisation here."""
    nested = props.object("integrator")
    props.context.warn(props.element, "its vectors of polarisation are left out")
    return _path(props) if nested is None else integrator(nested, props.context)


def _moment(props: Properties) -> Integrator:
    nested = props.object("integrator")
    if nested is None:
        raise props.element.error("needs a nested <integrator>")
    props.context.warn(props.element, "its second moments are left out")
    return integrator(nested, props.context)


INTEGRATORS: dict[str, PluginReader[Integrator]] = {
    "path": _path,
    "auto": lambda props: integrators.Auto(**_depths(props)),
    "vcm": _vcm,
    "direct": _direct,
    "ptracer": _particle_tracer,
    "aov": _aov,
    "depth": _depth,
    "moment": _moment,
    "stokes": _stokes,
    "volpath": _volume_path,
    "volpathmis": _volume_path,
    "prb": _replayed(free_panes=False),
    "prb_basic": _replayed(free_panes=False),
    "prbvolpath": _replayed(free_panes=True),
    **dict.fromkeys(("prb_reparam", "prb_projective"), _replayed(free_panes=False)),
    **dict.fromkeys(("direct_reparam", "direct_projective"), _direct),
}
