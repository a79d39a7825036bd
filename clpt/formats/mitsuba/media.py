"""Media and phase functions of a Mitsuba scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.formats import volumes
from clpt.formats.mitsuba import spectra
from clpt.formats.mitsuba.properties import Context, Properties, unknown
from clpt.formats.mitsuba.xml import Element
from clpt.formats.volumes import vol
from clpt.scene import media
from clpt.scene.media import Grid, Homogeneous, Medium, Phase
from clpt.scene.volumes import Volume


def medium(element: Element, context: Context) -> Medium:
    """Make the medium that a <medium> describes, the same for every reference."""
    return context.once(element, lambda one: _made(one, context, MEDIA))


def phase(element: Element, context: Context) -> Phase:
    """Make the phase function that a <phase> describes."""
    return context.once(element, lambda one: _made(one, context, PHASES))


def side(props: Properties, name: str) -> Medium | None:
    """Take the medium of a side of a shape, `interior` or `exterior`, or of a sensor."""
    found = [child for child in props.nested if child.name == name and child.tag == "medium"]
    child = props.take(name) if not found else found[0]
    if child is None:
        return None
    if found:
        props.nested.remove(child)
    target = props.context.resolve(child)
    if target.tag != "medium":
        raise child.error(f"{name!r} must be a <medium>, or a <ref> to one")
    return medium(target, props.context)


def around(props: Properties) -> Medium | None:
    """Take the medium around a sensor or an emitter, which need not be named."""
    named, child = side(props, "medium"), props.object("medium")
    return named if child is None else medium(child, props.context)


def _made(element: Element, context: Context, plugins: dict[str, Any]) -> Any:
    if element.type not in plugins:
        raise unknown(element, plugins)
    props = Properties(element, context)
    with element.locating():
        made = plugins[element.type](props)
    props.finish()
    return made


def _homogeneous(props: Properties) -> Homogeneous:
    props.ignore("has_spectral_extinction", "sample_emitters")  # both are found
    child = props.object("phase")
    return Homogeneous(
        sigma_t=spectra.coefficient(props, "sigma_t", 1.0),
        albedo=spectra.reflectance(props, "albedo", 0.75),
        scale=props.number("scale", 1.0),
        phase=media.Isotropic() if child is None else phase(child, props.context),
        name=props.element.attributes.get("id", ""),
    )


def _tabulated(props: Properties) -> Phase:
    """Values over the cosine, even from -1 to 1; light that goes on straight is at 1."""
    child = props.take("values")
    if child is None:
        raise props.element.error("needs its 'values', two numbers or more")
    try:
        values = [float(one) for one in child.attributes.get("value", "").replace(",", " ").split()]
    except ValueError:
        raise child.error("must be numbers, with commas between them") from None
    with child.locating():
        return media.Tabulated(values=values)


def _blend(props: Properties) -> Phase:
    parts = [phase(one, props.context) for one in props.objects("phase")]
    if len(parts) != 2:
        raise props.element.error(f"must hold two phase functions, not {len(parts)}")
    if any(one.name == "weight" for one in props.nested):
        raise props.element.error("'weight' must be a number: grids are not read here")
    weight = props.number("weight", 0.5)
    return media.Blend(weight=weight, first=parts[0], second=parts[1])


def _sggx(props: Properties) -> Phase:
    raise props.element.error(
        "is not supported: its density depends on how flakes lie, which media of clpt do not tell;"
        ' "hg" stands for round particles'
    )


def _heterogeneous(props: Properties) -> Homogeneous:
    albedo = _albedo(props)
    if albedo is not None:
        return _tinted(props, albedo)
    child = props.named.get("sigma_t")
    volume = None if child is None else props.context.resolve(child)
    even = volume is None or volume.tag != "volume" or volume.type != "gridvolume"
    if even or volume is None:  # constvolume, or a number
        return _homogeneous(props)
    props.take("sigma_t")
    given = props.context.once(volume, lambda one: _grid_volume(one, props.context))
    medium = _homogeneous(props)
    return Grid(
        **given,
        albedo=medium.albedo,
        scale=medium.scale,
        phase=medium.phase,
        name=medium.name,
    )


def _albedo(props: Properties) -> Volume | None:
    """Take an albedo of colours on a grid."""
    child = props.named.get("albedo")
    volume = None if child is None else props.context.resolve(child)
    if volume is None or volume.tag != "volume" or volume.type != "gridvolume":
        return None
    props.take("albedo")
    values, to_world = props.context.once(volume, lambda one: _grid_values(one, props.context))
    if values.max() > 1.0:
        raise volume.error("an albedo cannot exceed 1")
    return Volume(np.repeat(values, 3 // values.shape[3], axis=3), to_world)


def _tinted(props: Properties, albedo: Volume) -> Grid:
    """A medium whose albedo is on a grid; its density may be one number everywhere."""
    even = Volume(np.ones(albedo.values.shape[:3], np.float32), albedo.to_world)
    made, density, colours = _heterogeneous(props), even, None
    if isinstance(made, Grid):
        density, colours = Volume(made.density, made.to_world), made.colour_grid
    return Grid(
        sigma_t=made.sigma_t, albedo=1.0, albedo_grid=albedo, density=density, scale=made.scale,
        colour_grid=None if colours is None else Volume(colours, density.to_world),
        phase=made.phase, name=made.name,
    )  # fmt: skip


def _grid_volume(element: Element, context: Context) -> dict[str, Any]:
    """What a <volume type="gridvolume"> has: a density, one colour or some on the grid."""
    values, to_world = _grid_values(element, context)
    if values.shape[3] == 1:
        return {"sigma_t": 1.0, "density": Volume(values[..., 0], to_world)}
    sigma_t, density, colours = volumes.factored(values)
    placed = None if colours is None else Volume(colours, to_world)
    return {"sigma_t": sigma_t, "density": Volume(density, to_world), "colour_grid": placed}


def _grid_values(element: Element, context: Context) -> tuple[Any, Any]:
    """The numbers of a grid, of one channel or three, and where its box is."""
    props = Properties(element, context)
    props.ignore("raw", "accel")
    path, to_world = props.file(), props.placement()
    with element.locating():
        values, box = vol.read_channels(path)
    if props.flag("use_grid_bbox", False):
        to_world = to_world @ box
    if props.text("wrap_mode", "clamp", ("clamp", "repeat", "mirror")) != "clamp":
        context.warn(element, "at its ends the grid goes on as 'clamp'")
    if props.text("filter_type", "trilinear", ("trilinear", "nearest")) != "trilinear":
        context.warn(element, "the grid is trilinear, not 'nearest'")
    props.finish()
    if values.shape[3] not in (1, 3):
        raise element.error(f"its file has {values.shape[3]} channels; read are 1 and 3")
    return values, to_world


MEDIA: dict[str, Callable[[Properties], Medium]] = {
    "homogeneous": _homogeneous,
    "heterogeneous": _heterogeneous,
}
PHASES: dict[str, Callable[[Properties], Phase]] = {
    "isotropic": lambda props: media.Isotropic(),
    "hg": lambda props: media.HenyeyGreenstein(g=props.number("g", 0.8)),
    "rayleigh": lambda props: media.Rayleigh(),
    "tabphase": _tabulated,
    "blendphase": _blend,
    "sggx": _sggx,
}
