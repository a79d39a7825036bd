"""Renders without most of their noise: what is asked of the scene, what files hold and say."""

from __future__ import annotations

import dataclasses
import json
import sys

import numpy as np
import pytest

import clpt
from clpt import images
from clpt.__main__ import run
from clpt.denoise import needs
from clpt.errors import SceneError, UnknownKindError
from clpt.scene.integrators import (
    Auto,
    Film,
    Gaussian,
    Independent,
    ParticleTracer,
    Path,
    Sobol,
    Vcm,
    Whitted,
    Zsobol,
)

SCENE = "scenes/cornell_box"
SIZE = {"width": 32, "height": 32}


@pytest.fixture(scope="module")
def box() -> clpt.Scene:
    scene = clpt.load(SCENE)
    scene.integrator = Path(light_paths=0)
    scene.film = Film(**SIZE, filter=Gaussian())
    return scene


def grain(image) -> float:
    """How much neighbours differ on the floor, without slopes."""
    return float(np.std(np.diff(image[26:, 8:24, 1], n=2)))


@pytest.fixture(scope="module")
def rendered(box):
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    with clpt.Renderer(box, denoise="oidn") as renderer:
        renderer.run(4)
        yield renderer


def test_the_scene_gets_what_denoisers_want(box):
    film = needs.prepared(box, "oidn").film
    assert film.layers == needs.LAYERS and film.filtering == "importance"
    again = needs.prepared(needs.prepared(box, "oidn"), "oidn").film
    assert (again.layers, again.filtering) == (film.layers, film.filtering)


def test_what_the_scene_asks_for_stays(box):
    own = dataclasses.replace(box.film, layers=("depth",), filtering="splatting")
    film = needs.prepared(dataclasses.replace(box, film=own), "oidn").film
    assert film.layers == ("depth", *needs.LAYERS) and film.filtering == "splatting"


@pytest.mark.parametrize("integrator", [Whitted(), ParticleTracer()])
def test_integrators_without_layers_are_denoised_without(box, integrator):
    assert needs.prepared(dataclasses.replace(box, integrator=integrator), "oidn").film.layers == ()


@pytest.mark.parametrize(
    "integrator, splats, words",
    [(Path(), False, ()), (Path(), True, ("importance",)), (Vcm(), False, ("vcm",)),
     (Vcm(merging=False), False, ()), (ParticleTracer(), True, ("importance", "layers"))],
)  # fmt: skip
def test_correlated_pixels_are_remarked(box, integrator, splats, words):
    found = needs.remarks(integrator, box.sampler, splats)
    assert len(found) == len(words) and all(a in b for a, b in zip(words, found, strict=True))


def test_a_sampler_that_shapes_noise_is_remarked():
    assert "zsobol" in needs.remarks(Path(), Zsobol(), False)[0]


def test_an_unknown_denoiser_is_refused(box):
    with pytest.raises(UnknownKindError, match="oidn"):
        clpt.Renderer(box, denoise="oidm")


def test_the_option_is_not_paid_for_without(box):
    """Without the option a scene is rendered as it is."""
    with clpt.Renderer(box) as renderer:
        assert renderer.scene is box and renderer.denoise is None


def test_a_renderer_returns_its_picture_denoised(rendered):
    noisy, made = rendered.image(), rendered.denoised()
    assert made.shape == noisy.shape and made.dtype == np.float32
    assert grain(made) < grain(noisy) / 2
    np.testing.assert_allclose(made.mean(), noisy.mean(), rtol=0.05)
    np.testing.assert_array_equal(rendered.image(), noisy)  # which stays


def test_a_denoised_picture_has_the_noisy_one_beside_it(rendered):
    made = clpt.DenoisedPicture(rendered)
    np.testing.assert_array_equal(made.noisy(), rendered.colours())
    np.testing.assert_array_equal(made.colours(), made.image())
    assert made.text.startswith("oidn 2.") and "denoising_normal" in made.text


def test_another_scene_is_prepared_too(box):
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    with clpt.Renderer(box, denoise="oidn") as renderer:
        other = dataclasses.replace(box, seed=5)
        renderer.update(scene=other)
        assert renderer.scene.film.layers == needs.LAYERS and renderer.scene.seed == 5


