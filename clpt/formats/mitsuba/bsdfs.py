"""Materials of a Mitsuba scene. Defaults that differ from ours are Mitsuba's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from clpt import measured, spectra
from clpt.formats.mitsuba.coats import KINDS as COATS
from clpt.formats.mitsuba.coats import SMOOTHEST, Coat
from clpt.formats.mitsuba.limits import within
from clpt.formats.mitsuba.principled import fluorescent, hair, principled, principled_thin
from clpt.formats.mitsuba.properties import Context, PluginReader, Properties, numbers, unknown
from clpt.formats.mitsuba.spectra import (
    coefficient,
    factor,
    index,
    ior,
    nested_textures,
    over,
    real,
    reflectance,
    texture,
)
from clpt.formats.mitsuba.xml import Element
from clpt.formats.pbrt.textures import map_values
from clpt.formats.reading import EVEN, GREY, attempt
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.params import defaults, params
from clpt.scene.textures import Bitmap, Product, Texture
from clpt.spectra import Constant, RGBUnbounded, Spectrum

Parameters = dict[str, Any]

# metals of Mitsuba without free data
WITHOUT_DATA = ("Cu2O", "CuO", "HgTe", "Se", "Se-e", "SnTe", "Ta")
GREY_METAL = 0.3  # what they reflect head-on
PHONG = ("phong", "as")  # distributions of Mitsuba 0.6, of exponent 2 / alpha^2 - 2
STAND_IN: Material = materials.Diffuse()  # stands for a material with an error
MOST_PARTS = 32  # of a `mixturebsdf`
TINY = 1e-30
AIR = 1.000277  # the default of `ext_eta`: src/bsdfs/ior.h


def bsdf(element: Element, context: Context) -> Material:
    """Make the material that a <bsdf> describes, once for all references to it."""
    return context.once(element, lambda _: attempt(lambda: _bsdf(element, context), STAND_IN))


def _bsdf(element: Element, context: Context) -> Material:
    name = element.attributes.get("id", "")
    if element.type in COATS:
        return _coated(element, context)
    if element.type not in PLUGINS:
        return context.stand_in(unknown(element, PLUGINS), element, materials.Diffuse(name=name))
    cls, read = PLUGINS[element.type]
    props = Properties(element, context)
    with element.locating():
        material = cls(name=name, **within(cls, read(props), props))
    props.finish()
    return material


def _diffuse(props: Properties) -> Parameters:
    old = "diffuse_reflectance"  # Mitsuba 0.6's name
    name = old if old in props.named else "reflectance"
    return {"reflectance": reflectance(props, name, 0.5)}


def _rough_diffuse(props: Properties) -> Parameters:
    """Read Mitsuba 0.6's `roughdiffuse`: alpha is the root of twice the slopes' variance."""
    alpha = real(props, "alpha", 0.2)
    degrees = np.degrees(np.sqrt(0.5))
    scaled = Product(first=alpha, second=float(degrees)) if isinstance(alpha, Texture) else None
    return {
        **_diffuse(props),
        "sigma": scaled or min(max(alpha * degrees, 0.0), 90.0),
        "interreflection": not props.flag("use_fast_approx", False),
    }


def _phong(props: Properties) -> Parameters:
    return {
        "diffuse": reflectance(props, "diffuse_reflectance", 0.5),
        "specular": reflectance(props, "specular_reflectance", 0.2),
        "exponent": real(props, "exponent", 30.0),
    }


def _dielectric(props: Properties) -> Parameters:
    return {**_thin_dielectric(props), "absorption": coefficient(props, "absorption")}


def _thin_dielectric(props: Properties) -> Parameters:
    return {
        "int_ior": ior(props, "int_ior", "bk7"),
        "ext_ior": ior(props, "ext_ior", "air"),
        "specular_reflectance": reflectance(props, "specular_reflectance", 1.0),
        "specular_transmittance": reflectance(props, "specular_transmittance", 1.0),
    }


def _coated_dielectric(props: Properties) -> Parameters:
    return {**_dielectric(props), "layers": _layers(props)}


def _rough_dielectric(props: Properties) -> Parameters:
    return {**_coated_dielectric(props), **_roughness(props)}


def _metal(props: Properties) -> Parameters:
    around = _around(props)
    if props.context.old:
        return _old_metal(props, around)
    named = "material" in props.named
    if named and ("eta" in props.named or "k" in props.named):
        raise props.element.error("give either 'material' or 'eta' and 'k', not both")
    child = props.take("material")
    if child is not None:
        with child.locating():
            eta, k = _named_metal(child, props.context)
    else:
        eta, k = index(props, "eta", 0.0), index(props, "k", 1.0)
    return {"eta": over(eta, around), "k": over(k, around)}


def _old_metal(props: Properties, around: float) -> Parameters:
    """Take Mitsuba 0.6's metal: copper by default (src/bsdfs/conductor.cpp), `eta` and `k` over it.

    The name `none` is a mirror.
    """
    child = props.take("material")
    if child is None:
        eta, k = spectra.metal("Cu")
    else:
        with child.locating():
            eta, k = _named_metal(child, props.context)
    return {"eta": over(index(props, "eta", eta), around), "k": over(index(props, "k", k), around)}


def _around(props: Properties) -> float:
    """Take Mitsuba 0.6's index around a metal; eta and k are relative to it."""
    child = props.named.get("ext_eta")
    if child is None:
        return AIR if props.context.old else 1.0
    around = ior(props, "ext_eta", "air")
    around = around.value if isinstance(around, Constant) else around
    if not isinstance(around, float) or around <= 0.0:
        raise child.error("must be a number above 0 or the name of a glass, liquid or gas")
    return around


