"""Cameras, films, samplers and integrators of PBRT files."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats import load
from clpt.scene import cameras, integrators

LOOK = "LookAt 1 2 3 4 4 9 0.1 1 0\n"


@pytest.fixture
def scene(tmp_path):
    def of(text):
        path = tmp_path / "a.pbrt"
        path.write_text(f'{text}\nWorldBegin\nShape "sphere"')
        return load(path)

    return of


def test_a_gbuffer_has_layers(scene):
    made = scene('ColorSpace "aces2065-1"\nFilm "gbuffer" "string coordinatesystem" "world"')
    assert not made.warnings and made.film.output_space == "aces2065_1"
    assert made.film.layers == ("albedo", "position", "geometric_normal", "shading_normal", "uv")
    assert "in the world, not the camera" in scene('Film "gbuffer"').warnings[0]


def ours(scene, x, y):
    """Origin and direction through a place on the film, as kernels/cameras has them."""
    camera, film = scene.camera, scene.film
    aspect = film.height / film.width
    if isinstance(camera, cameras.Orthographic):
        local = np.array([1.0 - 2.0 * x, (1.0 - 2.0 * y) * aspect, 0.0])
        origin = transforms.transform_points(camera.to_world, local)
        d = transforms.transform_vectors(camera.to_world, [0.0, 0.0, 1.0])
    elif isinstance(camera, cameras.Spherical):
        phi, theta = 2 * np.pi * (0.5 - x), np.pi * y
        d = [np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)]
        d, origin = transforms.transform_vectors(camera.to_world, d), camera.to_world[:3, 3]
    else:
        wide = 2 * np.tan(np.radians(camera.fov) / 2)
        local = [(0.5 - x - camera.offset_x) * wide, (0.5 - y - camera.offset_y) * wide * aspect, 1]
        d, origin = transforms.transform_vectors(camera.to_world, local), camera.to_world[:3, 3]
    return origin, d / np.linalg.norm(d)


def theirs(to_camera, x, y, window, fov=None):
    """The same of pbrt: the film's x and y run over the window, camera space has x to the right."""
    left, right, low, high = window
    at = np.array([left + x * (right - left), high + y * (low - high), 0.0])
    back = np.linalg.inv(to_camera)
    if fov is None:
        d = transforms.transform_vectors(back, [0.0, 0.0, 1.0])
        return transforms.transform_points(back, at), d / np.linalg.norm(d)
    scale = np.tan(np.radians(fov) / 2)
    d = transforms.transform_vectors(back, [at[0] * scale, at[1] * scale, 1.0])
    return back[:3, 3], d / np.linalg.norm(d)


def to_camera(*steps):
    whole = np.eye(4)
    for step in steps:
        whole = whole @ step
    return whole


VIEW = np.linalg.inv(transforms.look_at([1, 2, 3], [4, 4, 9], [0.1, 1, 0]))
MIRROR, SMALL = transforms.scale([-1, 1, 1]), transforms.scale([0.1, 0.1, 0.1])
CAMERAS = [
    ("", '"float fov" 50', (VIEW,), (-2, 2, -1, 1), 50),
    ("Scale -1 1 1\n", '"float fov" 50', (MIRROR, VIEW), (-2, 2, -1, 1), 50),
    ("Scale .1 .1 .1\n", '"float fov" 50', (SMALL, VIEW), (-2, 2, -1, 1), 50),
    ("", '"float frameaspectratio" 0.5', (VIEW,), (-1, 1, -2, 2), 90),
    ("", '"float fov" 30 "float screenwindow" [-.5 1 -1 .2]', (VIEW,), (-0.5, 1, -1, 0.2), 30),
]


@pytest.mark.parametrize(("before", "given", "steps", "window", "fov"), CAMERAS)
def test_pinholes(scene, before, given, steps, window, fov):
    film = 'Film "rgb" "integer xresolution" 64 "integer yresolution" 32\n'
    made = scene(f'{film}{before}{LOOK}Camera "perspective" {given}')
    for x, y in ((0.1, 0.2), (0.9, 0.3), (0.4, 0.8)):
        found, expected = ours(made, x, y), theirs(to_camera(*steps), x, y, window, fov)
        assert np.concatenate(found) == pytest.approx(np.concatenate(expected), abs=1e-6)