def test_files_hold_both_pictures_and_say_so(tmp_path, capsys):
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    exr, png, film = (tmp_path / f"a{suffix}" for suffix in (".exr", ".png", ".film"))
    size = ["--size", "32x32", "--spp", "4", "--light-paths", "0", "--integrator", "path"]
    paths = ["-o", str(exr), "-o", str(png), "-o", str(film)]
    assert run(["render", SCENE, *size, *paths, "--denoise", "oidn", "--quiet"]) == 0
    channels = images.read_layers(exr)
    noisy = np.stack([channels[f"noisy.{c}"] for c in "RGB"], axis=2)
    picture = images.read(exr)
    assert grain(picture) < grain(noisy) / 2
    assert images.attributes(exr)["denoised"].startswith("oidn")
    assert images.png_text(png)["denoised"].startswith("oidn")
    for path in (exr, png):
        assert run(["info", str(path), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["denoised"].startswith("oidn")
    again = tmp_path / "b.exr"
    assert run(["merge", str(film), "-o", str(again), "--denoise", "oidn", "--quiet"]) == 0
    np.testing.assert_allclose(images.read(again), picture, rtol=0.02, atol=1e-3)


def test_bands_are_denoised(tmp_path):
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    path = tmp_path / "a.exr"
    size = ["--size", "32x32", "--spp", "4", "--light-paths", "0", "--integrator", "path"]
    given = ["render", SCENE, *size, "--bands", "4", "-o", str(path), "--quiet"]
    assert run([*given, "--denoise", "oidn"]) == 0
    made = clpt.read_spectral(path).values
    assert "noisy.R" in images.read_layers(path)
    assert run(given) == 0
    noisy = clpt.read_spectral(path).values
    assert grain(made) < grain(noisy) / 2


@pytest.fixture(scope="module")
def statistical(box):
    with clpt.Renderer(box, denoise="statistical") as renderer:
        with pytest.raises(SceneError, match="two samples"):
            renderer.denoised()
        renderer.run(8)
        yield renderer


def test_the_statistical_denoiser_needs_no_package(statistical, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    made = clpt.DenoisedPicture(statistical)
    assert grain(made.image()) < grain(statistical.image()) / 2
    assert made.text.startswith("statistical with") and made.error.shape == (32, 32)


@pytest.mark.slow
@pytest.mark.parametrize("sampler", [Sobol(), Independent()])
def test_the_told_error_is_that_beside_a_reference(sampler):
    """The root of the mean square over a picture is within 40 % of the true one, but for the worst
    hundredth of pixels: these have light that no sample has seen."""
    scene = clpt.load(SCENE)
    scene.film = dataclasses.replace(scene.film, width=128, height=128, mode="rgb", bands=0)
    scene.integrator, scene.sampler = Path(light_paths=0), sampler
    with clpt.Renderer(dataclasses.replace(scene, seed=9), denoise="statistical") as renderer:
        renderer.run(2048)
        truth = renderer.colours().astype(float)
    with clpt.Renderer(scene, denoise="statistical") as renderer:
        for samples in (16, 48):
            renderer.run(samples)
            made = clpt.DenoisedPicture(renderer)
            wrong = np.mean((made.colours() - truth) ** 2, axis=2)
            light = made.colours().mean(axis=2) ** 2 + (0.1 * truth.mean()) ** 2
            both = (np.square(made.error), wrong / light)
            told, true = (
                np.sqrt(np.sort(each.ravel())[: -each.size // 100].mean()) for each in both
            )
            assert 0.7 < told / true < 1.4, (samples, told, true)


def test_the_picture_of_a_film_is_denoised_alike(statistical):
    """A film in a file has its halves, and no device of its own."""
    made = statistical.saved_film()
    for one, other in zip(made.halves(), statistical.halves(), strict=True):
        np.testing.assert_array_equal(one, other)
    denoised = clpt.DenoisedPicture(made, "statistical").image()
    np.testing.assert_array_equal(denoised, statistical.denoised())


def test_several_devices_make_the_same_picture(box, statistical):
    with clpt.MultiRenderer(box, [0], denoise="statistical") as renderer:
        assert renderer.scene.film.layers == needs.LAYERS
        renderer.run(8)
        np.testing.assert_allclose(renderer.denoised(), statistical.denoised(), rtol=1e-4)


def test_halves_are_needed(box):
    with clpt.Renderer(needs.prepared(box, "oidn")) as renderer:
        renderer.run(2)
        with pytest.raises(SceneError, match="halves"):
            renderer.denoised("statistical")


def test_a_denoiser_that_is_not_there_is_told_before_rendering(box, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(SceneError, match="clpt\\[denoise\\]"):
        clpt.Renderer(box, denoise="oidn")


def test_auto_chooses_what_denoises_well(box):
    """`auto` has no photons for a denoiser; without one it stays, and so do other integrators."""
    auto = dataclasses.replace(box, integrator=Auto(max_depth=5))
    chosen = needs.prepared(auto, "statistical").integrator
    assert isinstance(chosen, Path) and chosen.max_depth == 5 and chosen.leaves_choice
    assert needs.prepared(auto, None).integrator is auto.integrator
    for integrator in (Vcm(), Path(light_paths=0.5), ParticleTracer()):
        asked = dataclasses.replace(box, integrator=integrator)
        assert needs.prepared(asked, "oidn").integrator is integrator
