"""Materials of PBRT files as materials of ours."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

from clpt import spectra
from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.pbrt import scattering
from clpt.formats.pbrt.materials import MAKERS, material
from clpt.formats.pbrt.scattering import body
from clpt.formats.pbrt.state import Definition
from clpt.scene import materials
from clpt.scene.materials import TwoSided
from clpt.scene.textures import Checkerboard, Product
from tests.formats.pbrt.directives import define, params, state


def make(kind, at=None, **given):
    at = at or state()
    made = material(kind, params(**given), at)
    return made.front if isinstance(made, TwoSided) else made


def constant(spectrum):
    return float(spectrum.sample(550.0))


def test_defaults():
    """Every kind that stands by itself is made without parameters, seen from both sides."""
    one_sided = {"diffuse", "coateddiffuse", "conductor", "coatedconductor", "subsurface"}
    for kind in MAKERS.keys() - {"mix", "measured"}:
        made = material(kind, params(), state(), "label")
        assert isinstance(made, TwoSided) == (kind in one_sided), kind
        assert made.name == "label"
    assert constant(make("diffuse").reflectance) == 0.5
    glass = make("dielectric")
    assert (constant(glass.int_ior), constant(glass.ext_ior)) == (1.5, 1.0)
    assert make("conductor").eta == spectra.metal("Cu")[0]
    assert isinstance(make("interface"), materials.Null)


@pytest.mark.parametrize(
    "given, u, v",
    [
        ({"roughness": ("float", 0.04)}, 0.2, 0.2),
        ({"roughness": ("float", 0.04), "remaproughness": ("bool", False)}, 0.04, 0.04),
        ({"roughness": ("float", 0.04), "vroughness": ("float", 0.25)}, 0.2, 0.5),
        ({"uroughness": ("float", 0.25)}, 0.5, 1e-4),
    ],
)
def test_roughness(given, u, v):
    made = make("conductor", **given)
    assert isinstance(made, materials.RoughConductor) and made.distribution == "ggx"
    assert (made.alpha_u, made.alpha_v) == pytest.approx((u, v))
    assert isinstance(make("dielectric", **given), materials.RoughDielectric)


def test_what_pbrt_takes_for_smooth_is_smooth():
    for value, smooth in ((0.0009, True), (0.0011, False)):
        given = {"roughness": ("float", value), "remaproughness": ("bool", False)}
        assert isinstance(make("conductor", **given), materials.Conductor) == smooth
        assert isinstance(make("dielectric", **given), materials.Dielectric) == smooth
        assert isinstance(make("coateddiffuse", **given), materials.Plastic) == smooth


def test_textured_roughness():
    at = state()
    define(at, "float", "t", "checkerboard", tex1=("float", 0.25), tex2=("float", 0.0))
    made = make("conductor", at, roughness=("texture", "t"))
    assert isinstance(made.alpha_u, Checkerboard) and made.alpha_u is made.alpha_v
    ends = [constant(made.alpha_u.color0), constant(made.alpha_u.color1)]
    assert ends == pytest.approx([0.5, 1e-4])


def test_reflectance_of_a_metal_at_normal_incidence():
    made = make("conductor", reflectance=("rgb", 0.9, 0.5, 0.1))
    eta, k = constant(made.eta), made.k.to_rgb("unbounded")
    assert ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2) == pytest.approx([0.9, 0.5, 0.1])


def test_textured_metals():
    at = state()
    define(at, "spectrum", "t", "checkerboard", tex1=("rgb", 0.5, 0.5, 0.5))
    for kind in ("conductor", "coatedconductor"):
        made = make(kind, at, reflectance=("texture", "t"))
        assert isinstance(made.k, Checkerboard) and constant(made.eta) == 1.0
        assert made.k.color0.to_rgb("unbounded") == pytest.approx(2.0)
    assert isinstance(make("conductor", at, k=("texture", "t")).k, Checkerboard)


def test_coated_conductor():
    made = make(
        "coatedconductor", conductor__eta=("spectrum", "metal-Ag-eta"),
        conductor__k=("spectrum", "metal-Ag-k"), interface__roughness=("float", 0.01),
        conductor__roughness=("float", 0.04), interface__eta=("float", 1.4),
    )  # fmt: skip
    assert (made.eta, made.k) == spectra.metal("Ag")
    assert constant(made.specular_reflectance) == pytest.approx(np.exp(-0.02 / 0.88), abs=2e-3)
    assert (made.coat_alpha, made.alpha_u, constant(made.coat_ior)) == pytest.approx(
        (0.1, 0.2, 1.4)
    )


def fresnel(cosine, eta):
    """Reflectance of light that meets a dielectric of relative index eta; exact, by Snell's law."""
    sin2 = (1 - cosine**2) / eta**2
    if sin2 >= 1:
        return 1.0
    inside = np.sqrt(1 - sin2)
    s = (cosine - eta * inside) / (cosine + eta * inside)
    p = (inside - eta * cosine) / (inside + eta * cosine)
    return 0.5 * (s * s + p * p)