@pytest.mark.parametrize("before", ["", "Scale -1 1 1\n"])
def test_orthographic(scene, before):
    film = 'Film "rgb" "integer xresolution" 20 "integer yresolution" 40\n'
    steps = (MIRROR, VIEW) if before else (VIEW,)
    made = scene(f'{film}{before}{LOOK}Camera "orthographic" "float screenwindow" [-1 3 -2 2]')
    for x, y in ((0.1, 0.2), (0.9, 0.3)):
        found, expected = ours(made, x, y), theirs(to_camera(*steps), x, y, (-1, 3, -2, 2))
        assert np.concatenate(found) == pytest.approx(np.concatenate(expected), abs=1e-6)


def test_spherical(scene):
    made = scene(f'{LOOK}Camera "spherical" "string mapping" "equirectangular"')
    for x, y in ((0.1, 0.2), (0.6, 0.3)):
        phi, theta = 2 * np.pi * x, np.pi * y
        d = [np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)]
        expected = transforms.transform_vectors(np.linalg.inv(VIEW), d)
        assert ours(made, x, y)[1] == pytest.approx(expected, abs=1e-6)


def test_lenses_have_the_size_of_their_camera(scene):
    made = scene(
        'Scale 10 10 10\nCamera "perspective" "float lensradius" 0.5 "float focaldistance" 30'
    ).camera
    assert isinstance(made, cameras.ThinLens)
    assert (made.aperture_radius, made.focus_distance) == pytest.approx((0.05, 3.0))


def test_exposure(scene):
    """pbrt's imaging ratio: time times iso / 100."""
    made = scene(
        'Camera "perspective" "float shutteropen" 1 "float shutterclose" 1.25\n'
        'Film "rgb" "float iso" 200 "string sensor" "cie1931" "float whitebalance" 5000'
    )
    assert made.film.exposure == pytest.approx(0.5)
    assert made.film.white_balance == 5000.0
    plain = scene("").film
    assert (plain.exposure, plain.white_balance, plain.width, plain.height) == (
        1,
        "none",
        1280,
        720,
    )
    measured = scene('Film "rgb" "string sensor" "canon_eos_100d"')
    assert measured.film.white_balance == 6500.0
    assert any("canon_eos_100d" in text for text in measured.warnings)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('"float cropwindow" [.25 .5 0 .501]', (25, 0, 25, 26)),
        ('"integer pixelbounds" [10 30 -5 20]', (10, 0, 20, 20)),
        ("", None),
    ],
)
def test_crops(scene, text, expected):
    size = '"integer xresolution" 100 "integer yresolution" 50'
    assert scene(f'Film "rgb" {size} {text}').film.crop == expected
    with pytest.raises(SceneError, match="no pixel is left"):
        scene(f'Film "rgb" {size} "float cropwindow" [.5 .5 0 1]')


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('"box" "float xradius" 1 "float yradius" 1', integrators.Box(radius=1.0)),
        ('"triangle"', integrators.Tent(radius=2.0)),
        ('"gaussian" "float sigma" 0.4', integrators.Gaussian(stddev=0.4, radius=1.5)),
        ('"mitchell"', integrators.Mitchell()),
        ('"sinc" "float tau" 2.5', integrators.Lanczos(radius=4.0, lobes=2.5)),
        ('"mitchell" "float xradius" 3 "float yradius" 3', integrators.Mitchell(radius=3.0)),
    ],
)
def test_filters(scene, text, expected):
    made = scene(f"PixelFilter {text}").film.filter
    assert type(made) is type(expected) and vars(made) == vars(expected)


@pytest.mark.parametrize("kind", ["bdpt", "mlt", "lightpath"])
def test_what_suits_the_scene_stands_for_others(scene, kind):
    made = scene(f'Integrator "{kind}"')
    (warning,) = made.warnings
    assert kind in warning and "what suits the scene" in warning
    assert type(made.integrator) is integrators.Auto


