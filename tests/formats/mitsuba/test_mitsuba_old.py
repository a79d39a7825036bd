"""Files of Mitsuba 0.3 to 0.6: the version decides over words and defaults.

Expected values are those of Mitsuba 0.6's sources, which old_words.py and docs/mitsuba.md name.
"""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from clpt import spectra
from clpt.errors import SceneError
from clpt.formats import load
from clpt.formats.mitsuba import old_words, sensors
from clpt.formats.pbrt.scattering import EVEN, internal_fresnel, transmitted
from clpt.scene import integrators, lights, materials, textures
from clpt.scene.params import device_params, fields_of
from clpt.spectra import RGB, Blackbody, Constant, RGBIlluminant, RGBUnbounded
from tests.kernels.harness import Probe

QUOTED = '"reflectance"'
NAMES = sorted({old for _, old, *_ in old_words.PLUGINS})


def level(value) -> float:
    """A number that a material may hold as an even spectrum."""
    return value.value if isinstance(value, Constant) else value


@pytest.fixture
def read(tmp_path):
    """Load the content of a <scene> of a version."""

    def of(body: str, version: str = "0.6.0", **variables):
        path = tmp_path / "scene.xml"
        sensor = "" if "sensor" in body or "camera" in body else '<sensor type="perspective"/>'
        path.write_text(f'<scene version="{version}">{body}{sensor}</scene>', "utf-8")
        return load(path, **variables)

    return of


@pytest.fixture
def material(read):
    def of(bsdf: str, version: str = "0.6.0"):
        return read(f'<shape type="cube">{bsdf}</shape>', version).shapes[0].material

    return of


def test_a_light_of_one_number_is_a_multiple_of_d65(read):
    light = '<emitter type="constant"><spectrum name="radiance" value="2"/></emitter>'
    assert read(light).lights[0].radiance == RGBIlluminant(2.0, 2.0, 2.0)
    assert read(light, "3.0.0").lights[0].radiance == Constant(2.0)


@pytest.mark.parametrize("version", ["0.3.0", "0.5.1", "0.6.0", "2.1.0", "3.0.0"])
def test_the_border_of_a_medium_lets_light_through_in_old_files(read, version):
    medium = '<medium name="{}" type="homogeneous"><float name="sigmaT" value="1"/></medium>'
    for side in ("interior", "exterior"):
        shape = read(f'<shape type="cube">{medium.format(side)}</shape>', version).shapes[0]
        wanted = materials.Null if version.startswith("0") else materials.Diffuse
        assert type(shape.material) is wanted


def test_metals_are_copper_by_default(material):
    for kind in ("conductor", "roughconductor"):
        made = material(f'<bsdf type="{kind}"/>')
        copper = spectra.metal("Cu")
        grid = np.linspace(400.0, 700.0, 5)
        for value, wanted in ((made.eta, copper[0]), (made.k, copper[1])):
            assert np.allclose(value.sample(grid), wanted.sample(grid) / 1.000277, rtol=1e-4)
        assert material(f'<bsdf type="{kind}"/>', "3.0.0").eta == Constant(0.0)


def test_up_of_a_sky_is_y(read):
    sky = '<emitter type="sunsky"><vector name="sunDirection" x="{}" y="{}" z="{}"/></emitter>'
    assert read(sky.format(0, 1, 0)).lights[0].sun_elevation == pytest.approx(90.0)
    made = read(sky.format(1, 1, 0)).lights[0]
    assert (made.sun_elevation, made.sun_azimuth) == (pytest.approx(45.0), pytest.approx(90.0))
    assert level(made.ground) == 0.15 and np.allclose(made.to_world, np.eye(4))
    assert read(sky.format(0, 1, 0), "3.0.0").lights[0].sun_elevation == pytest.approx(0.0)