def layered(r, eta, thickness, bounces=200):
    """Diffusely lit from inside the coat: what leaves at last, by following pass after pass."""
    even = 2.0  # per cosine: a Lambertian base's share is 2 cos

    def mean(function):
        edge = np.sqrt(1 - 1 / eta**2)
        return integrate.quad(lambda c: even * c * function(c), 0, 1, points=[edge], limit=200)[0]

    leaves = mean(lambda c: (1 - fresnel(c, 1 / eta)) * np.exp(-thickness / c))
    returns = mean(lambda c: fresnel(c, 1 / eta) * np.exp(-2 * thickness / c))
    return sum(leaves * (r * returns) ** n for n in range(bounces)) * r


@pytest.mark.parametrize("r", [0.05, 0.5, 0.95])
def test_a_base_under_a_coat_that_absorbs(r):
    """Without absorption, the changed base leaves what the base left with it, twice passed."""
    changed = scattering.under_coat(r, 1.5, 0.1)
    share = layered(1e-9, 1.5, 0.1) / layered(1e-9, 1.5, 0.0)  # what entering loses, as leaving
    assert layered(changed, 1.5, 0.0) == pytest.approx(share * layered(r, 1.5, 0.1), rel=2e-3)
    assert scattering.under_coat(r, 1.5, 0.0) == pytest.approx(r)


def test_coated_diffuse():
    made = make("coateddiffuse", reflectance=("rgb", 0.5, 0.5, 0.0), thickness=("float", 0.0))
    assert made.nonlinear and constant(made.int_ior) == 1.5
    assert made.diffuse_reflectance.to_rgb() == pytest.approx([0.5, 0.5, 0.0])
    darker = make("coateddiffuse", reflectance=("rgb", 0.5, 0.5, 0.0))
    assert darker.diffuse_reflectance.to_rgb() == pytest.approx([0.485, 0.485, 0.0], abs=5e-3)


