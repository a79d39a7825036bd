"""What Mitsuba takes as it is and clpt bends: the value that counts, and one warning of it."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt.formats import load
from clpt.scene import materials, shapes, textures
from clpt.spectra import Constant, RGBUnbounded

METAL = 'type="{}"><string name="material" value="{}"/>'


@pytest.fixture
def read(tmp_path):
    """Load what stands inside <scene>, with a sensor."""

    def of(body: str):
        path = tmp_path / "scene.xml"
        sensor = '<sensor type="perspective"/>'
        path.write_text(f'<scene version="3.0.0">{body}{sensor}</scene>', "utf-8")
        return load(path)

    return of


def material(read, xml: str):
    """A material and the warnings about it."""
    made = read(f'<shape type="sphere"><bsdf {xml}</bsdf></shape>')
    return made.shapes[0].material, made.warnings


def test_values_beyond_limits_are_clamped_with_one_warning(read):
    for value, meant in ((2.0, 1.0), (-1.0, 0.0)):
        made, warnings = material(
            read, f'type="diffuse"><float name="reflectance" value="{value}"/>'
        )
        assert made.reflectance == Constant(meant)
        assert len(warnings) == 1 and "reflectance is outside 0 to 1" in warnings[0]
    made, warnings = material(
        read, 'type="diffuse"><spectrum name="reflectance" value="400:-1, 500:0.5, 700:2"/>'
    )
    assert made.reflectance.values == (0.0, 0.5, 1.0) and len(warnings) == 1
    made, warnings = material(
        read,
        'type="principled"><float name="metallic" value="2"/>'
        '<rgb name="base_color" value="-0.1, 0.5, 1.5"/>',
    )
    assert made.metallic == 1.0 and len(warnings) == 2
    assert (made.base_color.r, made.base_color.g, made.base_color.b) == (0.0, 0.5, 1.0)
    made = read('<emitter type="constant"><rgb name="radiance" value="-1, 2, 3"/></emitter>')
    assert tuple(made.lights[0].radiance.to_rgb()) == (0.0, 2.0, 3.0) and len(made.warnings) == 1


def test_what_lies_within_limits_is_not_warned_of(read):
    made, warnings = material(
        read,
        'type="roughconductor"><rgb name="eta" value="0, 1, 2"/><float name="k" value="3"/>'
        '<float name="alpha" value="0"/>',
    )
    assert made.alpha_u == 1e-4 and not warnings


def test_a_negative_index_of_a_metal_counts_by_its_size(read):
    """Fresnel's equations of a conductor hold the squares of eta and k only."""
    made, warnings = material(
        read,
        'type="roughconductor"><rgb name="eta" value="-0.01, 0.5, 1"/>'
        '<spectrum name="k" value="400:-3, 700:4"/>',
    )
    assert made.eta == RGBUnbounded(0.01, 0.5, 1.0)
    assert made.k.values == (3.0, 4.0)
    assert len(warnings) == 2 and "its size counts" in warnings[0]


def test_textures_are_made_of_any_numbers(read):
    made, warnings = material(
        read,
        'type="diffuse"><texture name="reflectance" type="checkerboard">'
        '<float name="color0" value="-3"/><rgb name="color1" value="2, 0.5, 0"/></texture>',
    )
    assert made.reflectance.color0 == Constant(-3.0) and not warnings
    assert made.reflectance.color1 == RGBUnbounded(2.0, 0.5, 0.0)


def test_raw_constants_are_numbers_and_colours(read):
    three = '<vector name="value" value="0.25, 0.5, 1"/></texture>'
    one = '<float name="value" value="0.25"/></texture>'
    made, _ = material(
        read, f'type="diffuse"><texture name="reflectance" type="rawconstant">{three}'
    )
    assert made.reflectance.to_rgb().tolist() == [0.25, 0.5, 1.0]
    made, _ = material(read, f'type="roughplastic"><texture name="alpha" type="rawconstant">{one}')
    assert made.alpha == 0.25
    nested = f'<texture name="normalmap" type="rawconstant">{three}<bsdf type="diffuse"/>'
    made, _ = material(read, f'type="normalmap">{nested}')
    assert isinstance(made.map, textures.Bitmap) and made.map.raw
    np.testing.assert_array_equal(made.map.image, np.float32([[[0.25, 0.5, 1.0]]]))