def test_the_sun_of_a_date(read):
    """By default it is 2010-07-10, 15:00 in Tokyo: direction (-.69176, .72030, .05138)."""
    made = read('<emitter type="sunsky"/>').lights[0]
    assert made.sun_elevation == pytest.approx(46.079, abs=1e-3)
    assert made.sun_azimuth == pytest.approx(np.degrees(np.arctan2(-0.69176, 0.05138)), abs=1e-2)
    noon = '<float name="hour" value="12"/><float name="latitude" value="0"/>'
    noon += '<float name="longitude" value="0"/><float name="timezone" value="0"/>'
    spring = '<integer name="month" value="3"/><integer name="day" value="20"/>'
    made = read(f'<emitter type="sky">{noon}{spring}</emitter>').lights[0]
    assert made.sun_elevation > 87.0 and (made.sky_scale, made.sun_scale) == (1.0, 0.0)
    made = read('<emitter type="sun"><float name="scale" value="3"/></emitter>').lights[0]
    assert (made.sky_scale, made.sun_scale) == (0.0, 3.0)
    with pytest.raises(SceneError, match="unknown emitter 'sky'"):
        read('<emitter type="sky"/>', "3.0.0")


def medium(read, inner: str, kind: str = "homogeneous", version: str = "0.6.0"):
    text = f'<shape type="cube"><medium name="interior" type="{kind}">{inner}</medium></shape>'
    scene = read(text, version)
    return scene.shapes[0].interior, scene.warnings


def test_coefficients_of_media(read):
    made, _ = medium(read, '<rgb name="sigmaA" value=".1,.2,.3"/><float name="scale" value="2"/>')
    assert tuple(made.sigma_a.to_rgb()) == pytest.approx((0.1, 0.2, 0.3)) and made.scale == 2.0
    made, warnings = medium(read, '<float name="scale" value="0.5"/>')
    assert made.sigma_s == RGBUnbounded(74.0, 88.0, 101.0) and made.scale == 0.5
    assert any("skin1" in text for text in warnings)
    made, _ = medium(read, '<string name="material" value="Whole milk"/>')
    assert made.sigma_s == RGBUnbounded(*(100.0 * x for x in (2.55, 3.21, 3.77)))
    with pytest.raises(SceneError, match="unknown medium 'ink'"):
        medium(read, '<string name="material" value="ink"/>')
    even = '<volume name="density" type="constvolume"><float name="value" value="0.1"/></volume>'
    made, _ = medium(read, even + '<string name="method" value="woodcock"/>', "heterogeneous")
    assert made.kind == "homogeneous" and made.sigma_t in (0.1, Constant(0.1))


def test_colours_in_their_three_forms(material):
    for text in ('spectrum {} value="0.2 0.4 0.6"', 'rgb {} value="#336699"'):
        made = material(f'<bsdf type="diffuse"><{text.format("name=" + QUOTED)}/></bsdf>')
        assert made.reflectance == RGB(0.2, 0.4, 0.6)
        with pytest.raises(SceneError):
            material(f'<bsdf type="diffuse"><{text.format("name=" + QUOTED)}/></bsdf>', "3.0.0")
    made = material(f'<bsdf type="diffuse"><srgb name={QUOTED} value="#808080"/></bsdf>')
    assert made.reflectance.to_rgb() == pytest.approx([0.2159] * 3, abs=1e-4)


def test_black_bodies(read):
    light = '<blackbody name="intensity" temperature="{}" scale="2"/>'
    for text in ("3000", "3000K", "3000 k"):
        made = read(f'<emitter type="point">{light.format(text)}</emitter>')
        assert made.lights[0].intensity == Blackbody(3000.0, 2.0)


def test_words_that_change_no_expected_picture_are_told_in_one_message(read):
    scene = read(
        '<integrator type="guided_path"><integer name="maxDepth" value="7"/>'
        '<string name="budgetType" value="spp"/><boolean name="strictNormals" value="true"/>'
        '</integrator><sensor type="perspective"><film type="ldrfilm"><float name="gamma" '
        'value="2.2"/></film><sampler type="sobol"><integer name="scramble" value="1"/></sampler>'
        '<integer name="ofAFork" value="1"/></sensor><mode value="x"/>'
        '<shape type="cube"><bsdf type="diffuse"><float name="alpha" value="1"/></bsdf></shape>'
    )
    assert isinstance(scene.integrator, integrators.Path) and scene.integrator.max_depth == 7
    (message,) = [text for text in scene.warnings if "of Mitsuba 0.6.0" in text]
    for word in ("guided_path", "budget_type", "strict_normals", "ldrfilm", "gamma", "scramble",
                 "of_afork", "<mode>", "alpha"):  # fmt: skip
        assert word in message, word
    assert len(scene.warnings) == 1


