"""A good material passes the checks that authors have, and each fault is found and named."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import clpt
from clpt import device, testing
from clpt.scene import materials, textures
from clpt.scene.params import real, reflectance


@dataclass(frozen=True, kw_only=True, eq=False)
class Chalk(materials.Material):
    """Lambertian reflection that a power of the cosines dims; `dust` takes some of it away."""

    colour: Any = reflectance(0.5, "albedo")
    dust: Any = real(0.5, "how dark the edges are", low=0.0, high=4.0, textured=True)

    source = """
    real chalk_pdf(Chalk m, vec3 wo, vec3 wi)
    {
        return sel(wo.z > 0.0f, cosine_hemisphere_pdf(wi.z), (real)(0.0f));
    }
    Spectrum chalk_eval(Chalk m, vec3 wo, vec3 wi)
    {
        real edge = pow_r(max_r(wo.z, (real)(0.0f)) * max_r(wi.z, (real)(0.0f)), m.dust);
        return spectrum_scale(m.colour, edge * chalk_pdf(m, wo, wi));
    }
    BsdfSample chalk_sample(Chalk m, vec3 wo, vec3 u)
    {
        BsdfSample s = bsdf_nothing();
        vec2 uv = {u.x, u.y};
        s.wi = cosine_hemisphere(uv);
        s.pdf = chalk_pdf(m, wo, s.wi);
        s.weight = spectrum_scale(m.colour, pow_r(max_r(wo.z, (real)(0.0f)) * s.wi.z, m.dust));
        return s;
    }
    Spectrum chalk_albedo(Chalk m) { return m.colour; }
    """


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


def test_a_good_one_passes(on: device.Device) -> None:
    testing.check_material(Chalk, device=on, modes=("spectral",))


BOARD = textures.Checkerboard()  # textures are drawn
FAULTS = {
    "weight is not eval": ("s.wi.z, m.dust)", "s.wi.z, m.dust + 0.1f)"),
    "sample's pdf is not pdf": ("s.pdf = ", "s.pdf = 1.1f * "),
    "sample does not follow pdf": ("{u.x, u.y}", "{u.x * u.x, u.y}"),
    r"pdf integrates to 1\.5": ("wo.z > 0.0f, cosine", "wo.z > 0.0f, 1.5f * cosine"),
    "LOBE_TRANSMIT is not": ("s.weight = ", "s.wi.z = -s.wi.z; s.weight = "),
    "set uses_lobe_sample = True": ("{u.x, u.y}", "{u.x, u.z}"),
    "set disperses = True": ("s.weight = ", "s.lobe |= LOBE_DISPERSE; s.weight = "),
    "too much energy": ("spectrum_scale(m.colour, ", "spectrum_scale(m.colour, 2.0f * "),
    r"f\(wo, wi\) is not f\(wi, wo\)": ("max_r(wo.z, (real)(0.0f)) * ", ""),
    "eval is not finite": ("real edge =", "real edge = 0.0f / wo.z +"),
}


NAP = (
    """
    inline real edge_of(Chalk m, vec3 w) { real x = sqrt_r(m.dust) * w.x; return 1.0f - x * x; }
    real chalk_pdf(""",
    "edge * chalk_pdf",
    "pow_r(max_r(wo.z, (real)(0.0f)) * s.wi.z, m.dust)",
)


def nap(**attributes: Any) -> type[materials.Material]:
    """A cloth whose fibres lie along the tangent: it turns with the surface's u."""
    head, edge, power = NAP
    source = Chalk.source.replace("real chalk_pdf(", head, 1)
    source = source.replace(edge, "edge_of(m, wo) * edge_of(m, wi) * chalk_pdf")
    source = source.replace(power, "edge_of(m, wo) * edge_of(m, s.wi)")
    dust = real(0.5, "how dark it is along the fibres", low=0.0, high=1.0)
    annotations = {"dust": Any}
    body = {"source": source, "dust": dust, "__annotations__": annotations, **attributes}
    return dataclass(frozen=True, kw_only=True, eq=False)(type("Chalk", (Chalk,), body))


@pytest.mark.parametrize("name", ["turns", "uses_tangents"])
def test_a_material_that_turns_with_its_tangents_says_so(name: str, on: device.Device) -> None:
    """Only `uses_tangents` is read; another name for it says nothing."""
    cls = nap(**{name: property(lambda self: True)})
    if name == "uses_tangents":
        testing.check_material(cls, device=on, modes=("rgb",))
    else:
        with pytest.raises(AssertionError, match="define `uses_tangents`"):
            testing.check_material(cls, device=on, modes=("rgb",))


def test_it_says_so_for_the_numbers_that_need_it(on: device.Device) -> None:
    """A property that answers True for some parameters must answer so for all that turn."""
    right, wrong = (
        nap(uses_tangents=property(answer))
        for answer in (lambda self: self.dust != 0.0, lambda self: self.dust > 1.0)
    )
    testing.check_material(right, device=on, modes=("rgb",))
    with pytest.raises(AssertionError, match="define `uses_tangents`"):
        testing.check_material(wrong(dust=0.7), device=on, modes=("rgb",))
    testing.check_material(wrong(dust=0.0), device=on, modes=("rgb",))


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named(fault: str, on: device.Device) -> None:
    cls = type("Chalk", (Chalk,), {"source": Chalk.source.replace(*FAULTS[fault])})
    with pytest.raises(AssertionError, match=fault):
        testing.check_material(cls(colour=BOARD, dust=0.5), device=on, modes=("rgb",))


def test_what_is_no_kind_is_refused() -> None:
    bare = type("Bare", (materials.Material,), {})
    with pytest.raises(clpt.SceneError, match="no `source`"):
        testing.check_material(bare)


def test_the_page_names_attributes_that_a_material_has() -> None:
    """An attribute that nothing reads would be set in vain."""
    page = (Path(__file__).parents[2] / "docs" / "custom_materials.md").read_text("utf-8")
    table = page.partition("| attribute | set it if |")[2].partition("\n\n")[0]
    names = re.findall(r"^\| `(\w+)", table, re.MULTILINE)
    assert "uses_tangents" in names
    assert [name for name in names if not hasattr(materials.Material, name)] == []