@pytest.mark.parametrize(
    ("photons", "light_paths"),
    [("", 1), ("-1", 1), ("600", 1), ("1800", 3), ("1000000", 64)],
)
def test_photons_are_those_of_vcm(scene, photons, light_paths):
    """Light paths for each pixel, of 20 x 30."""
    film = 'Film "rgb" "integer xresolution" 20 "integer yresolution" 30\n'
    given = f'"integer photonsperiteration" {photons}' if photons else ""
    made = scene(f'{film}Integrator "sppm" "float radius" 0.25 "integer maxdepth" 7 {given}')
    (warning,) = made.warnings
    assert "sppm" in warning and "passes" in warning
    own = {"max_depth": 8, "free_panes": False, "radius": 0.25, "light_paths": light_paths}
    expected = integrators.Vcm(**own)
    assert type(made.integrator) is integrators.Vcm
    assert vars(made.integrator) == vars(expected)


def test_a_radius_that_is_not_given_suits_the_picture(scene):
    assert scene('Integrator "sppm"').integrator.radius == 0.0
    with pytest.raises(SceneError, match=r"a.pbrt:1: .*radius.*must be positive"):
        scene('Integrator "sppm" "float radius" 0')


def test_a_lens_of_surfaces(scene, tmp_path):
    (tmp_path / "a.dat").write_text("0 1 0 8\n60 4 1.6 20\n-60 1 1.0 20\n")
    text = 'Scale 0.5 0.5 0.5\nCamera "realistic" "string lensfile" "a.dat"'
    film = '\nFilm "rgb" "integer xresolution" 40 "integer yresolution" 30 "float diagonal" 50'
    made = scene(text + ' "float aperturediameter" 3 "float focusdistance" 2' + film)
    lens = made.camera
    assert lens.prescription.surfaces[0].semi_diameter == 1.5
    assert lens.prescription.surfaces[1].radius == 60.0
    # The scale is of world to camera: what is a metre there is two here.
    np.testing.assert_allclose(
        [lens.film_width, lens.focus_distance, lens.unit], [0.08, 4.0, 2e-3], rtol=1e-12
    )
    assert lens.exposure == "irradiance" and not made.warnings
    made = scene(text + ' "float aperturediameter" 30 "string aperture" "pentagon"')
    assert made.camera.blades == 5 and "above the lens's 8 mm" in made.warnings[0]
    (tmp_path / "a.dat").write_text("60 4 1.6 20\n-60 1 1.0\n")
    with pytest.raises(SceneError, match=r"a\.dat:2: a row has 4 numbers"):
        scene(text)


def test_samplers_and_integrators(scene):
    made = scene('Sampler "stratified" "integer xsamples" 3 "integer ysamples" 5\nOption "seed" 7')
    assert (made.spp, made.seed, type(made.sampler)) == (15, 7, integrators.Sobol)
    made = scene('Sampler "independent" "integer pixelsamples" 9')
    assert (made.spp, type(made.sampler)) == (9, integrators.Sobol)
    assert made.extra["sampler"] == "independent"
    assert made.integrator.max_depth == 6
    long = scene('Integrator "volpath" "integer maxdepth" 65').integrator
    assert long.max_depth == 66 and long.free_panes
    assert not scene('Integrator "path" "integer maxdepth" 6').integrator.free_panes


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('Camera "realistic"', "needs a 'lensfile'"),
        ('Camera "perspective" "float fov" 180', "between 0 and 180"),
        ('Camera "perspective" "float shutterclose" 0', "does not open"),
        ('Camera "fisheye"', "unknown camera"),
        ('Film "rgb" "integer xresolution" 0', "must be a whole number from 1 to 65536"),
        ('PixelFilter "boks"', "did you mean 'box'"),
        ('Sampler "random"', "unknown sampler"),
        ('Integrator "ao"', "use 'path'"),
        ('Integrator "path" "integer maxdepth" 1.5', "whole numbers"),
        ("Scale 0 0 0\nCamera \"perspective\"", "cannot be inverted"),
    ],
)  # fmt: skip
def test_broken_ones_say_where(scene, text, message):
    with pytest.raises(SceneError, match=message) as caught:
        scene(text)
    assert "a.pbrt:" in str(caught.value)