def test_metals_have_all_of_mitsubas_names(read):
    """Those that reflect as its own, which tell themselves; the others are grey."""
    names = (
        "a-C Ag Al AlAs AlSb Au Be Cr CsI Cu Cu_palik d-C d-C_palik Hg Ir K Li_palik MgO Mo none"
    )
    names += " Te_palik Te-e Na_palik Nb Ni_palik Rh SiC ThF4 TiC TiN TiO2 TiO2-e VC V_palik VN W"
    for name in names.split():
        made, warnings = material(read, METAL.format("conductor", name))
        assert made.eta == spectra.metal(name)[0] and not warnings, name
    for name in ["Cu2O", "CuO_palik", "HgTe", "Se", "Se-e", "SnTe", "Ta"]:
        made, warnings = material(read, METAL.format("conductor", name))
        assert len(warnings) == 1 and "a grey metal" in warnings[0], name
        k = made.k.value
        np.testing.assert_allclose(k**2 / (4.0 + k**2), 0.3)  # Fresnel's equations, eta = 1


def test_what_polarises_dims_unpolarised_light(read):
    for name, share in (("polarizer", 0.5), ("circular", 0.5), ("retarder", 1.0)):
        made, warnings = material(
            read, f'type="{name}"><rgb name="transmittance" value="0.2, 0.4, 0.8"/>'
        )
        assert isinstance(made, materials.ThinDielectric) and len(warnings) == 1
        np.testing.assert_allclose(
            made.specular_transmittance.to_rgb(), share * np.array([0.2, 0.4, 0.8])
        )
        assert made.int_ior == made.ext_ior == Constant(1.0)
    made, warnings = material(read, 'type="pplastic"><float name="alpha" value="0.3"/>')
    assert isinstance(made, materials.RoughPlastic) and made.alpha == 0.3 and len(warnings) == 1


def test_a_stretched_sphere_stays_round_and_a_stretched_cylinder_does_not(read):
    stretch = '<transform name="to_world"><scale x="2" z="3"/><translate y="1"/></transform>'
    made = read(f'<shape type="sphere"><point name="center" x="1"/>{stretch}</shape>')
    (ball,) = made.shapes
    assert ball.radius == pytest.approx(2.0)
    np.testing.assert_allclose((ball.to_world @ [*ball.center, 1.0])[:3], [2.0, 1.0, 0.0])
    assert len(made.warnings) == 1 and "stays round" in made.warnings[0]
    made = read(f'<shape type="cylinder" id="tube">{stretch}</shape>')
    (tube,) = made.shapes
    assert isinstance(tube, shapes.Instance) and tube.name == "tube"
    np.testing.assert_allclose(np.diag(tube.to_world), [2.0, 1.0, 3.0, 1.0])


def test_light_of_a_texture_under_d65(read, tmp_path):
    (tmp_path / "t.png").write_bytes(b"")
    inner = '<texture type="bitmap" name="any"><string name="filename" value="t.png"/></texture>'
    spectrum = (
        f'<spectrum type="d65" name="radiance">{inner}<float name="scale" value="2"/></spectrum>'
    )
    made = read(f'<shape type="cube"><emitter type="area">{spectrum}</emitter></shape>')
    light = made.shapes[0].emission.radiance
    assert isinstance(light.first, textures.Bitmap) and light.second == Constant(2.0)


def test_text_between_elements_and_the_integrator_of_distances(read):
    made = read('stray <integrator type="depth"/>')
    assert made.film.layers == ("depth",)


FLATTENED = '<transform name="to_world"><scale x="2" y="{}" z="0"/></transform>'
FLAT_KINDS = ("rectangle", "disk", "cube", "cylinder")


@pytest.mark.parametrize("kind", FLAT_KINDS)
def test_a_flattened_shape_is_flat(read, kind):
    made = read(f'<shape type="{kind}">{FLATTENED.format(3)}</shape>')
    assert len(made.warnings) == 1 and "flattens" in made.warnings[0]
    sizes = np.linalg.svd(made.shapes[0].to_world[:3, :3])[1]
    assert sizes == pytest.approx([3, 2, 3e-5])


@pytest.mark.parametrize("kind", (*FLAT_KINDS, "sphere"))
def test_a_shape_that_becomes_a_line_is_left_out(read, kind):
    shape = f'<shape type="{kind}">{FLATTENED.format(0)}</shape>'
    for body in (shape, f'<shape type="merge">{shape}</shape>'):
        made = read(body)
        assert not made.shapes and len(made.warnings) == 1
        assert "nothing is left of the shape" in made.warnings[0]
    made = read(f'<shape type="shapegroup" id="g">{shape}<shape type="cube"/></shape>'
                '<shape type="instance"><ref id="g"/></shape>')  # fmt: skip
    assert len(made.shapes[0].group.shapes) == 1


def test_a_flattened_sphere_stays_round_as_in_mitsuba(read):
    made = read(f'<shape type="sphere">{FLATTENED.format(3)}</shape>').shapes[0]
    assert made.radius == pytest.approx(2.0)


def test_no_depth_counts_as_one(read):
    made = read('<integrator type="path"><integer name="max_depth" value="0"/></integrator>')
    assert made.integrator.max_depth == 1 and "max_depth of 0" in made.warnings[0]