@pytest.mark.parametrize("name", NAMES)
def test_each_renamed_plugin_is_one_that_is_read(read, name):
    for tag, old, new, source in old_words.PLUGINS:
        if old != name:
            continue
        known = {"film": sensors.FILMS, "sampler": sensors.SAMPLERS,
                 "integrator": sensors.INTEGRATORS}.get(tag)  # fmt: skip
        assert source and (known is None or new in known)
        if tag in ("integrator", "bsdf"):
            read(f'<{tag} type="{old}"/>')
            with pytest.raises(SceneError, match="unknown"):
                read(f'<{tag} type="{old}"/>', "3.0.0")


def test_integrators_that_hold_another(read):
    inner = '<integrator type="direct"/>'
    for name in sensors.HOLDERS:
        made = read(f'<integrator type="{name}">{inner}</integrator>').integrator
        assert isinstance(made, integrators.Direct)
    for name in sensors.NO_LIGHT:
        with pytest.raises(SceneError, match="unknown integrator"):
            read(f'<integrator type="{name}"/>')


def test_an_id_that_is_given_again(read):
    bsdf = '<bsdf type="diffuse" id="m"><float name="reflectance" value="{}"/></bsdf>'
    use = '<shape type="cube"><ref id="m"/></shape>'
    scene = read(bsdf.format(0.25) + use + bsdf.format(0.75) + use)
    assert [level(shape.material.reflectance) for shape in scene.shapes] == [0.25, 0.75]
    assert any("given again" in text for text in scene.warnings)


def test_words_of_0_3(read):
    scene = read(
        '<camera type="perspective"><transform name="toWorld"><lookAt ox="0" oy="0" oz="4" tx="0" '
        'ty="0" tz="0" ux="0" uy="1" uz="0"/></transform></camera>'
        '<luminaire type="constant"><rgb name="intensity" value="3,3,3"/></luminaire>'
        '<shape type="cylinder"><point name="p1" x="0" y="0" z="1"/><point name="p2" x="0" y="0" '
        'z="5"/><bsdf type="lambertian"/></shape>',
        "0.3.0",
    )
    assert scene.camera.to_world[2, 3] == 4.0 and scene.lights[0].radiance.r == 3.0
    assert scene.shapes[0].p0 == (0.0, 0.0, 1.0) and scene.shapes[0].p1 == (0.0, 0.0, 5.0)


@pytest.fixture
def grey(tmp_path):
    Image.new("RGB", (2, 2), (128, 128, 128)).save(tmp_path / "grey.png")
    return '<string name="filename" value="grey.png"/>'


@pytest.mark.parametrize("version", ["0.6.0", "3.0.0"])
def test_gamma_of_texels(material, grey, version):
    for gamma in (-1.0, 1.0, 2.2, 1.8):
        inner = f'{grey}<float name="gamma" value="{gamma}"/>'
        image = f'<texture name="reflectance" type="bitmap">{inner}</texture>'
        made = material(f'<bsdf type="diffuse">{image}</bsdf>', version).reflectance
        assert made.raw == (gamma != -1.0)
        if gamma > 1.0:
            assert np.allclose(made.image, (128 / 255) ** gamma, atol=1e-6)


def test_textures_of_old_files(material, grey):
    image = f'<texture type="bitmap">{grey}</texture>'
    scaled = f'<texture name="reflectance" type="scale"><float name="scale" value=".5"/>{image}'
    made = material(f'<bsdf type="diffuse">{scaled}</texture></bsdf>').reflectance
    assert isinstance(made, textures.Product) and level(made.second) == 0.5
    shift = '<float name="uvscale" value="2"/><float name="uoffset" value=".25"/>'
    image = f'<texture name="reflectance" type="checkerboard">{shift}</texture>'
    made = material(f'<bsdf type="diffuse">{image}</bsdf>').reflectance
    assert np.allclose(made.to_uv, [[2, 0, 0.25], [0, 2, 0], [0, 0, 1]])
    lines = '<texture name="reflectance" type="gridtexture"/>'
    made = material(f'<bsdf type="diffuse">{lines}</bsdf>').reflectance
    assert made.amount.image.mean() == pytest.approx(1.0 - 0.98**2, abs=1e-4)