@pytest.mark.parametrize("single", [0.3, 0.9, 0.99])
def test_albedo_of_a_half_space(single):
    """By the H-function of isotropic scattering (Chandrasekhar 1960, chapter V), iterated."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    mu, weights = 0.5 + 0.5 * nodes, 0.5 * weights
    h, kernel = np.ones_like(mu), weights * mu / (mu[:, None] + mu)
    for _ in range(500):
        h = 1.0 / (np.sqrt(1.0 - single) + 0.5 * single * kernel @ h)
    wanted = 1.0 - 2.0 * np.sqrt(1.0 - single) * (weights * mu) @ h
    assert scattering.body_albedo(single, 1.0 - single, 0.0) == pytest.approx(wanted, abs=3e-3)


def test_scattering_bodies():
    """Wax by its reflectance, and a conservative medium, which sends everything back."""
    made = make("subsurface", reflectance=("rgb", 1, 0.5, 0))
    inside = 1 - layered(1e-9, 1.33, 0.0) / 1e-9
    wanted = np.array([1, 0.5, 0]) / (1 - inside * (1 - np.array([1, 0.5, 0])))
    assert made.diffuse_reflectance.to_rgb() == pytest.approx(wanted, rel=1e-3)
    white = make("subsurface", sigma_a=("rgb", 0, 0, 0), sigma_s=("rgb", 1, 2, 3))
    assert white.diffuse_reflectance.to_rgb() == pytest.approx([1, 1, 1])
    at = state()
    make("subsurface", at, name=("string", "Skin1"))
    assert "where it entered" in at.shared.warnings[0]


FORMS = {
    "name": ({"name": ("string", "Merlot")}, (0.11632, 0.25191, 0.29434), (2.1129e-05, 0.0, 0.0)),
    "coefficients": (
        {"sigma_a": ("rgb", 1, 2, 3), "sigma_s": ("rgb", 4, 5, 6), "scale": ("float", 2)},
        (2, 4, 6),
        (8, 10, 12),
    ),
    "default": ({}, (0.0011, 0.0024, 0.014), (2.55, 3.21, 3.77)),
}


@pytest.mark.parametrize("form", FORMS)
def test_light_walks_in_bodies(form):
    given, absorbs, scatters = FORMS[form]
    at = state()
    at.shared.walks = True
    boundary = make("subsurface", at, **given)
    assert isinstance(boundary, materials.Dielectric) and constant(boundary.int_ior) == 1.33
    assert not at.shared.warnings
    a, s = body(params(**given), at).coefficients(spectral=False)
    assert a.to_rgb("unbounded") == pytest.approx(absorbs)
    assert s.to_rgb("unbounded") == pytest.approx(scatters)


def test_bodies_by_their_reflectance():
    """The single albedo looks as asked for, under the boundary; mfp and scale are its length."""
    at = state()
    at.shared.walks = True
    given = {"reflectance": ("rgb", 0.9, 0.5, 0.1), "mfp": ("float", 2), "g": ("float", 0.3)}
    a, s = body(params(**given, scale=("float", 2)), at).coefficients(spectral=False)
    a, s = a.to_rgb("unbounded"), s.to_rgb("unbounded")
    assert a + s == pytest.approx([0.25] * 3)
    looks = scattering.body_albedo(s, a, 0.3)
    wanted = scattering.from_body_reflectance(np.array([0.9, 0.5, 0.1]), 1.33)
    assert looks == pytest.approx(wanted, abs=1e-6)
    assert isinstance(
        make("subsurface", at, roughness=("float", 0.3), **given), materials.RoughDielectric
    )


BODIES = """
MakeNamedMaterial "wax" "string type" "subsurface" "string name" "Skin1" "float scale" 1000
NamedMaterial "wax"
Shape "sphere"
Shape "disk"
Material "subsurface" "rgb sigma_a" [ 1 2 3 ] "rgb sigma_s" [ 4 5 6 ]
Shape "sphere"
Material "diffuse"
Shape "sphere"
"""


@pytest.mark.parametrize(("lamp", "walks"), [("infinite", True), ("point", False)])
def test_files_with_bodies(tmp_path, lamp, walks):
    """Shapes of one material share its medium; a small lamp would not be found through glass."""
    file = tmp_path / "wax.pbrt"
    file.write_text(f'WorldBegin\nLightSource "{lamp}"\n{BODIES}')
    scene = load(file)
    wax, disk, other, stone = (shape.interior for shape in scene.shapes)
    assert (wax is not None) == walks and wax is disk and stone is None
    if walks:
        assert wax.coefficients(spectral=False)[1].to_rgb("unbounded") == pytest.approx(
            (740, 880, 1010)
        )
        assert other.coefficients(spectral=False)[0].to_rgb("unbounded") == pytest.approx((1, 2, 3))
    surface = materials.Dielectric if walks else materials.Plastic
    made = [getattr(shape.material, "front", shape.material) for shape in scene.shapes]
    assert [isinstance(one, surface) for one in made] == [True] * 3 + [False]
    assert any("where it entered" in text for text in scene.warnings) != walks


def test_47_measured_media():
    assert len(scattering.MEDIA) == 47
    assert scattering.MEDIA["Pacific Ocean Surface Water"][1][0] == 0.031845


def test_scale_of_a_leaf():
    at = state()
    define(at, "spectrum", "t", "checkerboard")
    made = make("diffusetransmission", at, reflectance=("texture", "t"), scale=("float", 0.5))
    assert isinstance(made.reflectance, Product)
    assert constant(made.transmittance) == 0.125


def test_mixtures_nest():
    at = state()
    for name, kind, given in (
        ("red", "diffuse", {"reflectance": ("rgb", 1, 0, 0)}),
        ("glass", "dielectric", {}),
        ("inner", "mix", {"materials": ("string", "red", "glass"), "amount": ("float", 0.25)}),
    ):
        at.shared.materials[name] = [(0, Definition(kind, params(**given), at))]
    made = make("mix", at, materials=("string", "inner", "red"))
    assert isinstance(made, materials.Blend) and made.weight == 0.5
    assert made.first.weight == 0.25  # of the glass, which is the second
    assert isinstance(made.first.second, materials.Dielectric)
    assert made.first.first is made.second
    assert isinstance(made.second, materials.Diffuse) and "behind" in at.shared.warnings[0]
    at.shared.materials["grey"] = [(0, Definition("diffuse", params(), at))]
    opaque = make("mix", at, materials=("string", "grey", "red"))
    assert isinstance(opaque.first, TwoSided)


def test_relief(tmp_path):
    (tmp_path / "n.png").write_bytes(b"")
    at = state()
    define(at, "float", "t", "checkerboard")
    made = make("diffuse", at, displacement=("texture", "t"))
    assert isinstance(made, materials.BumpMap) and isinstance(made.height, Checkerboard)
    mapped = make("diffuse", at, normalmap=("string", str(tmp_path / "n.png")))
    assert isinstance(mapped, materials.NormalMap) and mapped.map.raw


@pytest.mark.parametrize(
    "kind, given, message",
    [
        ("matte", {}, "pbrt-v3, but the file is of version 4"),
        ("difuse", {}, "diffuse"),
        ("measured", {"filename": ("string", "a.bsdf")}, "a.bsdf"),
        ("mix", {"materials": ("string", "one")}, "two names"),
        ("mix", {"materials": ("string", "one", "two")}, "no material 'one'"),
        ("conductor", {"roughness": ("float", -1)}, "negative"),
        ("conductor", {"reflectance": ("float", 0.5), "k": ("float", 1)}, "either"),
        ("subsurface", {"sigma_a": ("rgb", 1, 1, 1)}, "together"),
        ("subsurface", {"name": ("string", "Skin")}, "Skin1"),
    ],
)
def test_what_is_no_material_is_told(kind, given, message):
    with pytest.raises(SceneError, match=message) as caught:
        make(kind, **given)
    assert caught.value.line == 1


def test_hair():
    brown = make("hair")
    red = make("hair", eumelanin=("float", 1.0), pheomelanin=("float", 2.0), alpha=("float", 3.0))
    assert brown.sigma_a.g == pytest.approx(1.3 * 0.697) and brown.eta == 1.55
    assert red.sigma_a.b == pytest.approx(1.37 + 2.1) and red.scale_tilt == 3.0
    grey = make("hair", reflectance=("rgb", 0.5, 0.5, 0.5), beta_n=("float", 0.3))
    fit = 5.969 - 0.0645 + 0.22788 - 0.28971 + 0.0451494 + 0.00059535
    assert grey.sigma_a.g == pytest.approx((np.log(0.5) / fit) ** 2)
    with pytest.raises(SceneError, match="one of"):
        make("hair", sigma_a=("float", 0.5), eumelanin=("float", 1.0))
