"""Openings of rooms: where they are, where there are none, and the same light with and without.

Means of pictures are compared; see tests/pictures/support.py for the significance.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import clpt
from clpt import transforms as tf
from clpt.render.flow import find as analysis
from clpt.render.flow.scene_to_tables import lower
from clpt.render.lights import openings
from clpt.render.lights.openings import CLOSED, find
from clpt.scene import Film, Scene, lights
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Integrator, Path, Vcm, Whitted
from clpt.scene.shapes import Mesh, Sphere
from tests.pictures.support import assert_agree, blocks, exposures, quick

ROOM = np.array([4.0, 2.5, 5.0])  # sizes along x, y, z; its floor's corner is the origin
SILL, HEAD, FROM, TO = 0.9, 2.0, 1.5, 3.0  # of a window in the wall at x = 4: along y and z
WINDOW = ((4.0, 1.45, 2.25), 1.1, 1.5)  # centre, height, width
EYE, AHEAD = np.array([1.0, 1.3, 1.0]), np.array([2.0, 0.9, 3.0])
GRAY = m.TwoSided(front=m.Diffuse(reflectance=0.7))


def quad(corner: ArrayLike, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
    """Two triangles (2, 3, 3)."""
    a, x, y = (np.asarray(v, np.float64) for v in (corner, x, y))
    return np.array([[a, a + x, a + x + y], [a, a + x + y, a + y]])


def room(window: bool = True, ceiling: bool = True) -> NDArray[np.float64]:
    """The walls of the room as triangles (n, 3, 3)."""
    x, y, z = np.diag(ROOM)
    walls = [quad(0 * x, x, z), quad(0 * x, y, z), quad(0 * x, x, y), quad(z, x, y)]
    if ceiling:
        walls.append(quad(y, x, z))
    below, above = (0.0, SILL, 0.0, 5.0), (HEAD, 2.5, 0.0, 5.0)
    beside = (SILL, HEAD, 0.0, FROM), (SILL, HEAD, TO, 5.0)
    for low, high, begin, end in (below, above, *beside) if window else [(0.0, 2.5, 0.0, 5.0)]:
        walls.append(quad([4, low, begin], [0, high - low, 0], [0, 0, end - begin]))
    return np.concatenate(walls)


def mesh(triangles: NDArray[np.float64], material: m.Material = GRAY) -> Mesh:
    faces = np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3)
    vertices = triangles.reshape(-1, 3).astype(np.float32)
    return Mesh(vertices=vertices, faces=faces, material=material)


def turned(triangles: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    return tf.transform_points(turn, triangles.reshape(-1, 3)).reshape(-1, 3, 3)


def scene_of(
    *, mode: str = "rgb", integrator: Integrator | None = None, light: lights.Light | None = None
) -> Scene:
    """The room with a ball, seen from its corner, in the light of its window."""
    ball = Sphere(center=(2.0, 0.5, 3.0), radius=0.5, material=m.RoughPlastic(alpha=0.2))
    return Scene(
        camera=Perspective(to_world=tf.look_at(EYE, AHEAD, [0, 1, 0]), fov=60),
        shapes=[mesh(room()), ball],
        lights=[light or lights.Constant(radiance=2.0)],
        film=Film(width=16, height=12, mode=mode),
        integrator=integrator or Path(light_paths=0, max_depth=4),
    )


TURNS = {
    "as it is": np.eye(4),
    "about the vertical": tf.rotate([0, 1, 0], 33.0),
    "about another axis": tf.translate([10, -5, 3]) @ tf.rotate([1, 2, 3], 70.0),
}


@pytest.mark.parametrize("name", TURNS)
def test_a_window_is_found(name: str) -> None:
    turn = TURNS[name]
    eye = np.asarray(tf.transform_points(turn, EYE), np.float64)
    openings = find(turned(room(), turn), eye)
    assert openings.share > 0.6
    largest = max(openings.rectangles, key=lambda r: np.linalg.norm(np.cross(r.x, r.y)))
    center = tf.transform_points(np.linalg.inv(turn), largest.center)
    place, *sides = WINDOW
    assert np.allclose(center, place, atol=0.15)
    halves = sorted(np.linalg.norm([largest.x, largest.y], axis=1))
    assert np.allclose(halves, np.sort(sides) / 2.0, atol=0.15)


def test_no_openings_without_a_room_or_a_window() -> None:
    ground = quad([-50, 0, -50], [0, 0, 100], [100, 0, 0])
    assert find(ground, np.array([0.0, 1.0, 0.0])) is CLOSED
    assert find(room(window=False), EYE) is CLOSED
    assert find(room(ceiling=False), EYE) is CLOSED
    assert find(np.zeros((0, 3, 3)), EYE) is CLOSED
    assert find(np.zeros((4, 3, 3)), EYE) is CLOSED


def test_the_rooms_of_lamps_and_of_panes() -> None:
    scene = scene_of()
    assert lower(scene).features.lights.openings
    lamp = dataclasses.replace(scene, lights=[lights.Point(position=(2, 2, 2))])
    assert not lower(lamp).features.lights.openings
    pane = quad([4.0, SILL, FROM], [0, HEAD - SILL, 0], [0, 0, TO - FROM])
    for free in (True, False):  # rays to lights pass free panes
        glazed = dataclasses.replace(
            scene,
            shapes=[*scene.shapes, mesh(pane, m.ThinDielectric())],
            integrator=Path(light_paths=0, free_panes=free),
        )
        assert lower(glazed).features.lights.openings == free


def test_an_edit_keeps_the_openings() -> None:
    scene = scene_of()
    before = lower(scene)
    edited = dataclasses.replace(scene, shapes=[mesh(room(window=False)), *scene.shapes[1:]])
    after = lower(edited, former=before)
    assert after.openings is before.openings
    assert lower(edited).openings is CLOSED


IMAGE = np.random.default_rng(3).random((16, 32, 3)).astype(np.float32) * 4.0
INFINITE = {
    "constant": lights.Constant(radiance=2.0),
    "envmap": lights.Envmap(image=IMAGE),
    "cube_map": lights.CubeMap(image=np.broadcast_to(IMAGE[:, :16], (6, 16, 16, 3)).copy()),
    "sky": lights.Sky(sun_elevation=20.0),
}
INTEGRATORS: dict[str, Integrator] = {
    "path": Path(light_paths=0, max_depth=4),
    "light paths": Path(light_paths=1, max_depth=4),
    "guided": Path(light_paths=0, guiding=True, guide_paths=1 << 12, max_depth=4),
    "vcm": Vcm(light_paths=1, max_depth=4, radius=0.02),
    "whitted": Whitted(max_depth=4),
}


def both(scene: Scene, what: str, monkeypatch: pytest.MonkeyPatch) -> float:
    """Compare pictures with and without openings; return the ratio of their variances."""
    assert lower(scene).features.lights.openings
    made = exposures(scene, 12, 64)
    monkeypatch.setattr(analysis, "openings_around", lambda *_: CLOSED)
    reference = exposures(scene, 12, 64, first_seed=101)
    assert_agree(blocks(made), blocks(reference), what)
    return float(made.var(axis=0).mean() / reference.var(axis=0).mean())


@pytest.mark.parametrize("kind", quick(INFINITE, "constant"))
def test_every_infinite_light(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert both(scene_of(light=INFINITE[kind]), kind, monkeypatch) < 0.6


@pytest.mark.parametrize("name", quick(INTEGRATORS, "light paths"))
@pytest.mark.parametrize("mode", quick(["rgb", "spectral"], "rgb"))
def test_every_integrator(name: str, mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    both(scene_of(mode=mode, integrator=INTEGRATORS[name]), name, monkeypatch)


def test_the_sun_beside_the_sky() -> None:
    """Its direction lies where a sky has an index: followed, it leads out of all tables."""
    sun = lights.Directional(direction=(0.31, -0.88, 0.37), irradiance=20.0)
    scene = scene_of()
    assert clpt.render(dataclasses.replace(scene, lights=[*scene.lights, sun]), 4).mean() > 0.0


def test_a_film_in_parts_is_the_same_film() -> None:
    scene = scene_of()
    whole, parts = clpt.Renderer(scene), clpt.Renderer(scene)
    assert whole.run(8)
    assert parts.run(3)
    assert parts.run(5)
    assert np.array_equal(whole.image(), parts.image())


def test_another_process_need_not_search(monkeypatch):
    triangles = room().astype(np.float32)
    first = openings._remembered(triangles, EYE + 0.01, None)
    assert first.rectangles
    monkeypatch.setattr(openings, "find", None)
    again = openings._remembered(triangles, EYE + 0.01, None)
    assert again.share == first.share
    np.testing.assert_array_equal(again.words(), first.words())
    with pytest.raises(TypeError):  # another eye has to search
        openings._remembered(triangles, EYE + 0.02, None)