def test_mixtures_of_any_number(material):
    parts = "".join(
        f'<bsdf type="diffuse"><float name="reflectance" value="{value}"/></bsdf>'
        for value in (0.8, 0.2, 0.5)
    )
    text = '<bsdf type="mixturebsdf"><string name="weights" value="{}"/>{}</bsdf>'

    def albedo(made) -> float:
        if isinstance(made, materials.Blend):
            return (1.0 - made.weight) * albedo(made.first) + made.weight * albedo(made.second)
        return level(made.reflectance)

    assert albedo(material(text.format("0.5, 0.25, 0.125", parts))) == pytest.approx(0.5125)
    assert albedo(material(text.format("2 1 1", parts))) == pytest.approx(0.575)
    with pytest.raises(SceneError, match="must be 3 numbers"):
        material(text.format("0.5, 0.5", parts))


def test_other_materials_of_old_files(material):
    made = material('<bsdf type="difftrans"><float name="transmittance" value="0.4"/></bsdf>')
    assert (level(made.transmittance), level(made.reflectance)) == (0.4, 0.0)
    for name in ("phong", "as"):
        text = f'<bsdf type="roughconductor"><string name="distribution" value="{name}"/></bsdf>'
        assert material(text).distribution == "beckmann"
        with pytest.raises(SceneError, match="none of"):
            material(text, "3.0.0")


def test_creases_stay_sharp(read, tmp_path):
    """Two triangles at 53 degrees share an edge: smooth above that angle alone."""
    roof = "v -1 0 0\nv 0 0 .5\nv 1 0 0\nv 0 1 .5\nv 0 -1 .5\nf 5 2 1\nf 2 5 3\n"
    (tmp_path / "roof.obj").write_text(roof)
    for angle, corners in ((20.0, 6), (80.0, 4)):
        text = f'<float name="maxSmoothAngle" value="{angle}"/>'
        name = '<string name="filename" value="roof.obj"/>'
        mesh = read(f'<shape type="obj">{name}{text}</shape>').shapes[0]
        assert len(mesh.vertices) == corners and len(mesh.faces) == 2
        points = mesh.vertices[mesh.faces].astype(float)
        flat = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        near = np.einsum("fcx,fx->fc", mesh.normals[mesh.faces], flat)
        assert np.allclose(near, 1.0) == (angle < 50.0)


def test_meters_are_refused_by_name(read):
    with pytest.raises(SceneError, match="a sensor on a shape gives a number"):
        read('<shape type="cube"><sensor type="irradiancemeter"/></shape>')
    with pytest.raises(SceneError, match="beam without width"):
        read('<emitter type="collimated"/>')


def test_unknown_kinds_are_errors_that_an_option_turns_into_grey(read):
    shape = '<shape type="cube"><bsdf type="ofafork"/></shape><shape type="blob"/>'
    light = '<emitter type="portal"/>'
    for version in ("0.6.0", "3.0.0"):
        with pytest.raises(SceneError, match="unknown"):
            read(shape, version)
        scene = read(shape + light, version, missing_textures="grey")
        assert len(scene.shapes) == 1 and not scene.lights
        assert type(scene.shapes[0].material) is materials.Diffuse
        text = " ".join(scene.warnings)
        assert all(word in text for word in ("ofafork", "blob", "portal", "grey stands for it"))


def test_all_lights_are_kinds(read):
    assert isinstance(read('<emitter type="sunsky"/>').lights[0], lights.Sky)


def test_rough_diffuse(material):
    made = material('<bsdf type="roughdiffuse"><float name="alpha" value="0.5"/></bsdf>')
    assert isinstance(made, materials.OrenNayar) and made.interreflection
    assert made.sigma == pytest.approx(np.degrees(0.5 / np.sqrt(2.0)))
    fast = '<boolean name="useFastApprox" value="true"/>'
    assert not material(f'<bsdf type="roughdiffuse">{fast}</bsdf>').interreflection


