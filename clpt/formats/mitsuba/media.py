"""Media and phase functions of a Mitsuba scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.errors import UnknownKindError
from clpt.formats.mitsuba import grids, spectra
from clpt.formats.mitsuba.limits import within
from clpt.formats.mitsuba.principled import dye, fluorescent
from clpt.formats.mitsuba.properties import Context, PluginReader, Properties, numbers, unknown
from clpt.formats.mitsuba.xml import Element
from clpt.formats.pbrt.scattering import MEDIA as MEASURED
from clpt.formats.pbrt.textures import map_values
from clpt.scene import media, phases
from clpt.scene.media import Grid, Homogeneous, Medium
from clpt.scene.phases import Phase
from clpt.scene.textures import Texture
from clpt.scene.volumes import Volume
from clpt.spectra import Constant, RGBUnbounded

PRESET_UNIT = 100.0  # factor on the coefficients [1/mm] of presets in Mitsuba 0.6
SUBSURFACE = ("dipole", "singlescatter")


def medium(element: Element, context: Context) -> Medium:
    """Make the medium that a <medium> describes, the same for every reference."""
    return context.once(element, lambda item: _made(item, context, MEDIA))


def phase(element: Element, context: Context) -> Phase:
    """Make the phase function that a <phase> describes."""
    return context.once(element, lambda item: _made(item, context, PHASES))


def side(props: Properties, name: str) -> Medium | None:
    """Take the medium of a side of a shape, `interior` or `exterior`, or of a sensor."""
    matches = [child for child in props.nested if child.name == name and child.tag == "medium"]
    child = props.take(name) if not matches else matches[0]
    if child is None:
        return None
    if matches:
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
        result = plugins[element.type](props)
    props.finish()
    return result


def _homogeneous(props: Properties) -> Medium:
    """A medium that is the same everywhere, or has its albedo or its scattering on a grid."""
    if (density := grids.grid(props, "sigma_t")) is not None:
        raise density.error('a density on a grid needs a medium of the type "heterogeneous"')
    albedo, weight = grids.grid(props, "albedo"), _weight(props)
    medium = _even(props)
    if albedo is None and weight is None:
        return medium
    room = props.context.rooms.get(id(props.element))
    if room is None:  # it is made again when the shapes that it fills are known
        props.context.endless[id(props.element)] = medium
        return medium
    beside = [
        None if item is None else grids.spread(read(item, props.context), room, item)
        for item, read in ((albedo, grids.colours), (weight, grids.one_channel))
    ]
    box = next(item for item in beside if item is not None).to_world
    return _on_grid(medium, {"sigma_t": medium.sigma_t, "density": grids.ones(box)}, *beside)


def _even(props: Properties) -> Homogeneous:
    """The medium without what is on grids."""
    props.ignore("has_spectral_extinction", "sample_emitters")  # both are found
    blend = _blend_on_grid(props)
    child = props.object("phase")
    parameters = _old_coefficients(props) if props.context.old else None
    if parameters is None:
        parameters = {
            "sigma_t": spectra.coefficient(props, "sigma_t", 1.0),
            "albedo": spectra.reflectance(props, "albedo", 0.75),
        }
    if props.context.old and props.element.type == "homogeneous" and "g" in props.named:
        _reduce(parameters, props)
    isotropic: Phase = phases.Isotropic()
    parameters |= {
        "scale": props.number("scale", 1.0),
        "phase": isotropic if child is None else blend or phase(child, props.context),
        "name": props.element.attributes.get("id", ""),
    }
    if "emission" in props.named:
        parameters["emission"] = spectra.emission(props, "emission")
    return Homogeneous(**within(Homogeneous, parameters, props))


def _reduce(parameters: dict[str, Any], props: Properties) -> None:
    """Take Mitsuba 0.6's `g`, by which scattering is reduced: src/librender/medium.cpp."""
    g = props.number("g", 0.0)
    if not -1.0 < g < 1.0:
        raise props.element.error(f"'g' must lie between -1 and 1, not {g:g}")
    if "sigma_s" in parameters:
        parameters["sigma_s"] = map_values(parameters["sigma_s"], lambda s: s * (1.0 - g))
        return
    even = [
        value.value if isinstance(value, Constant) else value
        for value in (parameters["sigma_t"], parameters["albedo"])
    ]
    if not all(isinstance(value, float) for value in even):
        props.context.warn(props.element, "'g' is left out beside a colour of sigmaT or albedo")
        return
    sigma_t, albedo = even
    kept = 1.0 - albedo * g
    parameters |= {"sigma_t": sigma_t * kept, "albedo": albedo * (1.0 - g) / kept}


