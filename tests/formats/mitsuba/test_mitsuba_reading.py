"""Mitsuba's XML as Mitsuba reads it: variables, paths, references, old names, what may stand where.

What is expected here is what Mitsuba 3.9.1 made of the same lines.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt import images
from clpt.errors import SceneError
from clpt.formats import load
from clpt.spectra import RGB, Constant, RGBUnbounded


@pytest.fixture
def read(tmp_path):
    """Load what stands inside <scene>."""

    def of(body: str, **variables):
        path = tmp_path / "scene.xml"
        sensor = "" if "<sensor" in body else '<sensor type="perspective"/>'
        path.write_text(f'<scene version="3.0.0">{body}{sensor}</scene>', "utf-8")
        return load(path, **variables)

    return of


@pytest.fixture
def material(read):
    def of(bsdf: str, before: str = ""):
        return read(f'{before}<shape type="cube">{bsdf}</shape>').shapes[0].material

    return of


def test_colours_of_coefficients(read) -> None:
    """Up to 1 they have the spectrum of a reflectance; above, where Mitsuba cuts off, their own."""

    def sigma_t(rgb: str):
        medium = f'<medium name="interior" type="homogeneous"><rgb name="sigma_t" value="{rgb}"/>'
        return read(f'<shape type="cube">{medium}</medium></shape>').shapes[0].interior.sigma_t

    assert sigma_t("1, .2, .7") == RGB(1.0, 0.2, 0.7)
    assert sigma_t("1, 2, 3") == RGBUnbounded(1.0, 2.0, 3.0)


def diffuse(inner: str) -> str:
    return f'<bsdf type="diffuse">{inner}</bsdf>'


def number(tag: str, name: str, value: object) -> str:
    return f'<{tag} name="{name}" value="{value}"/>'


def test_the_longest_variable_is_meant(read):
    defaults = '<default name="r" value="2"/><default name="rad" value="3"/>'
    for text, radius in (("$r", 2), ("$rad", 3), ("$r5", 25), ("${r}4", 24), ("$rad$r", 32)):
        made = read(f'{defaults}<shape type="sphere">{number("float", "radius", text)}</shape>')
        assert made.shapes[0].radius == radius
    made = read(rf'{defaults}<shape type="cube" id="\$r"/>')
    assert made.shapes[0].name == "$r"


def test_paths_stand_before_the_scenes_folder(read, tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    places = [tmp_path, tmp_path / "a", tmp_path / "b"]
    for place in places:
        images.write(place / "x.pfm", np.zeros((1, 1, 3), np.float32))
    shape = '<shape type="cube"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
    shape += '<string name="filename" value="x.pfm"/></texture></bsdf></shape>'
    for count in range(3):
        paths = "".join(f'<path value="{name}"/>' for name in ("a", "b")[:count])
        image = read(paths + shape).shapes[0].material.reflectance.image
        assert image.parent == places[count]


def test_include_of_one_object_takes_the_name(read, tmp_path):
    (tmp_path / "r.xml").write_text(
        '<texture version="3.0.0" type="checkerboard"><float name="color0" value="0.7"/></texture>'
    )
    made = read(
        '<shape type="cube"><bsdf type="diffuse"><include name="reflectance" filename="r.xml"/>'
        "</bsdf></shape>"
    )
    assert made.shapes[0].material.reflectance.color0 == Constant(0.7)


def test_alias(read):
    made = read(
        '<bsdf type="plastic" id="a"/><alias id="a" as="b"/><alias id="b" as="c"/>'
        '<shape type="cube"><ref id="b"/></shape><shape type="cube"><ref id="c"/></shape>'
    )
    first, second = made.shapes
    assert first.material.kind == "plastic" and first.material is second.material


def test_what_others_refer_to_may_stand_in_the_scene(read):
    made = read(
        '<film type="hdrfilm" id="f"><integer name="width" value="9"/><ref id="r"/></film>'
        '<sampler type="independent" id="s"><integer name="sample_count" value="7"/></sampler>'
        '<rfilter type="tent" id="r"/><medium type="homogeneous" id="m"/><phase type="hg"/>'
        '<spectrum type="uniform" id="u"><float name="value" value="0.3"/></spectrum>'
        '<shape type="cube"><bsdf type="diffuse"><ref name="reflectance" id="u"/></bsdf></shape>'
        '<sensor type="perspective"><ref id="f"/><ref id="s"/></sensor>'
    )
    assert (made.film.width, made.film.filter.kind, made.spp) == (9, "tent", 7)
    assert made.shapes[0].material.reflectance == Constant(0.3)


def test_old_and_capital_names(read):
    made = read(
        '<sensor type="Perspective"><film type="hdrfilm"><boolean name="banner" value="false"/>'
        '</film><sampler type="independent"><integer name="sampleCount" value="3"/></sampler>'
        '</sensor><shape type="Sphere"><bsdf type="diffuse"><texture type="checkerboard" '
        'name="diffuseReflectance"><float name="uscale" value="3"/><float name="voffset" '
        'value="0.5"/><float name="vscale" value="4"/></texture></bsdf></shape>'
        '<shape type="rectangle"><bsdf type="roughplastic"><string name="distribution" '
        'value="GGX"/><float name="intIOR" value="1.4"/></bsdf></shape>'
    )
    assert made.spp == 3
    # As Mitsuba 3.9 upgrades them: the offset comes before the scale.
    uv = made.shapes[0].material.reflectance.to_uv
    assert np.allclose(uv, [[3, 0, 0], [0, 4, 2], [0, 0, 1]])
    assert made.shapes[1].material.distribution == "ggx"


def test_plugins_of_spectra_and_of_textures_are_one_kind(material):
    inner = number("float", "value", 0.4)
    for tag in ("spectrum", "texture"):
        made = material(diffuse(f'<{tag} type="uniform" name="reflectance">{inner}</{tag}>'))
        assert made.reflectance == Constant(0.4)
        text = f'<{tag} type="checkerboard" name="reflectance"/>'
        assert material(diffuse(text)).reflectance.kind == "checkerboard"
        colour = number("rgb", "color", "0.1 0.2 0.3")
        made = material(diffuse(f'<{tag} type="srgb" name="reflectance">{colour}</{tag}>'))
        assert made.reflectance == RGB(0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (number("float", "value", 0.3), Constant(0.3)),
        (number("rgb", "value", "0.1, 0.2, 0.3"), RGB(0.1, 0.2, 0.3)),
    ],
)
def test_constant_volumes(material, value, expected):
    volume = f'<volume type="constvolume" name="volume">{value}</volume>'
    made = material(diffuse(f'<texture type="volume" name="reflectance">{volume}</texture>'))
    assert made.reflectance == expected


def test_colours_where_numbers_are_asked_for(material):
    made = material(f'<bsdf type="roughconductor">{number("rgb", "alpha", "0.1 0.2 0.5")}</bsdf>')
    assert made.alpha_u == pytest.approx(0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.5, rel=1e-3)
    made = material(f'<bsdf type="roughconductor">{number("spectrum", "alpha", 0.3)}</bsdf>')
    assert made.alpha_u == 0.3


def test_shares_are_clamped(material):
    for given, share in ((2, 1.0), (-1, 0.0)):
        opacity = number("float", "opacity", given)
        made = material(f'<bsdf type="mask"><bsdf type="diffuse"/>{opacity}</bsdf>')
        assert made.opacity == share


def test_commas_at_the_end(material):
    made = material(diffuse(number("rgb", "reflectance", " 0.1, 0.2,0.3, ")))
    assert made.reflectance == RGB(0.1, 0.2, 0.3)


def test_look_at_with_up_of_no_length(read):
    step = '<lookat origin="0 2 0" target="0 0 0" up="0 0 0"/>'
    transform = f'<transform name="to_world">{step}</transform>'
    made = read(f'<sensor type="perspective">{transform}</sensor><shape type="cube"/>')
    assert np.allclose(made.camera.to_world[:3, 2], [0, -1, 0])


def test_projector_of_a_focal_length(read):
    shown = number("rgb", "irradiance", 2)
    light = read(f'<emitter type="projector">{shown}</emitter>').lights[0]
    # 50 mm of 35 mm film, along the diagonal of a square.
    half = np.hypot(36, 24) / 100 / np.sqrt(2)
    assert light.fov == pytest.approx(2 * np.degrees(np.arctan(half)))
    assert light.irradiance.r == pytest.approx(2 * np.pi)


def test_merged_shapes(read):
    made = read('<shape type="merge"><shape type="cube"/><shape type="sphere"/></shape>')
    assert [shape.kind for shape in made.shapes] == ["cube", "sphere"]


def test_what_changes_no_picture_is_passed_over(read):
    made = read(
        '<integrator type="path"><integer name="samples_per_pass" value="4"/>'
        '<float name="timeout" value="1"/><integer name="block_size" value="8"/></integrator>'
        '<sensor type="orthographic"><float name="focus_distance" value="3"/>'
        '<sampler type="orthogonal"><integer name="strength" value="2"/></sampler></sensor>'
        '<shape type="disk"><float name="silhouette_sampling_weight" value="1"/></shape>'
    )
    assert not made.warnings


def _doubled(tag: str, first: str, between: str, names: tuple[str, str], count: int) -> str:
    """Objects that each hold the one before twice."""
    made = [f'<{tag} type="{first}" id="d0"/>']
    for i in range(1, count):
        refs = "".join(f'<ref{name} id="d{i - 1}"/>' for name in names)
        made.append(f'<{tag} type="{between}" id="d{i}">{refs}</{tag}>')
    return "".join(made)


BOMBS = {
    "variables": (
        '<default name="v0" value="xxxxxxxx"/>'
        + "".join(f'<default name="v{i}" value="$v{i - 1}$v{i - 1}"/>' for i in range(1, 60)),
        "with its variables would take",
    ),
    "materials": (
        _doubled("bsdf", "diffuse", "twosided", ("", ""), 40),
        "more than 1000 parts",
    ),
    "checkerboards": (
        _doubled(
            "texture", "checkerboard", "checkerboard", (' name="color0"', ' name="color1"'), 40
        ),
        "more than 1000 parts",
    ),
    "a chain of references": (
        '<shape type="cube"><ref id="d99"/></shape>'
        + "".join(
            f'<bsdf type="twosided" id="d{i}"><ref id="d{i - 1}"/></bsdf>' for i in range(99, 0, -1)
        )
        + '<bsdf type="diffuse" id="d0"/>',
        "nested deeper than 64 objects",
    ),
    "an integrator in itself": (
        '<integrator type="moment" id="m"><ref id="m"/></integrator>',
        "refers to itself",
    ),
    "a merge of itself": ('<shape type="merge" id="m"><ref id="m"/></shape>', "cannot stand in a"),
    "a volume of itself": (
        '<volume type="constvolume" id="c"><texture type="volume" name="value"><ref name="volume" '
        'id="c"/></texture></volume><shape type="cube"><bsdf type="diffuse"><texture type="volume" '
        'name="reflectance"><ref name="volume" id="c"/></texture></bsdf></shape>',
        "unknown texture 'volume'",
    ),
}


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_end_at_once(read, name):
    body, message = BOMBS[name]
    with pytest.raises(SceneError, match=message):
        read(body)


def test_includes_are_counted(read, tmp_path):
    for i in range(12):
        (tmp_path / f"i{i}.xml").write_text(
            '<scene version="3.0.0">' + f'<include filename="i{i + 1}.xml"/>' * 8 + "</scene>"
        )
    (tmp_path / "i12.xml").write_text('<scene version="3.0.0"/>')
    with pytest.raises(SceneError, match="parts, most of them repeated"):
        read('<include filename="i0.xml"/>')


def test_round_shapes_may_be_scaled_turned_mirrored_and_a_cylinder_lengthened(read):
    turned = '<rotate x="1" angle="30"/><rotate y="1" angle="50"/><scale value="-3"/>'
    place = f'<transform name="to_world">{turned}</transform>'
    longer = f'<transform name="to_world"><scale z="4"/>{turned}</transform>'
    ends = number("point", "p1", "1 1 0")
    along = (
        f'<transform name="to_world"><rotate z="1" angle="-45"/><scale x="4"/>{turned}</transform>'
    )
    made = read(
        f'<shape type="sphere">{place}</shape><shape type="cylinder">{longer}</shape>'
        f'<shape type="cylinder">{ends}{along}</shape>'
    )
    assert len(made.shapes) == 3 and not made.warnings


def test_a_batch_of_sensors(tmp_path):
    """Each has its share of the film; --camera chooses, and a warning tells that it is no row."""
    inner = '<sensor type="perspective" id="{}"><film type="hdrfilm"/></sensor>'
    film = '<film type="hdrfilm"><integer name="width" value="{}"/>'
    film += '<integer name="height" value="48"/></film>'
    path = tmp_path / "a.xml"

    def written(width):
        batch = inner.format("left") + inner.format("right") + film.format(width)
        path.write_text(f'<scene version="3.0.0"><sensor type="batch">{batch}</sensor></scene>')
        return path

    scene = load(written(128), camera="right")
    assert (scene.film.width, scene.film.height) == (64, 48)
    assert [name.split()[-1] for name in scene.extra["cameras"]] == ["left", "right"]
    assert any("no row" in warning for warning in scene.warnings)
    with pytest.raises(SceneError, match=r"a\.xml:1.*multiple of its sensors"):
        load(written(127))


def test_a_path_in_an_included_file_lies_beside_it_or_beside_the_scene(read, tmp_path):
    """Mitsuba looks beside the file that names a folder, then in all folders so far."""
    for folder in ("shared", "parts/own", "shared/deep"):
        (tmp_path / folder).mkdir(parents=True)
    triangle = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n"
    for folder, file in (("shared", "a"), ("parts/own", "b"), ("shared/deep", "c")):
        (tmp_path / folder / f"{file}.obj").write_text(triangle)
    names = "".join(
        f'<shape type="obj"><string name="filename" value="{name}.obj"/></shape>' for name in "abc"
    )
    part = tmp_path / "parts" / "part.xml"
    paths = '<path value="shared"/><path value="own"/><path value="deep"/>'
    part.write_text(f'<scene version="3.0.0">{paths}{names}</scene>')
    scene = '<path value="shared"/><include filename="parts/part.xml"/>'
    assert [one.kind for one in read(scene).shapes] == ["mesh"] * 3
    part.write_text('<scene version="3.0.0"><path value="none"/></scene>')
    with pytest.raises(SceneError, match=r"part.xml:1: <path>: there is no folder 'none'"):
        read(scene)