def test_ward_in_its_three_forms(material):
    for name, ours in (("balanced", "balanced"), ("ward-duer", "duer"), ("ward", "ward")):
        text = f'<string name="variant" value="{name}"/><float name="alphaU" value="0.3"/>'
        made = material(f'<bsdf type="ward">{text}</bsdf>')
        assert (made.variant, made.alpha_u, made.alpha_v) == (ours, 0.3, 0.1)


def test_coats(material):
    """Over a diffuse base of r the coat sends r back once: r' / (1 - f r') = r."""
    coat = '<bsdf type="{}"><float name="intIOR" value="1.5"/>{}</bsdf>'
    inner = '<bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>'
    for kind, cls in (("coating", materials.Plastic), ("roughcoating", materials.RoughPlastic)):
        made = material(coat.format(kind, inner))
        base = level(made.diffuse_reflectance)
        assert isinstance(made, cls) and made.nonlinear
        inside = 1.0 / base - 2.0
        assert inside == pytest.approx(0.5963, abs=2e-3)  # of an index of 1.5 over 1.000277
    metal = material(coat.format("coating", '<bsdf type="roughconductor"/>'))
    assert isinstance(metal, materials.CoatedConductor) and level(metal.coat_ior) == 1.5
    other = material(coat.format("coating", '<bsdf type="dielectric"/>'))
    assert isinstance(other, materials.Dielectric)


@pytest.mark.parametrize("kind", ["phong", "ward", "plastic", "roughplastic"])
def test_coats_over_a_diffuse_and_a_glossy_reflection(material, kind):
    coated = material(f'<bsdf type="coating"><bsdf type="{kind}"/></bsdf>')
    assert isinstance(coated, materials.Blend)
    assert isinstance(coated.first, materials.Plastic)
    assert isinstance(coated.second, materials.CoatedConductor)
    alpha = {"phong": 0.25, "plastic": 1e-4}.get(kind, 0.1)
    assert coated.second.alpha_u == coated.second.alpha_v == pytest.approx(alpha)


@pytest.mark.slow
@pytest.mark.parametrize("kind, error", [("phong", 0.03), ("ward", 0.015), ("plastic", 0.002)])
def test_how_bright_coats_are(material, kind, error):
    """Directional albedos of 0.6's formula; docs/mitsuba.md tells the largest errors."""
    base = material(f'<bsdf type="{kind}"/>')
    coated = material(f'<bsdf type="coating"><bsdf type="{kind}"/></bsdf>')
    share, ratio, count = level(coated.weight), 1.5046 / 1.000277, 20000
    u = np.random.default_rng(1).random((count, 3))
    r, turn = np.sqrt(u[:, 0]), 2.0 * np.pi * u[:, 1]
    wi = np.stack([r * np.cos(turn), r * np.sin(turn), np.sqrt(1.0 - u[:, 0])], axis=1)
    for angle in (1.0, 45.0, 70.0):
        sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        wo = np.broadcast_to([sine, 0.0, cosine], wi.shape)
        o, i = below(wo, ratio), below(wi, ratio)
        mirror, passed = reflected(cosine, ratio), 1.0 - reflected(wi[:, 2], ratio)
        inner = values(base, o, i, u)["eval"][:, 1] / i[:, 2]
        exact = mirror + (1.0 - mirror) * np.pi * float((inner * passed).mean()) / ratio**2
        if kind == "plastic":
            exact += (1.0 - mirror) ** 2 * reflected(o[0, 2], 1.49 / 1.000277)
        ours = [values(part, wo, wi, u)["weight"].mean() for part in (coated.first, coated.second)]
        assert (1.0 - share) * ours[0] + share * ours[1] == pytest.approx(exact, abs=error)


def values(made, wo, wi, u):
    """What the kernels of a material say in RGB, see clpt.testing.probe."""
    numbers = {
        name: param.choices.index(value) if param.choices else level(value)
        for name, param in device_params(type(made)).items()
        for value in [fields_of(made)[name]]
    }
    return Probe(type(made), "rgb")(numbers, wo, wi, u)


def below(w, ratio):
    """Directions (n, 3) refracted into a coat."""
    across = w[:, :2] / ratio
    return np.column_stack([across, np.sqrt(1.0 - (across**2).sum(axis=1))])


