"""Media and phase functions of a Mitsuba scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.formats import volumes
from clpt.formats.mitsuba import spectra
from clpt.formats.mitsuba.fluorescence import dye, fluorescent
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
        **({"emission": spectra.emission(props, "emission")} if "emission" in props.named else {}),
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
    """A medium of numbers on grids; where none is, one that is the same everywhere.

    A grid of an albedo, or of light, may stand in a density that is one number everywhere.
    """
    more = _more(props)
    volume = _grid(props, "sigma_t")
    given: dict[str, Any] = {}
    if volume is not None:
        given = props.context.once(volume, lambda one: _grid_volume(one, props.context))
    medium = _homogeneous(props)
    boxes = [one for one in more.values() if isinstance(one, Volume)]
    if volume is None and not boxes:  # constvolume, or a number
        return medium
    if volume is None:
        box = boxes[0]
        even = Volume(np.ones(box.values.shape[:3], np.float32), box.to_world)
        given = {"sigma_t": medium.sigma_t, "density": even}
    return Grid(
        **given,
        **{"albedo": medium.albedo, **more},
        scale=medium.scale,
        phase=medium.phase,
        emission=medium.emission,
        name=medium.name,
    )


def _soot(props: Properties) -> media.Soot:
    """The soot of a flame, a plugin of our own."""
    more = _more(props)
    volume = _grid(props, "density")
    if volume is not None:
        more["density"] = _one_channel(volume, props.context)
    return media.Soot(
        share=props.number("share", 1e-6),
        scale=props.number("scale", 1.0),
        name=props.element.attributes.get("id", ""),
        **more,
    )


def _cloud(props: Properties) -> media.Cloud:
    """A cloud by formula, a plugin of our own."""
    return media.Cloud(
        density=props.number("density", 1.0),
        wispiness=props.number("wispiness", 1.0),
        frequency=props.number("frequency", 5.0),
        low=props.vector("low", (0.0, 0.0, 0.0)),
        high=props.vector("high", (1.0, 1.0, 1.0)),
        resolution=props.integer("resolution", 0),
        to_world=props.placement(),
        **_plain(props),
    )


def _dyed(props: Properties) -> media.Dyed:
    """A liquid with a dye in it, a plugin of our own."""
    strength = props.number("strength", 1.0)
    return media.Dyed(dye=dye(props), strength=strength, **_plain(props))


def _mixture(props: Properties) -> media.Mixture:
    """Several media in one place, a plugin of our own."""
    parts = [medium(one, props.context) for one in props.objects("medium")]
    name = props.element.attributes.get("id", "")
    return media.Mixture(parts=tuple(parts), to_world=props.placement(), name=name)


def _plain(props: Properties) -> dict[str, Any]:
    """Take what each medium of our own has: the words, and defaults, of scene.json."""
    given = {name: spectra.coefficient(props, name) for name in ("sigma_a", "sigma_s", "sigma_t")}
    child = props.object("phase")
    if child is not None:
        given["phase"] = phase(child, props.context)
    return {
        **given,
        "albedo": spectra.reflectance(props, "albedo", 1.0),
        "scale": props.number("scale", 1.0),
        "name": props.element.attributes.get("id", ""),
    }


def _more(props: Properties) -> dict[str, Any]:
    """Take what a grid has beside its density: `bits`, an albedo, and light (ours) on grids."""
    found: dict[str, Any] = {}
    albedo = _grid(props, "albedo")
    if albedo is not None:
        values, to_world = props.context.once(albedo, lambda one: _grid_values(one, props.context))
        if values.max() > 1.0:
            raise albedo.error("an albedo cannot exceed 1")
        colours = np.repeat(values, 3 // values.shape[3], axis=3)
        found |= {"albedo": 1.0, "albedo_grid": Volume(colours, to_world)}
    for name in ("emission_grid", "temperature"):
        if (volume := _grid(props, name)) is not None:
            found[name] = _one_channel(volume, props.context)
    if "temperature" in found:
        found["brightness"] = props.number("brightness", 1.0)
        found["normalised"] = props.flag("normalised", False)
    if "bits" in props.named:
        found["bits"] = props.integer("bits", 16)
    return found


def _grid(props: Properties, name: str) -> Element | None:
    """Take a <volume> of the type `gridvolume`, if that is what a parameter is."""
    child = props.named.get(name)
    volume = None if child is None else props.context.resolve(child)
    if volume is None or volume.tag != "volume" or volume.type != "gridvolume":
        return None
    props.take(name)
    return volume


def _one_channel(element: Element, context: Context) -> Volume:
    """The numbers of a <volume type="gridvolume">."""
    values, to_world = context.once(element, lambda one: _grid_values(one, context))
    if values.shape[3] != 1:
        raise element.error(f"its file has {values.shape[3]} channels; read is 1")
    return Volume(values[..., 0], to_world)


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
    "soot": _soot,
    "cloud": _cloud,
    "dyed": _dyed,
    "mixture": _mixture,
}
PHASES: dict[str, Callable[[Properties], Phase]] = {
    "isotropic": lambda props: media.Isotropic(),
    "hg": lambda props: media.HenyeyGreenstein(g=props.number("g", 0.8)),
    "rayleigh": lambda props: media.Rayleigh(),
    "tabphase": _tabulated,
    "blendphase": _blend,
    "reradiating": lambda props: media.Reradiating(**fluorescent(props)),
    "sggx": _sggx,
}
