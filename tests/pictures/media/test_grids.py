"""Media with a density on a grid: exact transmittance, furnaces, and what a homogeneous one does.

Significance as in tests/pictures/support.py. All quick tests in RGB mode share their kernels.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl.array as cl_array
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.formats.volumes import VOL_HEADER
from clpt.render.media import grids
from clpt.scene import Film, Scene, media
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import Box, ParticleTracer
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Constant, Directional, Envmap, Light, Point
from clpt.scene.materials import Diffuse, Null
from clpt.scene.shapes import Cube, Rectangle
from clpt.spectra import uplift
from tests.pictures.support import (
    assert_agree,
    assert_mean,
    exposures,
    pictures_of_parts,
    with_film,
)

CHROMATIC = np.array([0.5, 2.0, 3.0])  # [1/m]
LONG = PathIntegrator(max_depth=-1, rr_depth=1000, light_paths=0)
WITHIN = 0.03  # relative; most of it is noise
TURNED = (
    tf.translate([0.1, -0.2, 0.05])
    @ tf.rotate([1, 2, 3], 40)
    @ tf.scale([2.1, 1.3, 1.7])
    @ tf.translate([-0.5, -0.5, -0.5])
)
RANDOM = np.random.default_rng(5).random((19, 7, 12)) ** 3
RANDOM[8:] *= RANDOM[8:] > 0.4  # some bricks have holes
WEDGE = np.broadcast_to(np.linspace(0.0, 2.0, 9)[:, None, None], (9, 3, 20))


def scene_of(medium: media.Medium, max_depth: int = -1, light: float = 1.0) -> Scene:
    """A box of a medium that a parallel ray from +z goes through, under the same light around."""
    box = tf.scale(2.0)
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0.07, 0.11, 5], [0.15, 0.02, 0], [0, 1, 0]) @ tf.scale(1e-4)
        ),
        shapes=[
            Cube(material=Null(), interior=medium, to_world=box),
            Rectangle(material=Diffuse(), to_world=tf.translate([0, 0, 40])),  # seen by nobody
        ],
        lights=[Constant(radiance=light), Directional(direction=(0, -1, 0), irradiance=0.0)],
        film=Film(width=8, height=8, filter=Box(), mode="rgb"),
        integrator=dataclasses.replace(LONG, max_depth=max_depth),
    )


def optical_depth(
    medium: media.Grid, origin: np.ndarray, to: np.ndarray, values: np.ndarray | None = None
) -> Any:
    """The integral of the density along a line, in float64 by 200,000 steps.

    values: in its place, (nx, ny, nz, ...).
    """
    steps = 200_000
    values = np.asarray(medium.density, float) if values is None else values
    t = (np.arange(steps) + 0.5) / steps
    points = origin + t[:, None] * (to - origin)
    inverse = np.linalg.inv(medium.to_world)
    unit = points @ inverse[:3, :3].T + inverse[:3, 3]
    inside = ((unit >= 0.0) & (unit <= 1.0)).all(axis=1)
    size = np.array(medium.density.shape)
    at = np.clip(unit[inside] * size - 0.5, 0.0, size - 1.0)
    low = np.minimum(at.astype(int), np.maximum(size - 2, 0))
    share = at - low
    sums = np.zeros(values.shape[3:])
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, share, 1.0 - share).prod(axis=1)
        index = np.minimum(low + corner, size - 1)
        sums += np.tensordot(weight, values[tuple(index.T)], 1)
    return sums * np.linalg.norm(to - origin) / steps


@pytest.mark.parametrize("name", ["slab", "wedge", "random"])
def test_transmittance(name: str) -> None:
    """What comes through unscattered is exp(-optical depth), for each colour."""
    density = {"slab": np.full((1, 1, 3), 0.7), "wedge": 0.7 * WEDGE, "random": 3.0 * RANDOM}[name]
    medium = media.Grid(density=density, to_world=TURNED, sigma_t=CHROMATIC, albedo=0.5)
    start, middle = np.array([0.07, 0.11, 5.0]), np.array([0.15, 0.02, 0.0])
    depth = optical_depth(medium, start, 2.0 * middle - start)
    assert 0.5 < depth < 2.0
    got = exposures(scene_of(medium, max_depth=1), 16, 256)
    assert_mean(got, np.exp(-CHROMATIC * depth), 0.08)


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_colours_of_extinction(mode: str) -> None:
    """exp(-optical depth) with colours on the grid, in RGB and for each wavelength, both ways."""
    colours = np.random.default_rng(7).random((*RANDOM.shape, 3)) ** 2
    medium = media.Grid(
        density=3.0 * RANDOM, color_grid=colours, to_world=TURNED, sigma_t=2.0, albedo=0.5
    )
    start, middle = np.array([0.07, 0.11, 5.0]), np.array([0.15, 0.02, 0.0])
    ends = start, 2.0 * middle - start
    depths = 2.0 * optical_depth(medium, *ends, 3.0 * RANDOM[..., None] * colours)
    assert depths.min() > 0.3
    assert np.ptp(depths) > 0.1
    scene = scene_of(medium, max_depth=1)
    if mode == "rgb":
        assert_mean(exposures(scene, 16, 128), np.exp(-depths), 0.08)
        black = dataclasses.replace(medium, albedo=0.0)  # its flights share all collisions
        assert_mean(exposures(scene_of(black), 8, 64), np.exp(-depths), 0.08)
        return
    lambdas = np.linspace(400.0, 700.0, 3 * 16, endpoint=False) + 3.125
    c = uplift(colours).astype(float)[..., None, :] @ np.array([lambdas**2, lambdas, lambdas**0])
    sigmoids = 0.5 + c[..., 0, :] / (2.0 * np.sqrt(1.0 + c[..., 0, :] ** 2))
    curves = 2.0 * optical_depth(medium, *ends, 3.0 * RANDOM[..., None] * sigmoids)
    film = {"mode": "spectral", "bands": 3, "lambda_min": 400.0, "lambda_max": 700.0}
    expected = np.exp(-curves).reshape(3, 16).mean(axis=1)
    scene = with_film(scene, **film)
    scene.lights[0] = Constant(radiance=spectra.Constant(1.0))
    assert_mean(exposures(scene, 16, 256), expected, 0.08)


def test_even_colours_are_one_colour() -> None:
    """Colours that are the same everywhere are those of the medium; both furnaces are white."""
    share = np.broadcast_to(CHROMATIC / 3.0, (*RANDOM.shape, 3))
    given = {"density": 2.0 * RANDOM, "to_world": TURNED}
    coloured = media.Grid(**given, sigma_t=3.0, albedo=0.8, color_grid=share)
    pictures = [
        exposures(scene_of(one), 16, 64).mean(axis=(1, 2), keepdims=True)
        for one in (coloured, media.Grid(**given, sigma_t=CHROMATIC, albedo=0.8))
    ]
    assert_agree(*pictures, "colours on the grid, and one colour", 2e-4)
    colours = np.random.default_rng(8).random((*RANDOM.shape, 3))
    white = media.Grid(**given, sigma_s=4.0, color_grid=colours)
    scene = scene_of(white)
    scene.lights = [Constant(radiance=1.0), scene.lights[1]]
    assert_mean(exposures(scene, 8, 128), 1.0, WITHIN)
    with pytest.raises(SceneError, match="up to 1"):
        media.Grid(**given, color_grid=2.0 * colours)


@pytest.mark.parametrize(
    ("mode", "light"),
    [
        ("rgb", Constant(radiance=1.0)),
        pytest.param("spectral", Constant(radiance=1.0), marks=pytest.mark.slow),
        pytest.param("rgb", Envmap(image=np.ones((4, 8, 3))), marks=pytest.mark.slow),
    ],
    ids=["rgb", "spectral", "rgb_envmap"],
)
def test_furnace(mode: str, light: Light) -> None:
    """What scatters all light cannot be seen under the same light from everywhere."""
    medium = media.Grid(density=4.0 * RANDOM, to_world=TURNED, sigma_s=CHROMATIC)
    scene = with_film(scene_of(medium), mode=mode)
    scene.lights = [light, scene.lights[1]]
    assert_mean(exposures(scene, 8, 128), 1.0, WITHIN)


@pytest.mark.parametrize("albedo", [pytest.param(0.0, marks=pytest.mark.slow), 0.8])
def test_constant_grid_is_homogeneous(albedo: float) -> None:
    given = {"sigma_t": 0.8 * CHROMATIC, "albedo": albedo}
    grid = media.Grid(density=np.full((3, 9, 2), 0.5), to_world=tf.translate([-2.0] * 3)
                      @ tf.scale(4.0), scale=2.0, **given)  # fmt: skip
    pictures = [
        exposures(scene_of(one), 16, 64).mean(axis=(1, 2), keepdims=True)
        for one in (grid, media.Homogeneous(**given))
    ]
    assert_agree(*pictures, "the grid and the homogeneous medium", 2e-4)


def test_light_comes_through() -> None:
    """A floor under a grid, lit from above: exp(-optical depth) of what else it has."""
    medium = media.Grid(density=2.0 * RANDOM, to_world=TURNED, sigma_t=CHROMATIC, albedo=0.5)
    scene = scene_of(medium, max_depth=2, light=0.0)
    scene.shapes[1] = Rectangle(
        material=Diffuse(reflectance=0.5),
        to_world=tf.translate([0, -3, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(9.0),
    )
    scene.lights[1] = Directional(direction=(0, -1, 0), irradiance=np.pi)
    scene.camera = dataclasses.replace(
        scene.camera,
        to_world=tf.look_at([2.8, -2.9, 2.8], [0.1, -3.0, 0.05], [0, 1, 0]) @ tf.scale(1e-4),
    )
    spot = np.array([0.1, -3.0, 0.05])
    depth = optical_depth(medium, spot, spot + np.array([0.0, 6.0, 0.0]))
    assert depth > 0.2
    assert_mean(exposures(scene, 16, 64), 0.5 * np.exp(-CHROMATIC * depth), 0.05, 2e-3)


def assert_same_bricks(renderer: clpt.Renderer, values: np.ndarray) -> None:
    """What kernels make of a density on the device has the words that the host makes of it."""
    scene, stream = renderer._wavefront.scene, renderer._wavefront.stream
    (grid,) = scene.lowered.device_grids
    found = stream.read(scene.tables["images"], np.empty_like(scene.lowered.table("images")))
    host, count = grids.bricks(values), int(np.prod(grid.bricks))
    there, here = (words[: 2 * count].reshape(-1, 2) for words in (found[grid.first :], host))
    assert np.array_equal(there[:, 1], here[:, 1])
    for (begin, _), (own, most) in zip(there, here, strict=True):
        begin += grid.first
        points = found[begin : begin + grids.POINT_WORDS]
        assert np.array_equal(points, host[own : own + len(points)] if most else 0 * points)


def test_bits_and_updates() -> None:
    """The same bits however a render is split, of arrays on the device, and after an update."""
    medium = media.Grid(density=4.0 * RANDOM, to_world=TURNED, sigma_t=CHROMATIC, albedo=0.9)
    scene = scene_of(medium)

    def with_density(density: object) -> Scene:
        own = dataclasses.replace(medium, density=density)
        shapes = [dataclasses.replace(scene.shapes[0], interior=own), scene.shapes[1]]
        return dataclasses.replace(scene, shapes=shapes)

    films = pictures_of_parts(scene)
    assert np.array_equal(*films)
    with clpt.Renderer(with_density(RANDOM)) as renderer:
        renderer.run(2)
        before = renderer.image()
        values = (4.0 * RANDOM).astype(np.float32)
        there = cl_array.to_device(renderer._wavefront.stream.queue, values)
        renderer.update(scene=with_density(there))
        renderer.run(12)
        assert np.array_equal(renderer.image(), films[0])
        assert not np.array_equal(before, films[0])
        assert_same_bricks(renderer, values)
        renderer.update(scene=with_density(values[::-1].copy()))  # the table holds other words
        renderer.update(scene=with_density(values))
        renderer.run(12)
        assert np.array_equal(renderer.image(), films[0])
        there[3] = -1.0
        there[4] = np.nan
        renderer.update(scene=with_density(there))
        values[3:5] = 0.0
        assert_same_bricks(renderer, values)
        there *= 0.0
        renderer.update(scene=with_density(there))
        renderer.run(2)
        assert renderer.image() == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("density", "said"),
    [
        (None, "must be an array"),
        (np.ones((2, 2)), r"\(nx, ny, nz\)"),
        (np.ones((0, 2, 2)), r"\(nx, ny, nz\)"),
        (np.full((2, 2, 2), -0.5), "negative"),
        (np.full((2, 2, 2), np.nan), "not finite"),
        (np.full((2, 2, 2), "a"), "numbers"),
    ],
)
def test_what_is_no_density(density: object, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        media.Grid(density=density, sigma_t=1.0)
    with pytest.raises(SceneError, match="inverse"):
        media.Grid(density=np.ones((2, 2, 2)), to_world=np.diag([1.0, 0.0, 1.0, 1.0]))


MITSUBA = """<scene version="3.0.0">
<integrator type="volpathmis"><integer name="rr_depth" value="1000"/></integrator>
<sensor type="perspective"><float name="fov" value="36"/><transform name="to_world">
<lookat origin="1, 1, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
<rfilter type="box"/></film></sensor>
<shape type="cube"><bsdf type="null"/><medium name="interior" type="heterogeneous">
<volume name="sigma_t" type="gridvolume"><string name="filename" value="density.vol"/>
<boolean name="raw" value="true"/>
<transform name="to_world"><scale value="2"/><translate value="-1, -1, -1"/></transform></volume>
<rgb name="albedo" value="0.9, 0.6, 0.95"/><float name="scale" value="5"/>
<phase type="hg"><float name="g" value="0.6"/></phase></medium></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/>
<translate value="0, -1.2, 0"/></transform></shape>
<emitter type="directional"><vector name="direction" value="0.4, -1, -0.3"/>
<rgb name="irradiance" value="3, 2.5, 2"/></emitter>
<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter></scene>"""


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_against_mitsuba(tmp_path: Path, mode: str) -> None:
    pytest.importorskip("mitsuba")
    from tests.pictures.peers.test_mitsuba import compare

    header = VOL_HEADER.pack(b"VOL", 3, 1, *RANDOM.shape, 1, 0, 0, 0, 1, 1, 1)
    values = np.ascontiguousarray(RANDOM.transpose(2, 1, 0), "<f4").tobytes()
    (tmp_path / "density.vol").write_bytes(header + values)
    path = tmp_path / "scene.xml"
    path.write_text(MITSUBA)
    compare(path, mode, 24, 64, 0.01)


def holed(sigma_t: float) -> media.Grid:
    """A density of one high point in each brick beside empty cells: collisions there are null."""
    values = np.zeros((16, 16, 16), np.float32)
    values[::4, ::4, ::4] = 1e-6
    values[5::8, 5::8, 5::8] = 1.0
    return media.Grid(density=values, sigma_t=sigma_t, albedo=0.99, to_world=TURNED)


@pytest.mark.parametrize("sigma_t", [1e9, 3e38])
@pytest.mark.parametrize("seen", ["flight", "transmittance"])
def test_null_collisions_have_an_end(sigma_t: float, seen: str) -> None:
    """A file cannot keep a kernel busy for hours: the samples of such ways count as rejected."""
    scene = scene_of(holed(sigma_t))
    if seen == "transmittance":  # of rays to a light behind the medium, from a surface beside it
        floor = Rectangle(
            material=Diffuse(), to_world=tf.translate([0, 0, 3]) @ tf.rotate([0, 1, 0], 180)
        )
        behind = Directional(direction=(0.01, 0.02, 1.0), irradiance=1.0)
        scene = dataclasses.replace(
            scene, shapes=[scene.shapes[0], floor], lights=[behind],
            camera=Orthographic(
                to_world=tf.look_at([0.1, 0.1, 2.5], [0.1, 0.1, 3.0], [0, 1, 0]) @ tf.scale(1e-2)
            ),
        )  # fmt: skip
    with clpt.Renderer(with_film(scene, width=2, height=2)) as renderer:
        renderer.run(1)
        assert renderer.counts.rejected == renderer.counts.samples == 4
        assert not renderer.image().any()


def test_light_paths_count_where_null_collisions_end_them() -> None:
    """And nothing counts where none of them is ended."""
    lamp = Point(position=(0.0, 0.0, -4.0))
    for sigma_t, ends in ((1e9, True), (3e4, False)):
        scene = dataclasses.replace(
            scene_of(holed(sigma_t)),
            lights=[lamp],
            camera=Perspective(to_world=tf.look_at([0, 0, 8], [0, 0, 0], [0, 1, 0])),
            integrator=ParticleTracer(),
        )
        with clpt.Renderer(with_film(scene, width=8, height=8)) as renderer:
            renderer.run(8)
            assert 0 <= renderer.counts.rejected <= renderer.counts.samples
            assert (renderer.counts.rejected > 0) == ends


def test_a_dense_grid_with_holes_is_right_below_the_bound() -> None:
    with clpt.Renderer(with_film(scene_of(holed(3e4)), width=8, height=8)) as renderer:
        renderer.run(1)
        assert renderer.counts.rejected == 0 and renderer.image().any()
