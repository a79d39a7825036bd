"""Light paths in media where lamps, shapes and boundaries move make the picture of `path` alone.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, media
from clpt.scene import materials as m
from clpt.scene.integrators import ParticleTracer, Path, Vcm
from clpt.scene.lights import Point
from clpt.scene.motion import Deformation, Keys, Shutter
from clpt.scene.shapes import Cube, Mesh, Shape, Sphere
from tests.pictures.media.test_fog_light import FOGS, GLASS, LAMP, SPOT, room
from tests.pictures.motion.test_motion import ball
from tests.pictures.support import assert_agree, blocks, exposures
from tests.pictures.transport.test_hybrid import narrow

OPEN = Shutter(0.0, 1.0, "triangle")
BALL, FACES, _ = ball(12, 0.3)
FOG = FOGS["chromatic"]
UNDER = m.Diffuse(reflectance=(0.8, 0.5, 0.3))


def ways(*places: Any) -> Keys:
    """Keys at even times from 0 to 1 s."""
    return Keys(np.linspace(0.0, 1.0, len(places)), [tf.translate(place) for place in places])


SWINGS = dataclasses.replace(SPOT, motion=ways([-0.6, 0.0, 0.0], [0.4, -0.2, 0.1]))
RISES = dataclasses.replace(LAMP, motion=ways([-0.5, -0.6, 0.0], [0.3, 0.0, 0.2]))
BLOCK = Cube(
    to_world=tf.scale(0.15), material=UNDER, motion=ways([-0.5, -0.3, 0.3], [0.5, 0.1, 0.0])
)
BEATS = Mesh(
    vertices=BALL, faces=FACES, material=UNDER, deformation=Deformation([0, 1], [BALL, 0.4 * BALL])
)


def moving(fog: media.Medium, light: Any, *more: Shape, **given: Any) -> Scene:
    scene = room(fog, light, *more, **given)
    camera = dataclasses.replace(scene.camera, shutter=OPEN)
    return dataclasses.replace(scene, camera=camera)


def drifting(fog: media.Medium, light: Any, *more: Shape, **given: Any) -> Scene:
    """The same, of which the boundary of the fog moves and turns, and holds the light all along."""
    scene = moving(fog, light, *more, **given)
    turn = [tf.translate([x, 0, 0]) @ tf.rotate([0, 1, 0], 90 * x) for x in (-0.1, 0.4)]
    scene.shapes[0] = dataclasses.replace(
        scene.shapes[0], to_world=tf.scale(1.4), motion=Keys([0.0, 1.0], turn)
    )
    return scene


def against_the_camera(scene: Scene, integrator: Any, spp: int, what: str) -> None:
    alone = dataclasses.replace(scene, integrator=Path(max_depth=5, light_paths=0))
    ours = dataclasses.replace(scene, integrator=integrator)
    reference = blocks(exposures(alone, 12, spp, device=narrow()))
    assert_agree(blocks(exposures(ours, 12, spp, 101, device=narrow())), reference, what)


BESIDE, ALONE = Path(max_depth=5, light_paths=1), ParticleTracer(max_depth=5)
MERGED = Vcm(max_depth=5, radius=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("how", [BESIDE, ALONE], ids=["beside", "alone"])
def test_a_lamp_and_a_shape_that_move_in_fog(how: Any, mode: str) -> None:
    against_the_camera(moving(FOG, RISES, BLOCK, mode=mode), how, 256, f"lamp and shape, {mode}")


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("how", [BESIDE, MERGED], ids=["beside", "photons"])
def test_a_lamp_and_a_boundary_that_move(how: Any, mode: str) -> None:
    """Of a spot lamp too few of the camera's paths tell: their mean would be no reference."""
    scene = drifting(FOG, RISES, BEATS, mode=mode)
    against_the_camera(scene, how, 256, f"lamp and boundary, {mode}")


@pytest.mark.slow
def test_a_camera_and_glass_that_move_in_a_grid() -> None:
    glass = Sphere(
        radius=0.25, material=GLASS, exterior=FOGS["grid"], motion=ways([0] * 3, [0.3, 0, 0])
    )
    scene = moving(FOGS["grid"], SWINGS, glass, inside=True)
    camera = dataclasses.replace(scene.camera, motion=ways([0, 0, 0], [-0.3, 0.1, 0]))
    scene = dataclasses.replace(scene, camera=camera)
    assert not any("camera" in line for line in lower(scene).warnings)
    against_the_camera(scene, BESIDE, 256, "camera and glass")


def test_what_is_around_lights_and_cameras_that_move() -> None:
    """A medium that a light stays in is known, whatever moves; one that it leaves is not."""
    for scene in (
        moving(FOG, RISES, BLOCK),
        moving(FOG, SWINGS, BEATS),
        drifting(FOG, SWINGS),
        drifting(FOG, LAMP),
    ):
        for how in (BESIDE, ALONE):
            lowered = lower(dataclasses.replace(scene, integrator=how))
            assert lowered.features.light_media, lowered.warnings
            assert not any("left aside" in line for line in lowered.warnings)
        words = lowered.tables["media"]
        assert words[5] != 0  # of the only light, behind one aim of four words
    leaves = ways([0, 0, 0], [0, 0.5, 0], [0, 0, 0])
    passes = drifting(FOG, SWINGS)
    passes.shapes[0] = dataclasses.replace(passes.shapes[0], motion=ways([0] * 3, [5, 0, 0]))
    shrinks = moving(FOG, LAMP)
    corners, faces = ball(12, 3.0)[:2]
    shrinks.shapes[0] = Mesh(
        vertices=corners,
        faces=faces,
        material=m.Null(),
        interior=FOG,
        deformation=Deformation([0, 1], [corners, corners * 0.1]),
    )
    for scene, told in (
        (moving(FOG, dataclasses.replace(SPOT, motion=leaves)), "another medium"),
        (moving(FOG, dataclasses.replace(LAMP, motion=leaves)), "more than one medium"),
        (passes, "another medium"),
        (shrinks, "more than one medium"),
    ):
        lowered = lower(dataclasses.replace(scene, integrator=BESIDE))
        assert f"{told} while the shutter is open" in " ".join(lowered.warnings)
        assert lowered.settings["light_paths"] == 0
        with pytest.raises(SceneError, match=told):
            lower(dataclasses.replace(scene, integrator=ALONE))
    # a point is looked for where keys take it, not where it was lowered
    away = Keys([0.0, 1.0], [tf.translate([9, y, 0]) for y in (0, 1)])
    far = moving(FOG, Point(position=(0, 0, 0), motion=away))
    lowered = lower(dataclasses.replace(far, integrator=BESIDE))
    assert lowered.features.light_media and not lowered.tables["media"][4:6].any()
    near = room(FOG, SPOT)
    for keys, inside, told in (
        (ways([0, 0, 0], [0.3, 0, 0]), False, False),
        (ways([0, 0, -3], [0.3, 0, -3]), True, False),
        (ways([0, 0, 0], [0, 0, -3]), False, True),
    ):
        camera = dataclasses.replace(near.camera, shutter=OPEN, motion=keys)
        lowered = lower(dataclasses.replace(near, camera=camera))
        assert bool(lowered.settings["camera_medium"]) == inside
        assert any("camera: it comes into" in line for line in lowered.warnings) == told