def _named_metal(child: Element, context: Context) -> tuple[Spectrum, Spectrum]:
    """Return a metal by its name; grey metal if no free data exist."""
    name = child.attribute("value")
    if name.removesuffix("_palik") not in WITHOUT_DATA:
        return spectra.metal(name)
    context.warn(child, f"there are no free data of {name}; a grey metal stands for it")
    return Constant(1.0), Constant(2.0 * np.sqrt(GREY_METAL / (1.0 - GREY_METAL)))


def _conductor(props: Properties) -> Parameters:
    return {
        **_metal(props),
        "specular_reflectance": reflectance(props, "specular_reflectance", 1.0),
        "layers": _layers(props),
    }


def _rough_conductor(props: Properties) -> Parameters:
    return {**_conductor(props), **_roughness(props)}


def _layers(props: Properties) -> list[materials.Layer]:
    """The nested <bsdf type="layer">, a plugin of ours, from the outside in."""
    return [_layer(element, props.context) for element in props.objects("bsdf")]


def _layer(element: Element, context: Context) -> materials.Layer:
    if element.type != "layer":
        raise element.error("only a <bsdf> of the type 'layer' can stand here")
    props = Properties(element, context)
    values = props.named.get("eta")
    with element.locating():
        if values is not None and values.tag == "string":
            eta = spectra.glass(props.text("eta", ""))
        else:
            eta = index(props, "eta", spectra.glass("water"))
        result = materials.Layer(
            eta=eta,
            k=index(props, "k", 0.0),
            thickness=props.number("thickness", 400.0),
            profile=real(props, "profile", 1.0),
        )
    props.finish()
    return result


def _distribution(props: Properties) -> str:
    props.ignore("sample_visible")
    known = (*materials.DISTRIBUTIONS, *(PHONG if props.context.old else ()))
    distribution = props.text("distribution", "beckmann", known)
    if distribution in PHONG:
        props.context.read_as(props.element, f"distribution {distribution!r}", "beckmann")
        return "beckmann"
    return distribution


def _roughness(props: Properties) -> Parameters:
    distribution = _distribution(props)
    if "alpha" in props.named and ("alpha_u" in props.named or "alpha_v" in props.named):
        raise props.element.error("give either 'alpha' or 'alpha_u' and 'alpha_v', not both")
    alpha = _alpha(props, "alpha", 0.1)
    return {
        "distribution": distribution,
        "alpha_u": _alpha(props, "alpha_u", alpha),
        "alpha_v": _alpha(props, "alpha_v", alpha),
    }


def _alpha(props: Properties, name: str, default: Any) -> Any:
    value = real(props, name, default)
    return max(value, SMOOTHEST) if isinstance(value, float) else value


def _plastic(props: Properties) -> Parameters:
    return {
        "diffuse_reflectance": reflectance(props, "diffuse_reflectance", 0.5),
        "int_ior": ior(props, "int_ior", "polypropylene"),
        "ext_ior": ior(props, "ext_ior", "air"),
        "specular_reflectance": reflectance(props, "specular_reflectance", 1.0),
        "nonlinear": props.flag("nonlinear", False),
    }


def _rough_plastic(props: Properties) -> Parameters:
    distribution = _distribution(props)
    return {**_plastic(props), "distribution": distribution, "alpha": _alpha(props, "alpha", 0.1)}


def _polarized_plastic(props: Properties) -> Parameters:
    """As Mitsuba's without polarisation, except for the internal reflection of its boundary."""
    props.context.warn(props.element, "light has no polarisation here: taken as roughplastic")
    return {**_rough_plastic(props), "nonlinear": False}