def body(element: Element, context: Context) -> tuple[Medium, Any, Any]:
    """Read Mitsuba 0.6's <subsurface>: the medium of a body, its index and that around it.

    Light walks in the body, where 0.6 takes a dipole for that (src/subsurface/dipole.cpp).
    """
    if element.type not in SUBSURFACE:
        raise unknown(element, SUBSURFACE)
    props = Properties(element, context)
    props.ignore("irr_samples", "irr_indirect", "quality", "single_scattering")
    coefficients = _old_coefficients(props) or {
        "sigma_t": spectra.coefficient(props, "sigma_t", 1.0),
        "albedo": spectra.reflectance(props, "albedo", 0.75),
    }
    phase = phases.HenyeyGreenstein(g=props.number("g", 0.0))
    with element.locating():
        medium = Homogeneous(**coefficients, scale=props.number("scale", 1.0), phase=phase)
    indices = spectra.ior(props, "int_ior", "bk7"), spectra.ior(props, "ext_ior", "air")
    props.finish()
    context.read_as(element, f"subsurface {element.type!r}", "a body in which light walks")
    return medium, *indices


def _old_coefficients(props: Properties) -> dict[str, Any] | None:
    """Take Mitsuba 0.6's `sigma_a` and `sigma_s`, or a preset; Skin1 is the default.

    None if the file gives `sigma_t` or `albedo`. A preset has the coefficients measured per mm,
    times PRESET_UNIT (src/medium/materials.h); its scattering is the reduced coefficient
    (src/librender/medium.cpp).
    """
    if props.element.type not in ("homogeneous", *SUBSURFACE):
        return None
    names = ("sigma_a", "sigma_s")
    if any(name in props.named for name in names):
        return {name: spectra.coefficient(props, name) for name in names}
    if any(name in props.named for name in ("sigma_t", "albedo")):
        return None
    name = props.text("material", "skin1")
    presets = {_plain_name(known): values for known, values in MEASURED.items()}
    if _plain_name(name) not in presets:
        raise UnknownKindError("medium", name, MEASURED, **props.element.location())
    scattering, absorption = presets[_plain_name(name)]
    message = f"has {PRESET_UNIT:g} times the coefficients of {name} per mm, as in Mitsuba 0.6"
    props.context.warn(props.element, f"{message}: in metres a `scale` of 10 is true to nature")
    return {
        "sigma_a": RGBUnbounded(*(PRESET_UNIT * value for value in absorption)),
        "sigma_s": RGBUnbounded(*(PRESET_UNIT * value for value in scattering)),
    }


def _plain_name(name: str) -> str:
    return "".join(name.lower().split()).replace("_", "")


def _weight(props: Properties) -> Element | None:
    """Return the weight of the medium's `blendphase` if it is a grid; else None."""
    blend = _own_blend(props)
    return None if blend is None else grids.grid(Properties(blend, props.context), "weight")


def _own_blend(props: Properties) -> Element | None:
    children = [props.context.resolve(item) for item in (*props.nested, *props.named.values())]
    blends = [item for item in children if item.tag == "phase" and item.type == "blendphase"]
    return blends[0] if len(blends) == 1 else None


def _blend_on_grid(props: Properties) -> phases.Blend | None:
    """The medium's `blendphase` without its weight, if that is a grid."""
    element = _own_blend(props)
    if element is None:
        return None
    inner = Properties(element, props.context)
    if grids.grid(inner, "weight") is None:
        return None
    first, second = _halves(inner)
    inner.finish()
    return phases.Blend(first=first, second=second)


def _on_grid(
    medium: Homogeneous,
    values: dict[str, Any],
    tint: Volume | None,
    share: Volume | None,
    **more: Any,
) -> Medium:
    """A medium whose density is on a grid, and perhaps its albedo, or the share of its phases."""
    beside = [item for item in (tint, share) if item is not None]
    result = dict(values)
    colours = result.get("color_grid")
    if beside:
        matches = grids.together(
            result["density"], *beside, *([] if colours is None else [colours])
        )
        result["density"] = matches[0]
        if colours is not None:
            result["color_grid"] = matches[-1]
        tint = None if tint is None else matches[1]
        share = None if share is None else matches[len(beside)]
    if tint is not None:
        result |= {"albedo": 1.0, "albedo_grid": tint}
    result = {
        "albedo": medium.albedo, "scale": medium.scale, "phase": medium.phase,
        "emission": medium.emission, "name": medium.name, **result, **more,
    }  # fmt: skip
    if share is None:
        return Grid(**result)
    blend: Any = medium.phase
    second = np.clip(share.values, 0.0, 1.0)
    parts = [
        Grid(**{**result, "density": Volume(result["density"].values * part, share.to_world),
                "phase": item, "name": ""})
        for item, part in ((blend.first, 1.0 - second), (blend.second, second))
    ]  # fmt: skip
    return media.Mixture(parts=tuple(parts), name=medium.name)


def _tabulated(props: Properties) -> Phase:
    """Values over the cosine, even from -1 to 1; light that goes on straight is at 1."""
    child = props.take("values")
    if child is None:
        raise props.element.error("needs its 'values', two numbers or more")
    try:
        values = [
            float(item) for item in child.attributes.get("value", "").replace(",", " ").split()
        ]
    except ValueError:
        raise child.error("must be numbers, with commas between them") from None
    with child.locating():
        return phases.Tabulated(values=values)


