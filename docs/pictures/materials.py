"""Pictures of materials: three of each kind, which differ in a telling parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from clpt import measured, spectra
from clpt.scene import Scene, integrators, lights, shapes, textures
from clpt.scene.materials import (
    AshikhminShirley,
    Blend,
    BumpMap,
    CoatedConductor,
    Conductor,
    Dielectric,
    Diffuse,
    DiffuseTransmission,
    Fluorescent,
    GltfSurface,
    Grating,
    Hair,
    Mask,
    Material,
    Measured,
    Merl,
    NormalMap,
    Null,
    Openpbr,
    OrenNayar,
    Phong,
    Plastic,
    Principled,
    PrincipledThin,
    RoughConductor,
    RoughDielectric,
    RoughPlastic,
    ThinDielectric,
    TwoSided,
    Ward,
    pigment,
)
from clpt.transforms import look_at, rotate, scale, translate

from .studio import BLACK, LARGE, PLACES, Picture, arc, knob, lathe, panel, studio

RED, CREAM, BLUE = (0.62, 0.08, 0.05), (0.75, 0.68, 0.55), (0.05, 0.16, 0.45)
GREEN, ORANGE, PAPER = (0.06, 0.36, 0.14), (0.7, 0.25, 0.05), (0.8, 0.68, 0.5)

GOLD = RoughConductor(metal="gold", roughness=0.2)

Shapes = list[shapes.Shape]


def three(
    caption: str,
    *made: Material,
    thing: Callable[[Material, float], Shapes] = lambda material, x: [knob(material, x)],
    spp: int = 96,
    denoise: str | None = None,
    **more: Any,
) -> Picture:
    """Things of three materials, from left to right; `more`: of the studio."""

    def scene() -> Scene:
        things = [thing(m, x) for m, x in zip(made, PLACES, strict=True)]
        return studio([shape for some in things for shape in some], **more)

    return Picture(caption, scene, spp, denoise=denoise)


def each(kind: Callable[..., Material], name: str, values: Sequence[Any], **rest: Any) -> Any:
    """The kind with each of the values of one parameter."""
    return [kind(**{name: value}, **rest) for value in values]


def rough(kind: Callable[..., Material], *alphas: float, **rest: Any) -> list[Material]:
    return [kind(alpha_u=alpha, alpha_v=alpha, **rest) for alpha in alphas]


def metal(name: str) -> dict[str, Any]:
    eta, k = spectra.metal(name)
    return {"eta": eta, "k": k}


def lantern(material: Material, x: float) -> Shapes:
    """A shade around a small lamp."""
    shade = shapes.Cylinder(p0=(x, 0.02, 0), p1=(x, 1.4, 0), radius=0.52, material=material)
    bulb = lights.Area(radiance=(16.0, 13.0, 9.0))
    return [
        shade,
        shapes.Sphere(center=(x, 0.75, 0), radius=0.13, material=BLACK, emission=bulb),
        shapes.Cylinder(p0=(x, 0, 0), p1=(x, 0.65, 0), radius=0.05, material=Diffuse()),
    ]


def bowl(material: Material, x: float) -> Shapes:
    """A bowl without thickness, tilted so that inside and outside are seen."""
    place = translate([x, 0.66, 0]) @ rotate([1, 0, 0], 38) @ rotate([0, 0, 1], -12)
    side = lathe([*arc(0.0, 0.0, 0.66, -90.0, 8.0, 40)])
    return [shapes.Mesh(**side, material=material, to_world=place)]


def disc(material: Material, x: float) -> Shapes:
    """A disk that leans back."""
    place = translate([x, 0.62, 0]) @ rotate([1, 0, 0], -38) @ scale(0.66)
    return [shapes.Disk(material=material, to_world=place)]


def tress(material: Material, x: float) -> Shapes:
    """A lock of three thousand strands that hang in waves, held by a clasp."""
    random = np.random.default_rng(7)
    count, along = 3000, np.linspace(0.0, 1.0, 16)
    spread = np.sqrt(random.random((count, 1))) * (0.1 + 0.22 * np.sin(2.4 * along) ** 0.8)
    angle = 2.0 * np.pi * random.random((count, 1)) + random.normal(0.0, 0.15, (count, 1)) * along
    length = 1.42 + random.normal(0.0, 0.06, (count, 1))
    wave = 0.07 * along * np.sin(15.0 * along + random.normal(0.0, 0.35, (count, 1)))
    radius = np.broadcast_to(0.0042 * (1.0 - 0.6 * along), (count, 16))
    points = np.stack(
        [
            x + spread * np.cos(angle) + wave,
            1.62 - length * along,
            0.7 * spread * np.sin(angle) + 0.5 * wave,
            radius,
        ],
        axis=-1,
    )
    return [
        shapes.Curves(points=points.reshape(-1, 4), lengths=[16] * count, material=material),
        shapes.Cylinder(p0=(x, 1.52, 0.0), p1=(x, 1.68, 0.0), radius=0.125, material=GOLD),
        shapes.Disk(
            to_world=translate([x, 1.68, 0.0]) @ rotate([1, 0, 0], -90) @ scale(0.125),
            material=GOLD,
        ),
    ]


def halfway(wo: Any, wi: Any) -> tuple[Any, Any]:
    """The halfway directions (n, 3), and of each the cosine to wo."""
    h = wo + wi
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    return h, np.sum(h * wo, axis=1)


def facets(wo: Any, wi: Any, u: float, v: float) -> Any:
    """GGX without masking, over 4 cosines as blends of both (n, 1) [1/sr]."""
    h, _ = halfway(wo, wi)
    d = 1.0 / (np.pi * u * v * ((h[:, 0] / u) ** 2 + (h[:, 1] / v) ** 2 + h[:, 2] ** 2) ** 2)
    both = wo[:, 2] + wi[:, 2] - wo[:, 2] * wi[:, 2]
    return (d / (4.0 * np.maximum(both, 1e-3)))[:, None]


def velvet(wo: Any, wi: Any) -> Any:
    """Dark red, with fibres that shine where it is looked at flatly."""
    h, _ = halfway(wo, wi)
    upright = np.exp(-((h[:, 2] / np.sqrt(np.maximum(1.0 - h[:, 2] ** 2, 1e-4)) / 0.5) ** 2))
    both = wo[:, 2] + wi[:, 2] - wo[:, 2] * wi[:, 2]
    shine = upright / (4.0 * np.maximum(both, 1e-2))
    return np.array((0.12, 0.006, 0.012)) / np.pi + shine[:, None] * np.array((0.5, 0.16, 0.17))


def bronze(wo: Any, wi: Any) -> Any:
    """Metal that is rougher around than along."""
    return facets(wo, wi, 0.12, 0.45) * np.array((0.75, 0.43, 0.2))


def pearl(wo: Any, wi: Any) -> Any:
    """A body of cream under a sheen whose colour turns with the angle between eye and light."""
    _, cosine = halfway(wo, wi)
    turn = 2.0 * np.pi * (2.2 * cosine[:, None] + np.array((0.0, 0.33, 0.67)))
    body = np.array((0.5, 0.45, 0.38)) / np.pi
    return body + facets(wo, wi, 0.3, 0.3) * (0.22 + 0.18 * np.cos(turn))


def lacquer(wo: Any, wi: Any) -> Any:
    """A red body under a clear coat."""
    _, cosine = halfway(wo, wi)
    fresnel = 0.04 + 0.96 * (1.0 - cosine[:, None]) ** 5
    return np.array((0.5, 0.04, 0.02)) / np.pi + fresnel * facets(wo, wi, 0.06, 0.06)


def chrome(wo: Any, wi: Any) -> Any:
    return facets(wo, wi, 0.05, 0.05) * np.array((0.55, 0.56, 0.57))


def velour(wo: Any, wi: Any) -> Any:
    """The velvet in blue."""
    return velvet(wo, wi)[:, ::-1]


def measured_from(f: Callable[[Any, Any], Any]) -> Measured:
    quarter = np.linspace(-np.pi, -np.pi / 2.0, 5)
    viewers = {"phi_i": quarter} if f is bronze else {}
    return Measured(data=measured.fit(f, normals=48, **viewers))


def studs() -> textures.Bitmap:
    """A normal map: eight by five round studs."""
    y, x = (np.mgrid[0:64, 0:64] + 0.5) / 32.0 - 1.0
    inside = x**2 + y**2 < 0.64
    nx, ny = np.where(inside, x, 0.0), np.where(inside, -y, 0.0)
    normal = np.stack([nx, ny, np.sqrt(1.0 - nx**2 - ny**2)], -1)
    image = (normal / 2.0 + 0.5).astype(np.float32)
    return textures.Bitmap(image=image, raw=True, to_uv=np.diag([12.0, 9.0, 1.0]))


def dye() -> dict[str, Any]:
    """A dye that takes in blue and gives out orange."""
    lambdas = np.arange(380.0, 760.0, 10.0)
    taken = 0.8 / (1.0 + np.exp((lambdas - 520.0) / 9.0))
    kept = 0.05 + 0.75 / (1.0 + np.exp((585.0 - lambdas) / 9.0))
    given = np.exp(-(((lambdas - 600.0) / 28.0) ** 2))
    made = spectra.Fluorophore(
        spectra.Tabulated(lambdas, taken), spectra.Tabulated(lambdas, given), 0.95
    )
    return {"reflectance": spectra.Tabulated(lambdas, kept), "reradiation": made}


def strips() -> Shapes:
    """Long, narrow lamps, for colours that are not washed out."""
    return [
        shapes.Rectangle(
            to_world=look_at(origin, [0, 0.6, 0], up) @ scale([0.14, 1.6, 1.0]),
            material=BLACK,
            emission=lights.Area(radiance=(9.0, 9.0, 9.0)),
        )
        for origin, up in (
            ([-1.0, 5.2, 3.2], [0, 1, -1]),
            ([2.2, 4.6, 4.0], [1, 1, 0]),
            ([-4.6, 2.6, 4.6], [0, 1, 0]),
            ([4.8, 1.8, 4.6], [0.3, 1, 0]),
        )
    ]


def blue_lamp() -> Shapes:
    return [panel(3.0, [-2.4, 4.6, 4.0], [0, 0.5, 0], spectra.LED(450.0, 22.0, 20.0))]


CHECKS = np.diag([10.0, 8.0, 1.0])
HOLES = textures.Checkerboard(color0=0.0, color1=1.0, to_uv=CHECKS)
DEEP = integrators.Path(max_depth=14, rr_depth=8)
TWO = partial(TwoSided, front=Diffuse(reflectance=ORANGE))

MATERIALS = {
    "diffuse": three("Three colours.", *each(Diffuse, "reflectance", (RED, CREAM, BLUE))),
    "oren_nayar": three(
        "`sigma` 0, 20 and 60 degrees.",
        *each(OrenNayar, "sigma", (0.0, 20.0, 60.0), reflectance=CREAM),
    ),
    "phong": three(
        "`exponent` 10, 60 and 600.",
        *each(Phong, "exponent", (10.0, 60.0, 600.0), diffuse=GREEN, specular=0.3),
    ),
    "ward": three(
        "`alpha_u` 0.05, 0.15 and 0.4.",
        *each(Ward, "alpha_u", (0.05, 0.15, 0.4), diffuse=GREEN, specular=0.3),
    ),
    "ashikhmin_shirley": three(
        "`specular` 0.05, 0.2 and 0.6.",
        *each(AshikhminShirley, "specular", (0.05, 0.2, 0.6), diffuse=RED),
    ),
    "dielectric": three(
        "`int_ior` 1.33 (water), 1.5 (glass) and 2.42 (diamond).",
        *each(Dielectric, "int_ior", (1.33, 1.5, 2.42)),
        spp=160,
        integrator=DEEP,
    ),
    "thin_dielectric": three(
        "`int_ior` 1.2, 1.5 and 2.4: empty shells.",
        *each(ThinDielectric, "int_ior", (1.2, 1.5, 2.4)),
        spp=64,
        denoise="oidn",
        integrator=DEEP,
    ),
    "rough_dielectric": three(
        "`alpha_u` and `alpha_v` 0.03, 0.12 and 0.4.",
        *rough(RoughDielectric, 0.03, 0.12, 0.4, int_ior=1.5),
        spp=64,
        denoise="oidn",
        integrator=DEEP,
    ),
    "conductor": three(
        "Silver, gold and copper: measured `eta` and `k`.",
        *(Conductor(**metal(name)) for name in ("Ag", "Au", "Cu")),
    ),
    "rough_conductor": three(
        "Copper with `alpha_u` 0.05, 0.2 and 0.5; `alpha_v` is the same.",
        *rough(RoughConductor, 0.05, 0.2, 0.5, **metal("Cu")),
    ),
    "plastic": three(
        "Three colours of `diffuse_reflectance` under one clear coat.",
        *each(Plastic, "diffuse_reflectance", (RED, CREAM, BLUE)),
    ),
    "rough_plastic": three(
        "`alpha` 0.05, 0.2 and 0.5.",
        *each(RoughPlastic, "alpha", (0.05, 0.2, 0.5), diffuse_reflectance=BLUE),
    ),
    "coated_conductor": three(
        "Rough gold under a coat with `coat_alpha` 0.01, 0.1 and 0.4.",
        *each(CoatedConductor, "coat_alpha", (0.01, 0.1, 0.4), **metal("Au"), alpha_u=0.35,
              alpha_v=0.35),
    ),
    "principled": three(
        "`clearcoat` 1; `metallic` 1; `spec_trans` 1.",
        Principled(base_color=RED, roughness=0.7, clearcoat=1.0, clearcoat_gloss=0.95),
        Principled(base_color=(0.9, 0.65, 0.35), roughness=0.35, metallic=1.0),
        Principled(base_color=(0.55, 0.85, 0.8), roughness=0.25, spec_trans=1.0),
    ),
    "principled_thin": three(
        "Shades around a lamp: `diff_trans` 0.4 and 1.4; `spec_trans` 0.9.",
        PrincipledThin(base_color=PAPER, diff_trans=0.4),
        PrincipledThin(base_color=PAPER, diff_trans=1.4),
        PrincipledThin(base_color=PAPER, spec_trans=0.9, roughness=0.4),
        thing=lantern,
        dim=0.25,
        spp=224,
    ),
    "diffuse_transmission": three(
        "Shades around a lamp: `transmittance` 0.1, 0.3 and 0.6.",
        *(
            DiffuseTransmission(transmittance=tuple(t * c for c in PAPER), reflectance=0.3)
            for t in (0.1, 0.3, 0.6)
        ),
        thing=lantern,
        dim=0.25,
    ),
    "gltf_surface": three(
        "`clearcoat` 1 on metallic paint; `sheen_color` of cloth; `iridescence` 1.",
        GltfSurface(base_color=BLUE, metallic=0.6, roughness=0.6, clearcoat=1.0),
        GltfSurface(base_color=(0.2, 0.02, 0.04), sheen_color=(0.9, 0.4, 0.4), sheen_roughness=0.4),
        GltfSurface(base_color=0.3, metallic=1.0, roughness=0.25, iridescence=1.0),
        mode="spectral",
    ),
    "openpbr": three(
        "Lacquer with `coat_color` and `coat_darkening`; `fuzz_weight` 1; `thin_film_weight` 1 on"
        " metal.",
        Openpbr(base_color=(0.5, 0.27, 0.12), coat_weight=1.0, coat_color=(0.95, 0.6, 0.3)),
        Openpbr(base_color=(0.02, 0.05, 0.2), specular_weight=0.0, fuzz_weight=1.0,
                fuzz_color=(0.6, 0.7, 1.0)),
        Openpbr(base_color=0.4, base_metalness=1.0, specular_roughness=0.25, thin_film_weight=1.0,
                thin_film_thickness=0.35),
        mode="spectral",
    ),
    "grating": three(
        "Aluminium disks with a `period` of 800, 1600 and 3200 nm.",
        *each(Grating, "period", (800.0, 1600.0, 3200.0), profile="lamellar", **metal("Al")),
        thing=disc,
        spp=160,
        mode="spectral",
        lamps=strips(),
        dim=0.3,
    ),
    "fluorescent": three(
        "Under a blue lamp: `amount` 0, 0.4 and 1 of a dye that gives out orange.",
        *each(Fluorescent, "amount", (0.0, 0.4, 1.0), **dye()),
        mode="spectral",
        lamps=blue_lamp(),
        dim=0.05,
    ),
    "hair": three(
        "`sigma_a` of blond, red and black hair.",
        *each(Hair, "sigma_a", (pigment(0.2, 0.1), pigment(0.1, 1.2), pigment(3.0, 0.2))),
        thing=tress,
        spp=24,
        denoise="oidn",
        size=LARGE,
        integrator=DEEP,
    ),
    "measured": three(
        "Velvet, brushed bronze and pearl, each measured from a formula by `clpt.measured.fit`.",
        *map(measured_from, (velvet, bronze, pearl)),
    ),
    "merl": three(
        "Lacquer, chrome and blue cloth, tables made from formulas by `clpt.measured.tabulate`.",
        *(Merl(data=measured.tabulate(f, (90, 45, 60))) for f in (lacquer, chrome, velour)),
    ),
    "null": three(
        "Between two knobs stands one of `null`: no surface, no shadow.",
        Diffuse(reflectance=RED), Null(), Diffuse(reflectance=BLUE),
    ),
    "two_sided": three(
        "A bowl of `diffuse`, black within; of `two_sided`; with a `back` of its own.",
        Diffuse(reflectance=ORANGE), TWO(), TWO(back=Diffuse(reflectance=(0.1, 0.5, 0.55))),
        thing=bowl,
    ),
    "mask": three(
        "`opacity` 0.3, 0.7 and a texture.",
        *each(Mask, "opacity", (0.3, 0.7, HOLES), material=TWO()),
    ),
    "blend": three(
        "Of red plastic and gold: `weight` 0.3, 0.7 and a texture.",
        *each(Blend, "weight", (0.3, 0.7, HOLES),
              first=RoughPlastic(diffuse_reflectance=RED),
              second=RoughConductor(**metal("Au"), alpha_u=0.15, alpha_v=0.15)),
    ),
    "normal_map": three(
        "`scale` 0.3, 0.7 and 1 on a map of round studs.",
        *each(NormalMap, "scale", (0.3, 0.7, 1.0), map=studs(), along_v=True,
              material=RoughPlastic(diffuse_reflectance=GREEN)),
    ),
    "bump_map": three(
        "`scale` 0.01, 0.03 and 0.06 on a `height` of noise.",
        *each(BumpMap, "scale", (0.01, 0.03, 0.06),
              height=textures.Noise(pattern="wrinkled", octaves=3, to_texture=scale(7.0)),
              material=RoughPlastic(diffuse_reflectance=ORANGE)),
    ),
}  # fmt: skip