def _polarizing(share: float) -> PluginReader[Parameters]:
    """Return the reader of a plate that lets a share of unpolarised light straight through."""

    def read(props: Properties) -> Parameters:
        props.ignore("theta", "delta", "polarizing", "left_handed")
        props.context.warn(props.element, "light has no polarisation here: it dims all light alike")
        passed = reflectance(props, "transmittance", 1.0)
        if isinstance(passed, Texture):
            passed = Product(first=passed, second=share)
        elif isinstance(passed, Spectrum):
            passed = tuple(share * passed.to_rgb())
        else:
            passed = tuple(share * np.broadcast_to(passed, 3))
        return {"int_ior": 1.0, "ext_ior": 1.0, "specular_transmittance": passed}

    return read


def _grating(props: Properties) -> Parameters:
    """Ours, see docs/mitsuba_plugins.md: names are those of clpt.scene.materials.Grating."""
    kind = materials.Grating
    declared, usual = params(kind), defaults(kind)
    values: Parameters = {
        name: props.text(name, usual[name], declared[name].choices) for name in ("mode", "profile")
    }
    for name in ("period", "angle", "depth", "fill"):
        values[name] = real(props, name, usual[name])
    values["orders"] = float(props.integer("orders", int(kind.orders)))
    child = props.take("efficiencies")
    if child is not None:
        values["efficiencies"] = numbers(child, "value")
    if "ior" in props.named:
        values["ior"] = ior(props, "ior", "bk7")
    return {**values, **_metal(props), "reflectance": reflectance(props, "reflectance", 1.0)}


def _measured(props: Properties) -> Parameters:
    child, path = props.named.get("filename", props.element), props.file()
    with child.locating():
        return {"data": measured.read(path)}


def _measured_polarized(props: Properties) -> Parameters:
    """Take the unpolarised part of a measurement; `alpha_sample` changes no picture."""
    props.ignore("alpha_sample")
    props.context.warn(props.element, "light has no polarisation here: its first number is taken")
    wavelength = props.number("wavelength", -1.0)
    child, path = props.named.get("filename", props.element), props.file()
    with child.locating():
        alone = None if wavelength == -1.0 else wavelength
        return {"data": measured.read_polarized(path, alone)}


def _null(props: Properties) -> Parameters:
    return {}


def _two_sided(props: Properties) -> Parameters:
    sides = _nested(props, 1, 2)
    return {"front": sides[0], "back": sides[1] if len(sides) == 2 else None}


def _mask(props: Properties) -> Parameters:
    return {"material": _nested(props, 1, 1)[0], "opacity": _share(props, "opacity")}


def _blend(props: Properties) -> Parameters:
    if "weight" not in props.named:
        raise props.element.error("needs the parameter 'weight'")
    first, second = _nested(props, 2, 2)
    return {"first": first, "second": second, "weight": _share(props, "weight")}


def _mixture(props: Properties) -> Parameters:
    """Read Mitsuba 0.6's `mixturebsdf`: nested blends; the share that the weights lack absorbs."""
    child = props.take("weights")
    if child is None:
        raise props.element.error("needs the parameter 'weights'")
    weights = numbers(child, "value")
    parts = _nested(props, 1, MOST_PARTS)
    if len(weights) != len(parts) or min(weights) < 0.0 or not sum(weights) > 0.0:
        message = f"must be {len(parts)} numbers, one for each <bsdf>, none of them negative"
        raise child.error(message)
    if sum(weights) > 1.0:
        props.context.warn(child, "the weights exceed 1 in all: they are divided by their sum")
        weights = [weight / sum(weights) for weight in weights]
    parts.append(materials.Diffuse(reflectance=0.0))
    weights.append(max(1.0 - sum(weights), 0.0))
    mixed, total = parts[0], weights[0]
    for part, weight in list(zip(parts, weights, strict=True))[1:-1]:
        total += weight
        mixed = materials.Blend(first=mixed, second=part, weight=weight / max(total, TINY))
    return {"first": mixed, "second": parts[-1], "weight": weights[-1]}


def _diffuse_transmission(props: Properties) -> Parameters:
    return {"transmittance": reflectance(props, "transmittance", 0.5), "reflectance": 0.0}


def _ward(props: Properties) -> Parameters:
    variants = {"balanced": "balanced", "ward-duer": "duer", "ward": "ward"}
    both = _alpha(props, "alpha", 0.1)
    return {
        "diffuse": reflectance(props, "diffuse_reflectance", 0.5),
        "specular": reflectance(props, "specular_reflectance", 0.2),
        "variant": variants[props.text("variant", "balanced", tuple(variants))],
        "alpha_u": _alpha(props, "alpha_u", both),
        "alpha_v": _alpha(props, "alpha_v", both),
    }


