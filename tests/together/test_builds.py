"""Random scenes of everything together: each is refused in words, or all its programs compile."""

from __future__ import annotations

from typing import Any

import hypothesis
import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.render.flow.check import check
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene.cameras import Lens, Perspective
from clpt.scene.integrators import SAMPLERS, Vcm
from clpt.scene.lights import Area, Envmap, Point
from clpt.scene.materials import (
    Dielectric,
    Diffuse,
    Fluorescent,
    Hair,
    Layer,
    Null,
    Phong,
    RoughConductor,
)
from clpt.scene.media import Grid, Homogeneous, Mixture
from clpt.scene.motion import Keys, Shutter
from clpt.scene.phases import HenyeyGreenstein
from clpt.scene.shapes import Cube, Disk, Sphere
from clpt.scene.textures import Checkers, Mix
from clpt.spectra import Tabulated
from tests.front_end import CLANG, errors
from tests.together.builds import Way, texts
from tests.together.strategies import scenes, shown, ways

SCENES = 20

pytestmark = pytest.mark.skipif(CLANG is None, reason="clang is not installed")

FOG, CLOUD = Homogeneous(sigma_s=1.0), Grid(sigma_s=1.0)
IMAGE = Envmap(image=np.ones((4, 8, 3), np.float32))
TABLE = Tabulated(lambdas=(400.0, 700.0), values=(1.0, 3.0))
TURN = Keys((0.0, 1.0), (np.eye(4), np.diag([1.0, -1.0, -1.0, 1.0])))
COATED = RoughConductor(layers=(Layer(),))


def within(medium: Any, *others: Any) -> list[Any]:
    """A body of a medium, and others."""
    return [Cube(material=Null(), interior=medium), *others]


MET: dict[str, dict[str, Any]] = {  # parts that once could not be in one scene
    "a grid, and an image around": {"shapes": within(CLOUD), "lights": [IMAGE]},
    "a grid, and fluorescence": {"shapes": within(CLOUD, Disk(material=Fluorescent()))},
    "a medium, and thin films": {"shapes": within(FOG, Sphere(material=COATED))},
    "a medium, and a lens that reflects": {"shapes": within(FOG), "camera": Lens(losses=True)},
    "ghosts that light paths find": {
        "shapes": [Sphere(emission=Area())],
        "camera": Lens(ghosts=0.5),
    },
    "ghosts of a lens that moves, in haze": {
        "shapes": [Sphere(emission=Area())],
        "camera": Lens(ghosts=0.5, medium=FOG, motion=TURN, shutter=Shutter(0.0, 1.0)),
    },
    "a glowing grid": {"shapes": within(Grid(sigma_a=1.0, emission=1.0))},
    "a glowing grid, and a mixture": {
        "shapes": [*within(Grid(sigma_a=1.0, emission=1.0)), *within(Mixture(parts=(CLOUD, FOG)))]
    },
    "phases that depend on colours": {
        "shapes": within(Homogeneous(sigma_s=1.0, phase=HenyeyGreenstein(g=(0.1, 0.2, 0.3))))
    },
    "layers of a film, and of a coat": {
        "shapes": [Sphere(material=COATED)],
        "film": {"layers": ("depth", "albedo")},
    },
    "textures of textures": {
        "shapes": [Sphere(material=Diffuse(reflectance=Mix(first=0.2, second=Checkers())))],
        "lights": [Point(position=(0.0, 0.0, 3.0))],
    },
    "a factor of textures": {
        "shapes": [Sphere(material=Hair(sigma_a=Mix(first=0.2, second=Checkers())))],
    },
    **{
        f"photons, and the sampler {cls.kind}": {
            "shapes": [Disk(), Sphere(material=Dielectric(), emission=Area())],
            "integrator": Vcm(),
            "sampler": cls(),
        }
        for cls in SAMPLERS
    },
    "photons that diffuse surfaces leave": {
        "shapes": [Sphere(emission=Area())],
        "integrator": Vcm(),
    },
    "a number mixed of spectra, all of it the first": {
        "shapes": [Sphere(material=Phong(exponent=Mix(first=TABLE, amount=0.0)))]
    },
}


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("parts", MET)
def test_parts_that_once_did_not_go_together(parts: str, mode: str) -> None:
    given = {"camera": Perspective(), **MET[parts]}
    film = Film(width=4, height=4, mode=mode, **given.pop("film", {}))
    features = lower(Scene(film=film, **given)).features
    ways_ = Way(lanes=1, form="stages"), Way(lanes=8, form="loop")
    made = [text for way in ways_ for text in texts(features, way)]
    assert errors(dict.fromkeys(made)) == [""] * len(dict.fromkeys(made))


@pytest.mark.long
@hypothesis.seed(1)
@hypothesis.settings(
    max_examples=SCENES,
    deadline=None,
    database=None,
    print_blob=False,
    report_multiple_bugs=False,
    suppress_health_check=list(hypothesis.HealthCheck),
)
@hypothesis.given(scenes(), ways())
def test_scenes_build(scene: Scene, way: Way) -> None:
    try:
        check(scene)
    except SceneError as error:
        assert error.where and "\n" not in str(error)
        hypothesis.reject()
    try:
        features = lower(scene).features
    except Exception as error:  # what `check` has let pass is not refused any more
        raise AssertionError(f"{error!r} of\n{shown(scene)}") from error
    for error in errors(texts(features, way)):
        assert not error, f"{error[:2000]}\n{way}\n{shown(scene)}"
