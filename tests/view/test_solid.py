"""The preview in plain colours: what is in it, when it is shown, and that kernels are its own."""

from __future__ import annotations

import dataclasses
import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clpt import device
from clpt.device.context import Builds
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.renderer import Renderer
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import Blend, Conductor, Dielectric, Diffuse, Mask, Null, Plastic
from clpt.scene.media import Homogeneous
from clpt.scene.shapes import Cube, Group, Instance, Mesh, Rectangle
from clpt.scene.textures import Bitmap, Checkerboard
from clpt.transforms import look_at, scale
from clpt.view import beginning
from clpt.view.beginning import SAMPLES, Making, colour, shaded, solid
from clpt.view.pictures import Display
from clpt.view.render_loop import RenderLoop
from clpt.view.target import Change
from tests.view.test_session import Audience, small

LONG = 300.0  # [s], of what always comes
TRIANGLE = {"vertices": [[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}


def test_the_colour_of_a_material_is_the_mean_of_its_colours() -> None:
    red, green = Diffuse(reflectance=(0.8, 0.0, 0.0)), Plastic(diffuse_reflectance=(0.0, 0.4, 0.0))
    image = np.zeros((300, 200, 3), np.float32)
    image[:150] = 0.5
    assert np.allclose(colour(red), (0.8, 0.0, 0.0))
    assert np.allclose(colour(Mask(material=red, opacity=0.2)), (0.8, 0.0, 0.0))
    assert np.allclose(colour(Blend(first=red, second=green)), (0.4, 0.2, 0.0))
    assert np.allclose(colour(Diffuse(reflectance=Bitmap(image=image))), 0.25, atol=0.01)
    checks = Checkerboard(color0=(0.2, 0.2, 0.2), color1=(0.6, 0.6, 0.6))
    assert np.allclose(colour(Diffuse(reflectance=checks)), 0.4)
    assert np.all((colour(Conductor()) > 0.0) & (colour(Dielectric()) > 0.0))


def furnished(**more: Any) -> Scene:
    """Return a scene of one mesh, seen from +z, with what a scene of meshes may have."""
    camera = Perspective(to_world=look_at([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    film = Film(width=16, height=16)
    return Scene(camera=camera, film=film, **more)


def test_kernels_of_a_preview_are_those_of_other_scenes() -> None:
    """Materials, textures, lights, media and groups change its tables, and nothing in its texts."""
    texture = Bitmap(image=np.ones((4, 4, 3), np.float32))
    uvs = [[0, 0], [1, 0], [0, 1]]
    plain = furnished(shapes=[Mesh(**TRIANGLE)], lights=[Constant()])
    rich = furnished(
        shapes=[
            Mesh(**TRIANGLE, uvs=uvs, material=Diffuse(reflectance=texture)),
            Mesh(**TRIANGLE, material=Dielectric(), interior=Homogeneous(sigma_s=1.0)),
            Mesh(**TRIANGLE, material=Null(), interior=Homogeneous(sigma_s=1.0)),
            Mesh(**TRIANGLE, emission=Area(radiance=5.0)),
        ],
        noise=0.1,
    )
    assert len(solid(rich).shapes) == 3
    one, other = (lower(solid(scene)).features for scene in (plain, rich))
    assert one == other
    smoke = Cube(material=Null(), interior=Homogeneous(sigma_s=1.0))
    group = Group(shapes=[Cube(material=Dielectric()), smoke])
    placed = solid(furnished(shapes=[Instance(group=group), Instance(group=group)], lights=[]))
    assert placed.shapes[0].group is placed.shapes[1].group
    (cube,) = placed.shapes[0].group.shapes
    assert isinstance(cube.material, Diffuse)


def test_a_preview_shows_colours_lit_from_the_camera() -> None:
    wall = Rectangle(to_world=scale(1.0), material=Diffuse(reflectance=(0.9, 0.1, 0.1)))
    with Renderer(solid(furnished(shapes=[wall], lights=[])), device.choose()) as renderer:
        renderer.run(SAMPLES)
        picture = shaded(renderer).astype(int)
    assert picture.shape == (16, 16, 3)
    red, green, blue = picture[8, 8]
    assert red > 150 and green == blue < red / 2
    assert len(set(picture[0, 0])) == 1 and 0 < picture[0, 0, 0] < 100


def making(make: Any) -> tuple[Making, Builds]:
    builds = Builds()
    return Making(SimpleNamespace(builds=builds), lambda: make(builds)), builds  # type: ignore


def test_what_is_in_caches_is_made_at_once() -> None:
    made, builds = making(lambda _: "renderer")
    made.wait(LONG)
    assert made.is_done and not made.is_new and made.renderer() == "renderer"
    builds.on_new()  # nobody waits any more


def test_what_is_new_waits_until_it_may_be_compiled() -> None:
    def make(builds: Builds) -> Any:
        builds.on_new()
        builds.on_new()
        raise SceneError("what is wrong")

    made, _ = making(make)
    made.wait(LONG)
    assert made.is_new and not made.is_done
    made.go_on()
    with pytest.raises(SceneError, match="what is wrong"):
        made.renderer()


def test_what_is_given_up_is_not_compiled() -> None:
    compiled: list[bool] = []

    def make(builds: Builds) -> Any:
        builds.on_new()
        compiled.append(True)

    made, _ = making(make)
    made.wait(LONG)
    made.give_up()
    assert made.is_done and not compiled


def test_no_camera_of_a_preview_is_in_a_medium(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would have to be compiled for that."""

    def refuse(_: Scene) -> Any:
        raise SceneError("not made")

    noted: list[Change] = []
    monkeypatch.setattr(beginning.Target, "note", lambda _, change: noted.append(change))
    begun = beginning.Beginning(device.choose(), refuse, lambda scene: scene, small())
    camera = Perspective(medium=Homogeneous(sigma_s=1.0), fov=20.0)
    begun.note(Change(camera=camera))
    begun.note(Change(whole=True))
    begun.close()
    moved, whole = noted
    assert moved.camera is not None and moved.camera.medium is None
    assert isinstance(moved.camera, Perspective) and moved.camera.fov == 20.0
    assert whole.camera is None and whole.whole


@pytest.fixture
def gate() -> threading.Event:
    return threading.Event()


def looped(
    monkeypatch: pytest.MonkeyPatch, gate: threading.Event, *, new: bool, make: Any = None
) -> tuple[Any, Any]:
    """Return a loop that begins, and its audience; gate: until which kernels are compiled.

    new: whether they are in no cache; make: makes its renderers, by default as it does itself.
    """
    monkeypatch.setattr(beginning, "PATIENCE", np.inf)
    audience: Any = Audience()
    on = device.choose()
    loop = RenderLoop(small(), on, audience, Display())
    make = make or loop._make

    def slow(scene: Scene, **more: Any) -> Renderer:
        if new:
            on.builds.on_new()
        gate.wait()
        return make(scene, **more)

    loop._make = slow  # type: ignore[method-assign]
    loop.begin_solid()
    return loop, audience


def test_a_preview_is_shown_and_moved_while_kernels_are_compiled(
    monkeypatch: pytest.MonkeyPatch, gate: threading.Event
) -> None:
    loop, audience = looped(monkeypatch, gate, new=True)
    try:
        for moved in range(2):
            while len(audience.frames) == moved:
                loop.advance()
            camera = dataclasses.replace(loop.scene.camera, fov=20.0 + moved)
            loop.begin(dataclasses.replace(loop.scene, camera=camera), Change(camera=camera))
        gate.set()
        while audience.frames[-1][0]["solid"]:
            loop.advance()
    finally:
        gate.set()
        loop.close()
    headers = [header for header, _ in audience.frames]
    assert [header["solid"] for header in headers[:2]] == [True, True]
    assert headers[0]["size"] == headers[-1]["size"] and headers[0]["samples"] == 0
    assert headers[1]["changes"] > headers[0]["changes"]
    assert audience.frames[0][1] != audience.frames[1][1]
    assert headers[-1]["samples"] == 1


def test_no_preview_is_shown_where_nothing_is_compiled(
    monkeypatch: pytest.MonkeyPatch, gate: threading.Event
) -> None:
    gate.set()
    on = device.choose()
    with Renderer(small(), on, cancel_seconds=0.1) as renderer:  # whose programs there are then
        renderer.run(1)
    loop, audience = looped(monkeypatch, gate, new=False)
    try:
        while not audience.frames:
            loop.advance()
    finally:
        loop.close()
    assert not any(header["solid"] for header, _ in audience.frames)


def test_a_scene_that_is_wrong_is_told_as_without_a_preview(
    monkeypatch: pytest.MonkeyPatch, gate: threading.Event
) -> None:
    """The preview fails too, and of that nothing is said."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise SceneError("it cannot be shown")

    gate.set()
    monkeypatch.setattr(beginning, "solid", refuse)
    loop, audience = looped(monkeypatch, gate, new=True, make=refuse)
    try:
        with pytest.raises(SceneError, match="it cannot be shown"):
            while True:
                loop.advance()
    finally:
        loop.close()
    assert not audience.frames
