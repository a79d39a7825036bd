"""<volume>s of Mitsuba's media: constants and grids, for all that may be one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.formats.volumes import VOL_HEADER
from clpt.scene import media
from clpt.scene.textures import Voxels
from clpt.scene.volumes import resampled
from clpt.spectra import RGB, Constant
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures, mitsubas, with_film

NUMBERS = np.random.default_rng(5).random((3, 2, 4), np.float32)
AROUND = '<transform name="to_world"><translate value="-.5,-.5,-.5"/><scale value="2"/></transform>'
SCENE = """<scene version="3.0.0">
<integrator type="volpathmis"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective"><float name="fov" value="30"/><transform name="to_world">
<lookat origin="1.1, 1.3, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
<rfilter type="box"/></film></sensor>
<emitter type="directional"><vector name="direction" value="0.4, -1, -0.3"/></emitter>
<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>
%s<shape type="cube"><bsdf type="null"/><medium name="interior" type="%s">%s</medium></shape>
</scene>"""


def constant(name: str, value: str = '<float name="value" value="0.5"/>') -> str:
    return f'<volume name="{name}" type="constvolume">{value}</volume>'


def grid(name: str, file: str, more: str = AROUND) -> str:
    given = f'<string name="filename" value="{file}"/>{more}'
    return f'<volume name="{name}" type="gridvolume">{given}</volume>'


def blend(weight: str) -> str:
    return (
        f'<phase type="blendphase">{weight}<phase type="hg"><float name="g" value="0.7"/></phase>'
        '<phase type="hg"><float name="g" value="-0.5"/></phase></phase>'
    )


def write_grid(path: Path, values: np.ndarray) -> None:
    """A .vol of an array (nx, ny, nz) or (nx, ny, nz, channels)."""
    given = np.asarray(values, "<f4").reshape(*values.shape[:3], -1)
    *size, channels = given.shape
    header = VOL_HEADER.pack(b"VOL", 3, 1, *size, channels, 0, 0, 0, 1, 1, 1)
    path.write_bytes(header + np.ascontiguousarray(given.transpose(2, 1, 0, 3)).tobytes())


@pytest.fixture
def written(tmp_path):
    """The path of a scene with a medium in a cube from -1 to 1, beside its grids."""
    write_grid(tmp_path / "a.vol", NUMBERS)
    write_grid(tmp_path / "b.vol", NUMBERS[::-1])
    write_grid(tmp_path / "fine.vol", np.random.default_rng(6).random((5, 7, 4), np.float32))
    colours = np.random.default_rng(7).random((3, 2, 4, 3), np.float32)
    write_grid(tmp_path / "c.vol", colours)

    def of(kind: str, inner: str, before: str = "") -> Path:
        path = tmp_path / "scene.xml"
        path.write_text(SCENE % (before, kind, inner), "utf-8")
        return path

    return of


@pytest.fixture
def medium(written):
    def of(kind: str, inner: str, before: str = ""):
        return clpt.load(written(kind, inner, before)).shapes[0].interior

    return of


def test_constants_of_a_homogeneous_medium(medium):
    colour = '<rgb name="value" value=".5, .2, .1"/>'
    made = medium("homogeneous", constant("sigma_t") + constant("albedo", colour))
    assert (made.kind, made.sigma_t, made.albedo) == (
        "homogeneous",
        Constant(0.5),
        RGB(0.5, 0.2, 0.1),
    )
    referred = '<volume type="constvolume" id="v"><float name="value" value="0.25"/></volume>'
    assert medium("homogeneous", '<ref name="albedo" id="v"/>', referred).albedo == Constant(0.25)
    blended = medium("homogeneous", blend(constant("weight"))).phase
    assert (blended.kind, blended.weight) == ("blend", 0.5)
    assert medium("homogeneous", blend('<rgb name="weight" value="3, 3, 3"/>')).phase.weight == 1.0


def test_a_heterogeneous_medium_is_in_the_box_of_its_extinction(written):
    """Of a number or a constant: the unit cube where it is not placed, as in Mitsuba."""
    for given in (constant("sigma_t"), '<float name="sigma_t" value="0.5"/>'):
        scene = clpt.load(written("heterogeneous", given))
        made = scene.shapes[0].interior
        assert (made.kind, made.sigma_t, made.density.shape) == ("grid", Constant(0.5), (1, 1, 1))
        assert np.array_equal(made.to_world, np.eye(4))
        assert "the unit cube alone" in scene.warnings[0]
    placed = constant("sigma_t", f'<float name="value" value="2"/>{AROUND}')
    scene = clpt.load(written("heterogeneous", placed))
    made = scene.shapes[0].interior
    np.testing.assert_allclose(made.to_world @ [0, 0, 0, 1], [-1, -1, -1, 1])
    assert not scene.warnings and made.sigma_t == Constant(2.0)


def test_grids_of_other_points_are_brought_together(medium):
    """The albedo is held beyond its own box, and loses nothing where it is the finer one."""
    inner = grid("sigma_t", "a.vol") + grid("albedo", "fine.vol", "")
    made = medium("heterogeneous", inner)
    assert all(n >= k for n, k in zip(made.density.shape, (9, 6, 12), strict=True))
    assert made.albedo_grid.shape[:3] == made.density.shape and not made.albedo_with_density
    points = resampled(made.albedo_grid[..., 0], made.to_world, (15, 21, 12), np.eye(4))
    exact = np.random.default_rng(6).random((5, 7, 4), np.float32)
    exact = resampled(exact, np.eye(4), (15, 21, 12), np.eye(4))
    assert np.abs(points - exact).mean() < 0.03 * exact.mean()
    assert np.allclose(
        made.albedo_grid[0, 0, 0, 0],
        np.random.default_rng(6).random((5, 7, 4), np.float32)[0, 0, 0],
    )
    same = medium("heterogeneous", grid("sigma_t", "a.vol") + grid("albedo", "c.vol"))
    assert same.density.shape == (3, 2, 4) and np.array_equal(same.density, NUMBERS)


def test_an_albedo_goes_on_beyond_its_box(medium):
    """A homogeneous medium fills its shape: cells of the grid's ends are put around it."""
    made = medium("homogeneous", grid("albedo", "a.vol", ""))
    assert made.density.min() == made.density.max() == 1.0
    size = np.array(made.albedo_grid.shape[:3])
    assert tuple(size) == (6, 4, 8)  # as many before as within
    np.testing.assert_allclose(made.albedo_grid[3:, 2:, 4:, 0], NUMBERS)
    np.testing.assert_allclose(made.albedo_grid[:3, 2:, 4:, 0], np.repeat(NUMBERS[:1], 3, axis=0))
    np.testing.assert_allclose(made.to_world @ [0, 0, 0, 1], [-1, -1, -1, 1], atol=1e-6)
    np.testing.assert_allclose(made.to_world @ [1, 1, 1, 1], [1, 1, 1, 1], atol=1e-6)