def _blend(props: Properties) -> Phase:
    first, second = _halves(props)
    if grids.grid(props, "weight") is not None:
        message = "its 'weight' is a grid, as only that of a medium's own blendphase may be"
        raise props.element.error(message)
    share = spectra.real(props, "weight", 0.5)
    if isinstance(share, Texture):
        raise props.element.error("'weight' must be a number or a <volume>")
    return phases.Blend(weight=min(max(share, 0.0), 1.0), first=first, second=second)


def _mixed_phase(props: Properties) -> Phase:
    """Read Mitsuba 0.6's `mixturephase`: nested blends by `weights`, which are divided by their
    sum."""
    child = props.take("weights")
    parts = [phase(item, props.context) for item in props.objects("phase")]
    weights = [] if child is None else numbers(child, "value")
    if not parts or len(weights) != len(parts) or min(weights) < 0.0 or not sum(weights) > 0.0:
        raise props.element.error("needs 'weights', a number above 0 for each <phase> in it")
    mixed, total = parts[0], weights[0]
    for part, weight in list(zip(parts, weights, strict=True))[1:]:
        total += weight
        mixed = phases.Blend(first=mixed, second=part, weight=weight / total if total else 0.5)
    return mixed


def _halves(props: Properties) -> list[Phase]:
    parts = [phase(item, props.context) for item in props.objects("phase")]
    if len(parts) != 2:
        raise props.element.error(f"must hold two phase functions, not {len(parts)}")
    return parts


def _sggx(props: Properties) -> Phase:
    raise props.element.error(
        "is not supported: its density depends on how flakes lie, which media of clpt do not tell;"
        ' "hg" stands for round particles'
    )


def _heterogeneous(props: Properties) -> Medium:
    """A medium in the box of its `sigma_t`, which is on a grid or the same in all of the box.

    Where light of ours is on a grid, and `sigma_t` is no <volume>, the box is that of the light.
    """
    context, more = props.context, _more(props)
    sigma_t, weight = grids.grid(props, "sigma_t"), _weight(props)
    if context.old and sigma_t is None:
        return _homogeneous(props)  # in 0.6 the shape bounds it
    albedo = grids.grid(props, "albedo")
    tint = None if albedo is None else grids.colours(albedo, context)
    share = None if weight is None else grids.one_channel(weight, context)
    lit = next((item for item in more.values() if isinstance(item, Volume)), None)
    if sigma_t is not None:
        factor, density, colours = grids.density(sigma_t, context)
    elif lit is not None and props.named.get("sigma_t") is None:
        density, colours = grids.ones(lit.to_world, lit.values.shape), None
    else:
        density, colours = grids.ones(grids.even_box(props, "sigma_t")), None
    medium = _even(props)
    values = {
        "sigma_t": medium.sigma_t if sigma_t is None else factor,
        "density": density,
        "color_grid": colours,
    }
    return _on_grid(medium, values, tint, share, **more)


def _soot(props: Properties) -> media.Soot:
    """The soot of a flame, a plugin of our own."""
    more = _more(props)
    volume = grids.grid(props, "density")
    if volume is not None:
        more["density"] = grids.one_channel(volume, props.context)
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
    """Read several media in the same space, clpt's own plugin."""
    parts = [medium(item, props.context) for item in props.objects("medium")]
    name = props.element.attributes.get("id", "")
    return media.Mixture(parts=tuple(parts), to_world=props.placement(), name=name)


def _plain(props: Properties) -> dict[str, Any]:
    """Take what each medium of our own has: the words, and defaults, of scene.json."""
    values = {name: spectra.coefficient(props, name) for name in ("sigma_a", "sigma_s", "sigma_t")}
    child = props.object("phase")
    if child is not None:
        values["phase"] = phase(child, props.context)
    return {
        **values,
        "albedo": spectra.reflectance(props, "albedo", 1.0),
        "scale": props.number("scale", 1.0),
        "name": props.element.attributes.get("id", ""),
    }


def _more(props: Properties) -> dict[str, Any]:
    """Take what is ours: `bits`, and light on grids."""
    matches: dict[str, Any] = {}
    for name in ("emission_grid", "temperature"):
        if (volume := grids.grid(props, name)) is not None:
            matches[name] = grids.one_channel(volume, props.context)
    if "temperature" in matches:
        matches["brightness"] = props.number("brightness", 1.0)
        matches["normalised"] = props.flag("normalised", False)
    if "bits" in props.named:
        matches["bits"] = props.integer("bits", 16)
    return matches


MEDIA: dict[str, PluginReader[Medium]] = {
    "homogeneous": _homogeneous,
    "heterogeneous": _heterogeneous,
    "soot": _soot,
    "cloud": _cloud,
    "dyed": _dyed,
    "mixture": _mixture,
}
PHASES: dict[str, PluginReader[Phase]] = {
    "mixturephase": _mixed_phase,
    "isotropic": lambda props: phases.Isotropic(),
    "hg": lambda props: phases.HenyeyGreenstein(g=props.number("g", 0.8)),
    "rayleigh": lambda props: phases.Rayleigh(),
    "tabphase": _tabulated,
    "blendphase": _blend,
    "reradiating": lambda props: phases.Reradiating(**fluorescent(props)),
    "sggx": _sggx,
}