def reflected(cosine, ratio):
    """Fresnel's reflectance of unpolarised light from outside."""
    inner = np.sqrt(1.0 - (1.0 - np.square(cosine)) / ratio**2)
    across = (cosine - ratio * inner) / (cosine + ratio * inner)
    along = (ratio * cosine - inner) / (ratio * cosine + inner)
    return 0.5 * (across**2 + along**2)


def test_a_coat_of_a_sum_is_the_sum_of_coats(read):
    """f of src/bsdfs/coating.cpp is linear in the base; sides and normal maps keep their place."""
    inner = '<bsdf type="blendbsdf"><float name="weight" value="0.3"/><bsdf type="conductor"/>'
    inner += '<bsdf type="roughdiffuse"/></bsdf>'
    scene = read(f'<shape type="sphere"><bsdf type="coating">{inner}</bsdf></shape>')
    made = scene.shapes[0].material
    assert isinstance(made, materials.Blend) and level(made.weight) == 0.3
    assert isinstance(made.first, materials.CoatedConductor)
    assert isinstance(made.second, materials.Plastic)
    assert any("rough diffuse base is taken as smooth" in text for text in scene.warnings)
    both = '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>'
    made = read(f'<shape type="sphere"><bsdf type="coating">{both}</bsdf></shape>')
    made = made.shapes[0].material
    assert isinstance(made, materials.TwoSided) and isinstance(made.front, materials.Plastic)


@pytest.mark.parametrize("angle, error", [(0.0, -0.066), (45.0, -0.001), (70.0, 0.076)])
def test_coats_that_absorb(angle, error):
    """The error that docs/mitsuba.md tells, beside the directional albedo of 0.6's formula."""
    ior, depth = 1.5, 0.5
    cos_in = (np.arange(20000) + 0.5) / 20000  # of directions inside, even light has 2 cos
    even = 2.0 * cos_in * (1.0 - internal(cos_in, ior))
    seen = np.sqrt(1.0 - (np.sin(np.radians(angle)) / ior) ** 2)
    exact = np.exp(-depth / seen) * (even * np.exp(-depth / cos_in)).mean()
    ours = transmitted(ior, depth) ** 2 * even.mean()
    assert ours / exact - 1.0 == pytest.approx(error, abs=1e-3)


def internal(cos: float, ior: float):
    """Fresnel's reflectance of unpolarised light from inside."""
    sin2 = ior**2 * (1.0 - np.square(cos))
    out = np.sqrt(np.maximum(1.0 - sin2, 0.0))
    across = (ior * cos - out) / (ior * cos + out)
    along = (cos - ior * out) / (cos + ior * out)
    return np.where(sin2 < 1.0, 0.5 * (across**2 + along**2), 1.0)


def test_the_depth_of_a_coat_is_its_thickness_times_sigma_a(material):
    text = '<float name="thickness" value="2"/><{} name="sigmaA" value="{}"/>'
    inner = '<bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf></bsdf>'
    coat = f'<bsdf type="coating">{text}{inner}'
    assert level(material(coat.format("float", 0)).diffuse_reflectance) > 0.3
    even = material(coat.format("float", 0.25)).diffuse_reflectance
    ratio = 1.5046 / 1.000277  # bk7 in air
    inside = float(EVEN @ internal_fresnel(ratio))
    expected = 0.5 * transmitted(ratio, 0.5) ** 2
    assert level(even) == pytest.approx(expected / (1.0 + inside * expected), rel=1e-3)
    coloured = material(coat.format("rgb", "0, 0.25, 2")).diffuse_reflectance
    assert coloured.g == pytest.approx(level(even), rel=1e-3)
    assert coloured.r > coloured.g > coloured.b


def test_a_dipole_is_a_body_in_which_light_walks(read):
    inner = '<string name="material" value="cream"/><float name="scale" value="2"/>'
    shape = f'<shape type="sphere"><subsurface type="dipole">{inner}</subsurface></shape>'
    made = read(shape).shapes[0]
    assert isinstance(made.material, materials.Dielectric) and made.interior.scale == 2.0
    assert made.interior.sigma_s == RGBUnbounded(738.0, 547.0, 315.0)
    with pytest.raises(SceneError, match="is not supported"):
        read(shape, "3.0.0")