def _coated(element: Element, context: Context) -> Material:
    """Read Mitsuba 0.6's `coating` and `roughcoating`, see coats.py."""
    props = Properties(element, context)
    (inner,) = _nested(props, 1, 1)
    rough = element.type == "roughcoating"
    kept: Parameters = {"name": element.attributes.get("id", "")}
    if rough:
        kept["distribution"] = _distribution(props)
    thickness = props.number("thickness", 1.0)
    coat = Coat(
        element=element,
        context=context,
        indices={"int_ior": ior(props, "int_ior", "bk7"), "ext_ior": ior(props, "ext_ior", "air")},
        specular=reflectance(props, "specular_reflectance", 1.0),
        alpha=_alpha(props, "alpha", 0.1) if rough else SMOOTHEST,
        rough=rough,
        depth=map_values(coefficient(props, "sigma_a"), lambda sigma: sigma * thickness),
        kept=kept,
    )
    props.finish()
    return coat.over(inner)


def _share(props: Properties, name: str) -> Any:
    value = real(props, name, 0.5)
    return value if isinstance(value, Texture) else min(max(value, 0.0), 1.0)


def _bent(props: Properties) -> Parameters:
    return {
        "material": _nested(props, 1, 1)[0],
        "flip_invalid": props.flag("flip_invalid_normals", True),
        "shadowing": props.flag("use_shadowing_function", True),
    }


def _normal_map(props: Properties) -> Parameters:
    values = _bent(props)
    unnamed = nested_textures(props) if props.context.old else []
    if len(unnamed) == 1 and "normalmap" not in props.named:
        props.named["normalmap"] = unnamed[0]  # Mitsuba 0.6 does not name it
    if "normalmap" not in props.named:
        raise props.element.error("needs the texture 'normalmap'")
    result = factor(props, "normalmap", None)
    if isinstance(result, (Constant, RGBUnbounded)):
        result = Bitmap(image=result.to_rgb("unbounded").astype(np.float32)[None, None], raw=True)
    if isinstance(result, Bitmap) and result.image is GREY:
        result = replace(result, image=EVEN)
    if not isinstance(result, Bitmap):
        raise props.element.error("'normalmap' must be a bitmap, or one colour")
    return {**values, "map": result}


def _bump_map(props: Properties) -> Parameters:
    values = _bent(props)
    matches = nested_textures(props)
    if len(matches) != 1:
        raise props.element.error(f"needs one texture of heights, not {len(matches)}")
    return {**values, "height": texture(matches[0], props), "scale": props.number("scale", 1.0)}


def _nested(props: Properties, low: int, high: int) -> list[Material]:
    inner = props.objects("bsdf")
    if not low <= len(inner) <= high:
        wanted = str(low) if low == high else f"{low} or {high}"
        raise props.element.error(f"needs {wanted} nested <bsdf>, not {len(inner)}")
    return [bsdf(element, props.context) for element in inner]


PLUGINS: dict[str, tuple[type[Material], PluginReader[Parameters]]] = {
    "diffuse": (materials.Diffuse, _diffuse),
    "phong": (materials.Phong, _phong),
    "roughdiffuse": (materials.OrenNayar, _rough_diffuse),
    "ward": (materials.Ward, _ward),
    "dielectric": (materials.Dielectric, _coated_dielectric),
    "thindielectric": (materials.ThinDielectric, _thin_dielectric),
    "roughdielectric": (materials.RoughDielectric, _rough_dielectric),
    "conductor": (materials.Conductor, _conductor),
    "roughconductor": (materials.RoughConductor, _rough_conductor),
    "plastic": (materials.Plastic, _plastic),
    "roughplastic": (materials.RoughPlastic, _rough_plastic),
    "pplastic": (materials.RoughPlastic, _polarized_plastic),
    "polarizer": (materials.ThinDielectric, _polarizing(0.5)),
    "circular": (materials.ThinDielectric, _polarizing(0.5)),
    "retarder": (materials.ThinDielectric, _polarizing(1.0)),
    "principled": (materials.Principled, principled),
    "principledthin": (materials.PrincipledThin, principled_thin),
    "grating": (materials.Grating, _grating),
    "fluorescent": (materials.Fluorescent, fluorescent),
    "hair": (materials.Hair, hair),
    "measured": (materials.Measured, _measured),
    "measured_polarized": (materials.Merl, _measured_polarized),
    "difftrans": (materials.DiffuseTransmission, _diffuse_transmission),
    "mixturebsdf": (materials.Blend, _mixture),
    "null": (materials.Null, _null),
    "twosided": (materials.TwoSided, _two_sided),
    "mask": (materials.Mask, _mask),
    "blendbsdf": (materials.Blend, _blend),
    "normalmap": (materials.NormalMap, _normal_map),
    "bumpmap": (materials.BumpMap, _bump_map),
}
