"""Pictures through a lens of surfaces, as a scene file, a pinhole and an edit have them."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.formats import load, native
from clpt.lenses import Coat, Prescription, Surface
from clpt.render.flow.scene_to_tables import lower
from clpt.render.scene_index import SceneIndex
from clpt.scene import Film, Scene
from clpt.scene.cameras import Lens, Perspective
from clpt.scene.integrators import Box, Path
from clpt.scene.lights import Area, Constant, Directional, Point
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Sphere

HOLE = Prescription((Surface(0.0, 50.0, semi_diameter=0.02, stop=True),), "a hole")
PLACE = tf.look_at([0.3, 0.2, -1.0], [0.0, 0.0, 5.0], [0.0, 1.0, 0.0])


def scene(camera, **film) -> Scene:
    """Balls under an even sky."""
    rng = np.random.default_rng(2)
    balls = [
        Sphere(
            center=tuple(rng.uniform([-2, -1, 3], [2, 1, 8])),
            radius=0.4,
            material=Diffuse(reflectance=tuple(rng.random(3))),
        )
        for _ in range(12)
    ]
    made = Film(width=48, height=32, filter=Box(), mode="rgb", **film)
    return Scene(camera=camera, shapes=balls, lights=[Constant(radiance=1.0)], film=made)


def test_a_hole_is_a_perspective_camera():
    """Its picture is that of a pinhole 50 mm in front of the film, times cos^4."""
    fov = 2.0 * np.degrees(np.arctan(18.0 / 50.0))
    ours = Lens(lens=HOLE, to_world=PLACE @ tf.translate([0.0, 0.0, -0.05]))
    a, b = (
        clpt.render(scene(camera), spp=64)[..., :3]
        for camera in (Perspective(fov=fov, to_world=PLACE, near=0.0), ours)
    )
    x, y = (((np.arange(n) + 0.5) / n - 0.5) * size for n, size in ((48, 36.0), (32, 24.0)))
    cos4 = (1.0 + (x[None] ** 2 + y[:, None] ** 2) / 2500.0) ** -2.0
    difference = b / cos4[..., None] - a
    assert abs(difference.mean()) < 0.003 and np.median(np.abs(difference)) < 0.02
    assert np.std(a) > 0.1  # what is compared is there


def test_edits_give_the_picture_of_a_new_start():
    first = scene(Lens(focus_distance=6.0))
    second = dataclasses.replace(first, camera=Lens(focus_distance=3.0, f_number=4.0))
    with clpt.Renderer(first) as renderer:
        renderer.run(2)
        renderer.update(camera=second.camera)
        renderer.run(4)
        edited = renderer.image()
    np.testing.assert_array_equal(edited, clpt.render(second, spp=4))


@pytest.mark.slow
def test_edits_take_ghosts_away() -> None:
    """With what the lens loses by them: the film keeps its place for light paths."""
    bare = scene(Lens(focus_distance=6.0))
    with clpt.Renderer(dataclasses.replace(bare, camera=Lens(ghosts=0.5))) as renderer:
        renderer.update(camera=bare.camera)
        renderer.run(4)
        edited = renderer.image()
    np.testing.assert_allclose(edited, clpt.render(bare, spp=4), rtol=1e-4, atol=1e-5)


def test_what_a_scene_needs_of_the_kernels():
    spectral = dataclasses.replace(scene(Lens()), film=Film(width=8, height=8))
    assert lower(spectral).features.camera.disperses and lower(spectral).features.dispersion
    flat = dataclasses.replace(spectral, camera=Lens(lens="fisheye", ghosts=0.1))
    features = lower(flat).features
    assert not features.camera.disperses and features.camera.losses and features.camera.ghosts


def test_scene_files(tmp_path):
    glass = spectra.glass("sf11")
    lens = Prescription(
        (
            Surface(50.0, 3.0, glass, 8.0, -0.4, (1e-6,), (Coat(spectra.Constant(1.38), 99.0),)),
            Surface(0.0, 2.0, semi_diameter=8.0),
            Surface(0.0, 0.0, semi_diameter=6.0, stop=True),
        ),
        "one",
        "mine",
    )
    camera = Lens(lens=lens, blades=7, coating="multi", unit=2e-3)
    native.save(scene(camera), tmp_path / "scene.json")
    again = load(tmp_path / "scene.json").camera
    assert isinstance(again, Lens) and again.blades == 7 and again.unit == 2e-3
    for a, b in zip(again.prescription.surfaces, lens.surfaces, strict=True):
        assert dataclasses.astuple(a) == dataclasses.astuple(b)
    text = json.loads((tmp_path / "scene.json").read_text())
    (tmp_path / "a.dat").write_text("0 1 0 8\n60 4 1.6 20\n-60 1 1.0 20\n")
    for value, stop in (("planar", 6), ("a.dat", 0)):
        text["camera"]["lens"] = value
        (tmp_path / "b.json").write_text(json.dumps(text))
        assert load(tmp_path / "b.json").camera.prescription.stop == stop


@pytest.mark.parametrize(
    ("lens", "message"),
    [
        ("planer", r"scene\.json:5: camera\.lens: unknown lens 'planer'; did you mean 'planar'"),
        ("no.dat", r"no\.dat"),
        ({"surfaces": []}, r"1 to 100 surfaces"),
        ({"surfaces": [{"radius": 3}]}, r"surfaces\[0\]: needs the parameter 'semi_diameter'"),
        ({"surfaces": [{"semi_diameter": 1, "radios": 1}]}, "no parameter 'radios'"),
        ({"surfaces": [{"semi_diameter": 9, "radius": 1}]}, "cannot reach"),
        ({"surfaces": [{"semi_diameter": 9, "glass": [1.5, 1.0]}]}, "Abbe number lies"),
    ],
)
def test_broken_scene_files(tmp_path, lens, message):
    text = json.dumps({"camera": {"type": "lens", "blades": 5, "lens": lens}}, indent=1)
    (tmp_path / "scene.json").write_text(text)
    with pytest.raises(SceneError, match=message):
        load(tmp_path / "scene.json")


@pytest.mark.slow
def test_ghosts_of_lamps_that_no_ray_meets() -> None:
    """A plate in front of a film returns light twice: (1 - R)^2 R^2 of it, from any lamp."""
    n = 4.0
    r = ((n - 1.0) / (n + 1.0)) ** 2
    made = Prescription(
        (
            Surface(0.0, 2.0, spectra.Constant(n), 40.0),
            Surface(0.0, 1.0, semi_diameter=40.0),
            Surface(0.0, 3.0, semi_diameter=40.0, stop=True),
        )
    )
    camera = Lens(lens=made, film_width=0.05, ghosts=0.5, exposure="irradiance")
    ahead = Directional(direction=(0.0, 0.0, -1.0), irradiance=1.0)
    near = Point(position=(0.0, 0.0, 1.0), intensity=1.0)
    film = Film(width=16, height=16, filter=Box(), mode="rgb")
    whole = Scene(camera=camera, lights=[ahead, near], film=film, integrator=Path())
    assert clpt.render(whole, spp=256)[..., :3].mean() == pytest.approx(
        2.0 * (1.0 - r) ** 2 * r * r, rel=0.02
    )
    bare = dataclasses.replace(camera, ghosts=0.0)
    with clpt.Renderer(whole) as renderer:  # ghosts go and come back by edits
        renderer.run(4)
        renderer.update(camera=bare)
        renderer.run(4)
        assert not renderer.image()[..., :3].any()
        renderer.update(camera=camera)
        renderer.run(4)
        np.testing.assert_array_equal(renderer.image(), clpt.render(whole, spp=4))
    with clpt.Renderer(dataclasses.replace(whole, camera=bare)) as renderer:
        renderer.update(camera=camera)
        renderer.run(4)
        assert not renderer.image()[..., :3].any()  # its film has no place for light paths
    hidden = dataclasses.replace(whole, integrator=Path(hide_lights=True))
    assert not clpt.render(hidden, spp=1)[..., :3].any()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("lit", ["lamp", "sky"])
def test_light_paths_find_the_ghosts_of_rays(
    lit: str, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A z-test of blocks, at 5, against ghosts from the film on, of a double Gauss without films:
    of a lamp beside the picture, and of an even sky."""
    lamp = Sphere(center=(1.5, 0.4, 2.0), radius=0.6, emission=Area(radiance=50.0))
    whole = Scene(
        camera=Lens(film_width=0.036, focus_distance=2.5, f_number=2.8, ghosts=0.7),
        shapes=[lamp] if lit == "lamp" else [],
        lights=[] if lit == "lamp" else [Constant(radiance=1.0)],
        film=Film(width=32, height=32, filter=Box(), mode=mode),
        integrator=Path(max_depth=2),
    )
    means, errors = [], []
    for by_rays in (False, True):
        if by_rays:
            monkeypatch.setattr(SceneIndex, "lit_ghosts", False)
        assert lower(whole).features.transport.weighed != by_rays
        found = [
            clpt.render(dataclasses.replace(whole, seed=8 * by_rays + i), spp=2048)
            for i in range(8)
        ]
        blocks = np.array(found)[..., :3].mean(axis=-1).reshape(8, 4, 8, 4, 8).mean(axis=(2, 4))
        means.append(blocks.mean(axis=0))
        errors.append(blocks.var(axis=0, ddof=1) / 8)
    assert (means[0] > 0).all()
    z = (means[0] - means[1]) / np.sqrt(errors[0] + errors[1])
    assert np.abs(z).max() < 5.0