HAIR = np.array([[0, 0, 0], [0, 0, 1], [0, 1, 1], [2, 0, 0], [2, 0, 3]], "<f4")


def binary_hair(strands: list[np.ndarray]) -> bytes:
    """The count of points, and infinity before each strand but the first."""
    values = [HAIR[:0].ravel()]
    for number, strand in enumerate(strands):
        values += [np.array([np.inf] * bool(number), "<f4"), strand.ravel()]
    count = sum(map(len, strands))
    return b"BINARY_HAIR" + count.to_bytes(4, "little") + np.concatenate(values).tobytes()


@pytest.mark.parametrize("binary", [False, True])
def test_hair_is_curves_of_an_even_radius(read, tmp_path, binary):
    """src/shapes/hair.cpp: the radius is scaled as (0, 0, 1) is."""
    strands = [HAIR[:3], HAIR[3:]]
    lines = ["\n".join(" ".join(map(str, point)) for point in strand) for strand in strands]
    text = "\n\n".join(lines).encode()
    (tmp_path / "a.hair").write_bytes(binary_hair(strands) if binary else text)
    shape = read(
        '<shape type="hair"><string name="filename" value="a.hair"/>'
        '<float name="radius" value="0.1"/><transform name="toWorld"><scale value="2"/>'
        "</transform></shape>"
    ).shapes[0]
    np.testing.assert_allclose(shape.points[:, :3], 2 * HAIR)
    np.testing.assert_allclose(shape.points[:, 3], 0.2)
    assert shape.basis == "linear" and list(shape.lengths) == [3, 2]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"BINARY_HAIR", "names 0 points"),
        (b"BINARY_HAIR\xff\xff\xff\xff" + bytes(12), "names 4294967295 points, and holds 1"),
        (b"1 2\n", "needs x, y and z"),
        (b"1 2 a\n", "not all numbers"),
    ],
)
def test_broken_hair(read, tmp_path, content, message):
    (tmp_path / "a.hair").write_bytes(content)
    with pytest.raises(SceneError, match=message):
        read('<shape type="hair"><string name="filename" value="a.hair"/></shape>')


def test_hair_is_no_shape_of_mitsuba_3(read):
    with pytest.raises(SceneError, match="unknown shape 'hair'"):
        read('<shape type="hair"/>', "3.0.0")


def test_the_last_of_two_materials_counts(read):
    """src/librender/shape.cpp, addChild."""
    two = '<bsdf type="plastic"/><bsdf type="mask"><bsdf type="diffuse"/></bsdf>'
    scene = read(f'<shape type="cube">{two}</shape>')
    assert scene.shapes[0].material.kind == "mask"
    assert any("more than one <bsdf>: the last counts" in text for text in scene.warnings)


def test_the_texture_of_a_normal_map_needs_no_name(material, tmp_path):
    Image.new("RGB", (2, 2), (128, 128, 255)).save(tmp_path / "n.png")
    texture = '<texture type="bitmap"><string name="filename" value="n.png"/></texture>'
    mapped = material(f'<bsdf type="normalmap">{texture}<bsdf type="diffuse"/></bsdf>')
    assert isinstance(mapped, materials.NormalMap)


@pytest.mark.parametrize(
    ("body", "scattered", "absorbed"),
    [
        ('<spectrum name="sigmaS" value="2"/><spectrum name="sigmaA" value="1"/>', 1.0, 1.0),
        ('<spectrum name="sigmaT" value="3"/><spectrum name="albedo" value="0.5"/>', 0.75, 1.5),
    ],
)
def test_g_of_a_medium_reduces_its_scattering(read, body, scattered, absorbed):
    medium = f'<medium name="interior" type="homogeneous">{body}<float name="g" value="0.5"/>'
    inside = read(f'<shape type="cube">{medium}</medium></shape>').shapes[0].interior
    if "sigmaS" in body:
        assert (level(inside.sigma_s), level(inside.sigma_a)) == (scattered, absorbed)
    else:
        sigma_t, albedo = level(inside.sigma_t), level(inside.albedo)
        assert (sigma_t * albedo, sigma_t * (1 - albedo)) == pytest.approx((scattered, absorbed))
    assert inside.phase.kind == "isotropic"