def test_what_is_beyond_its_limits_is_clamped_with_a_warning(written, tmp_path):
    for inner in (
        '<float name="albedo" value="1.5"/>',
        '<float name="scale" value="-1"/>',
        grid("albedo", "bright.vol"),
    ):
        write_grid(tmp_path / "bright.vol", 2.0 * NUMBERS)
        scene = clpt.load(written("homogeneous", inner))
        assert "clamped" in scene.warnings[0]
        made = scene.shapes[0].interior
        assert made.scale >= 0.0
        if "grid" in inner:
            assert made.albedo_grid.max() == 1.0


def test_a_blend_on_a_grid_is_a_mixture(medium):
    made = medium("homogeneous", blend(grid("weight", "a.vol")))
    assert isinstance(made, media.Mixture)
    first, second = made.parts
    np.testing.assert_allclose(first.density + second.density, 1.0)
    np.testing.assert_allclose(second.density, NUMBERS)
    assert (first.phase.g.value, second.phase.g.value) == (0.7, -0.5)
    dense = medium("heterogeneous", grid("sigma_t", "b.vol") + blend(grid("weight", "a.vol")))
    np.testing.assert_allclose(sum(part.density for part in dense.parts), NUMBERS[::-1])


@pytest.mark.parametrize(
    ("kind", "inner", "error", "message"),
    [
        ("homogeneous", grid("sigma_t", "a.vol"), SceneError, 'needs a medium of the type "het'),
        ("heterogeneous", constant("sigma_t", '<float name="colour" value="1"/>'),
         UnusedParameterError, "colour"),
        ("homogeneous", '<volume name="albedo" type="gird"/>', UnknownKindError, "gird"),
        ("homogeneous", blend(blend(grid("weight", "a.vol"))), SceneError, "own blendphase"),
        ("homogeneous", grid("albedo", "none.vol"), SceneError, "no file 'none.vol'"),
        ("homogeneous", grid("albedo", "a.vol", AROUND.replace("2", "1e-4")), SceneError,
         "too fine"),
    ],
)  # fmt: skip
def test_errors_name_the_volume(medium, kind, inner, error, message):
    with pytest.raises(error, match=message):
        medium(kind, inner)


