"""Wrong arguments of public functions: the message says what is wrong, and names the cure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError, UnknownKindError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.options import RenderOptions
from clpt.scene import Film, Scene, cameras, integrators, lights, materials, shapes
from clpt.spectra import illuminant

SCENE = Scene(camera=cameras.Perspective(), film=Film(width=4, height=4, mode="rgb"))


class Mesh:
    vertices, faces = np.zeros((3, 3)), np.zeros((1, 3))


def test_a_renderer_reads_no_file() -> None:
    message = r"must be a clpt\.Scene, not 'scenes/x'; clpt\.load\('scenes/x'\) reads one"
    with pytest.raises(TypeError, match=message):
        clpt.Renderer("scenes/x")  # type: ignore[arg-type]


@pytest.mark.parametrize("function", [clpt.render, clpt.Renderer])
@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (3, r"must be a clpt\.Scene, not int; clpt\.load"),
        (Scene, r"must be a clpt\.Scene, not type"),
    ],
)
def test_what_is_no_scene(function: Any, scene: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        function(scene)


@pytest.mark.parametrize("function", [clpt.render, clpt.Renderer])
@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"width": 4}, TypeError, r"film's: .*dataclasses\.replace\(scene\.film, width=\.\.\)"),
        ({"seed": 1}, TypeError, r"no option 'seed'; it is the scene's: scene\.seed = \.\."),
        ({"max_depth": 4}, TypeError, r"replace\(scene\.integrator, max_depth=\.\.\)"),
        ({"widht": 4}, TypeError, "no option 'widht'; did you mean 'width'; it is the film's"),
        ({"max_dept": 4}, TypeError, "did you mean 'max_depth'; it is the integrator's"),
        ({"layuot": "wide8"}, TypeError, "no option 'layuot'; did you mean 'layout'"),
        ({"queue": 1}, TypeError, r"a pyopencl\.CommandQueue, not int; .* device=1"),
        ({"layout": "wide9"}, UnknownKindError, "unknown layout 'wide9'; did you mean 'wide8'"),
        ({"cancel_seconds": 0}, SceneError, "seconds above 0"),
        ({"programs": "all"}, UnknownKindError, "unknown programs 'all'"),
        ({"tree_quality": "best"}, UnknownKindError, "unknown quality 'best'"),
        ({"queued": "no"}, SceneError, "queued: must be true or false, not 'no'"),
        ({"slots": 0}, SceneError, "slots: must be a whole number above zero, not 0"),
        ({"slots": 1.5}, SceneError, "slots: must be a whole number above zero"),
        ({"texture_budget": -1}, SceneError, "texture_budget: must be a whole number from 0"),
    ],
)
def test_options(function: Any, options: dict[str, Any], error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        function(SCENE, **options)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"size": 4}, r"^film\.size: must be \(width, height\), not 4$"),
        ({"size": (0, 4)}, r"^film\.width: must be a whole number from 1 to 65536, not 0$"),
        ({"mode": "rbg"}, r"^film\.mode: 'rbg' is none of spectral, rgb"),
        ({"camera": "front"}, r"^camera: must be a camera or \(azimuth, elevation\).* not 'front'"),
        ({"camera": (1, 2, 3, 4)}, r"^camera: must be a camera or \(azimuth, elevation\)"),
        ({"env": "no.hdr"}, r"no\.hdr: no such image"),
        ({"spp": 0}, "whole number above zero, not 0"),
        ({"noise": -1}, r"^noise: must be a number above zero"),
    ],
)
def test_changes_of_a_scene_by_render(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        clpt.render(SCENE, **given)


def test_a_renderer_has_no_size() -> None:
    with pytest.raises(TypeError, match=r"no option 'size'; it is the film's: scene\.film = "):
        clpt.Renderer(SCENE, size=(4, 4))  # type: ignore[call-arg]


def test_render_reads_a_file_and_changes_what_is_asked(tmp_path: Any, one_context: None) -> None:
    clpt.save(SCENE, tmp_path / "white.json")
    picture = clpt.render(tmp_path / "white.json", 1, size=(6, 3), camera=(30.0, 20.0))
    assert picture.shape == (3, 6, 3)
    clpt.save(Scene(camera=SCENE.camera, film=SCENE.film), tmp_path / "scene.json")
    assert clpt.render(str(tmp_path), 1).shape == (4, 4, 3)


def test_all_options_are_described() -> None:
    for name in RenderOptions.__annotations__:
        assert f"{name}: " in (RenderOptions.__doc__ or ""), name


@pytest.fixture(scope="module")
def renderer(one_context: None) -> clpt.Renderer:
    return clpt.Renderer(SCENE)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"camera": 1}, SceneError, r"camera: must be a camera, such as .*Perspective, not 1"),
        ({"scene": "x"}, TypeError, r"clpt\.load\('x'\)"),
        ({"materials": materials.Diffuse()}, SceneError, r"materials: must be a dict by shape"),
        ({"transforms": np.eye(4)}, SceneError, r"transforms=\{scene\.shapes\[0\]: \.\.\}"),
    ],
)
def test_update(renderer: clpt.Renderer, change: Any, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        renderer.update(**change)
    assert renderer.scene is SCENE


@pytest.mark.parametrize("cls", [clpt.Accel, clpt.InstancedAccel])
def test_an_accel_needs_a_queue(cls: type) -> None:
    with pytest.raises(TypeError, match=r"first argument is a pyopencl\.CommandQueue, not int"):
        cls(1)
    with pytest.raises(TypeError, match=rf"{cls.__name__}\(queue, mesh\.vertices, mesh\.faces\)"):
        cls(Mesh())


def test_a_name_of_light() -> None:
    assert lights.Constant(radiance="D65").radiance == illuminant("D65")
    with pytest.raises(SceneError, match="red"):
        lights.Constant(radiance="red")


@pytest.mark.parametrize(("depth", "told"), [(-1, False), (4000, False), (4001, True)])
def test_the_longest_path_is_limited_with_a_word(depth: int, told: bool) -> None:
    scene = Scene(camera=cameras.Perspective(), integrator=integrators.Path(max_depth=depth))
    lowered = lower(scene)
    assert lowered.settings["max_depth"] == 4000
    expected = "integrator.max_depth: 4001 counts as 4000, the longest path"
    assert (expected in lowered.warnings) == told


@pytest.mark.parametrize(("depth", "told"), [(66, True), (65, False), (-1, False)])
def test_the_longest_path_with_photons_is_limited_with_a_word(depth: int, told: bool) -> None:
    """Scattering in dense media goes on beyond it, so the picture is darker than by `path`."""
    lamp = shapes.Rectangle(emission=lights.Area(radiance=1.0))
    scene = Scene(
        camera=cameras.Perspective(), shapes=[lamp], integrator=integrators.Vcm(max_depth=depth)
    )
    lowered = lower(scene)
    assert lowered.settings["max_depth"] == 65
    expected = "integrator.max_depth: 66 counts as 65, the longest path"
    assert (expected in lowered.warnings) == told


@pytest.mark.parametrize(
    ("name", "meant"),
    [("sise", "size"), ("mod", "mode"), ("camra", "camera"), ("ssp", "spp"), ("devise", "device")],
)
def test_an_option_of_render_is_found_by_a_wrong_name(name: str, meant: str) -> None:
    """Those of the picture too, of a scene and of a file."""
    for scene in (SCENE, "scenes/cornell_box"):
        with pytest.raises(TypeError, match=f"no option {name!r}; did you mean {meant!r}"):
            clpt.render(scene, **{name: 1})