def test_a_grid_is_a_texture_of_surfaces(tmp_path):
    write_grid(tmp_path / "a.vol", NUMBERS)
    path = tmp_path / "scene.xml"
    more = '<string name="wrap_mode" value="mirror"/><transform name="to_world">'
    more += '<scale value="2"/></transform>'
    texture = f'<texture name="reflectance" type="volume">{grid("volume", "a.vol", more)}</texture>'
    path.write_text(
        f'<scene version="3.0.0"><shape type="cube"><bsdf type="diffuse">{texture}</bsdf></shape>'
        "</scene>"
    )
    voxels = clpt.load(path).shapes[0].material.reflectance
    assert isinstance(voxels, Voxels) and (voxels.wrap, voxels.filter) == ("mirror", "trilinear")
    np.testing.assert_allclose(voxels.to_texture, np.diag([0.5, 0.5, 0.5, 1.0]))
    np.testing.assert_array_equal(voxels.values[..., 0], NUMBERS)


COLUMNS = """<scene version="3.0.0">
<integrator type="volpathmis"><integer name="max_depth" value="2"/></integrator>
<sensor type="orthographic"><transform name="to_world">
<lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
<rfilter type="box"/></film></sensor>
<emitter type="directional"><vector name="direction" value="0,0,-1"/>
<float name="irradiance" value="1"/></emitter>
<shape type="cube"><bsdf type="null"/><medium name="interior" type="heterogeneous">%s
</medium></shape></scene>"""


def test_density_and_albedo_are_each_trilinear(tmp_path):
    """One collision, light along the view: a (1 - exp(-2 d L)) / (8 pi), where both are linear."""
    write_grid(tmp_path / "d.vol", np.array([0.1, 2.0]).reshape(2, 1, 1))
    write_grid(tmp_path / "a.vol", np.array([0.95, 0.1]).reshape(2, 1, 1))
    path = tmp_path / "scene.xml"
    path.write_text(COLUMNS % (grid("sigma_t", "d.vol") + grid("albedo", "a.vol")))
    images = exposures(with_film(clpt.load(path), mode="rgb"), 16, 256)
    fine = np.clip((np.arange(16 * 64) + 0.5) / 512 - 0.5, 0.0, 1.0)
    density, albedo = 0.1 + 1.9 * fine, 0.95 - 0.85 * fine
    exact = (albedo * -np.expm1(-4.0 * density) / (8.0 * np.pi)).reshape(16, 64).mean(axis=1)
    columns = images.mean(axis=1, keepdims=True)
    assert_agree(columns, np.broadcast_to(exact[:, None], (1, 1, 16, 3)), allowed=2e-3)
    assert_mean(images, [exact.mean()] * 3, 0.01)


BESIDE = {
    "even_box": ("heterogeneous", constant("sigma_t") + constant("albedo")),
    "albedo": ("homogeneous", '<float name="sigma_t" value="1.5"/>' + grid("albedo", "c.vol", "")),
    "both": ("heterogeneous", grid("sigma_t", "a.vol") + grid("albedo", "fine.vol", "")
             + '<float name="scale" value="4"/>'),
    "colours": ("heterogeneous", grid("sigma_t", "c.vol") + grid("albedo", "fine.vol")
                + '<float name="scale" value="4"/>'),
    "blend": ("homogeneous", '<float name="sigma_t" value="1.5"/>'
              + blend(grid("weight", "a.vol"))),
    "dense_blend": ("heterogeneous", grid("sigma_t", "b.vol") + blend(grid("weight", "fine.vol"))
                    + '<float name="scale" value="4"/>'),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize("name", BESIDE)
def test_beside_mitsuba(written, name):
    path = written(*BESIDE[name])
    theirs = blocks(mitsubas(path, 16, 64))
    ours = blocks(exposures(with_film(clpt.load(path), mode="rgb"), 16, 128))
    assert_agree(ours, theirs, name, 0.01)


def test_negative_numbers_of_a_grid_count_as_0(written, tmp_path):
    write_grid(tmp_path / "n.vol", NUMBERS - 0.2)
    scene = clpt.load(written("heterogeneous", grid("sigma_t", "n.vol")))
    density = scene.shapes[-1].interior.density
    values = density.values if hasattr(density, "values") else density
    assert values.min() == 0.0 and values.max() > 0.0
    assert any("negative somewhere" in text for text in scene.warnings)
