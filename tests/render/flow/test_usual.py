"""Programs that scenes of the usual kinds share, and their pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import clpt
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records import usual
from clpt.scene import Film, Scene, lights, shapes, textures
from clpt.scene import materials as mt
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.transforms import look_at, rotate, scale, translate

IMAGE = np.linspace(0.1, 0.9, 48, dtype=np.float32).reshape(4, 4, 3)
MATERIALS: Mapping[str, mt.Material] = {
    **{cls.kind: cls() for cls in usual.LEAVES},
    "textured": mt.Diffuse(reflectance=textures.Bitmap(image=IMAGE)),
    "bumpy": mt.NormalMap(material=mt.Diffuse(), map=textures.Bitmap(image=IMAGE, raw=True)),
    "two_sided": mt.TwoSided(front=mt.Diffuse(), back=mt.RoughConductor()),
}
SEEN_THROUGH: Mapping[str, mt.Material] = {
    "mask": mt.Mask(material=mt.Diffuse(), opacity=0.5),
    "thin_dielectric": mt.ThinDielectric(),
}
LIGHTS: Mapping[str, Callable[[], lights.Light]] = {
    "constant": lights.Constant,
    "envmap": lambda: lights.Envmap(image=IMAGE),
}
LANES = 8


def scene(material: mt.Material, light: lights.Light | None = None, **integrator: float) -> Scene:
    """A ball over a floor under a square lamp, or under another light."""
    lamp = shapes.Rectangle(
        to_world=translate(0, 0, 3) @ rotate([1, 0, 0], 180),
        material=mt.Diffuse(),
        emission=lights.Area(radiance=5.0),
    )
    return Scene(
        camera=Perspective(to_world=look_at((0, -6, 1.5), (0, 0, 0.5), (0, 0, 1))),
        film=Film(width=24, height=24, mode="rgb"),
        shapes=[
            shapes.Rectangle(to_world=scale(4, 4, 1), material=mt.Diffuse()),
            shapes.Cube(to_world=translate(0, 0, 1.1), material=material),
            *([lamp] if light is None else []),
        ],
        lights=[] if light is None else [light],
        integrator=Path(max_depth=5, **integrator),
        spp=256,
    )


def texts(shown: Scene) -> str:
    """All texts of the loop of a scene's shared program."""
    found = programs.loop_sources(lower(shown, shared=True).features, "wide8", LANES, True)
    return repr(sorted(found.items()))


SURFACES: Mapping[str, mt.Material] = {
    "plain": mt.Openpbr(),
    "metal": mt.Openpbr(base_metalness=1.0),
    "coated": mt.Openpbr(base_color=textures.Bitmap(image=IMAGE), coat_weight=0.5),
}


@pytest.mark.parametrize("kinds", [MATERIALS, SEEN_THROUGH, SURFACES])
def test_scenes_of_the_usual_materials_have_one_program(kinds):
    assert len({texts(scene(material, light_paths=0)) for material in kinds.values()}) == 1


def test_scenes_of_the_usual_lights_have_one_program():
    lit = [scene(mt.Diffuse(), light(), light_paths=0) for light in LIGHTS.values()]
    assert {texts(shown) for shown in lit} == {texts(scene(mt.Diffuse(), light_paths=0))}


def test_a_kind_that_is_not_usual_has_a_program_of_its_own():
    other = scene(mt.Hair(), light_paths=0)
    assert texts(other) != texts(scene(mt.Diffuse(), light_paths=0))


def blocks(shown: Scene, kind: str) -> np.ndarray:
    """Means of 16 blocks of eight pictures, (8, 4, 4)."""
    found = []
    for seed in range(8):
        renderer = clpt.Renderer(replace(shown, seed=seed), programs=kind)
        renderer.run(32)
        found.append(renderer.image()[..., :3].mean(-1).reshape(4, 6, 4, 6).mean((1, 3)))
    return np.array(found)


CASES = {
    **{name: scene(material, light_paths=0) for name, material in MATERIALS.items()},
    **{name: scene(material, light_paths=0) for name, material in SEEN_THROUGH.items()},
    **{name: scene(material, light_paths=0) for name, material in SURFACES.items()},
    **{name: scene(mt.Diffuse(), light(), light_paths=0) for name, light in LIGHTS.items()},
    "light paths": scene(mt.Diffuse(), light_paths=1),
    "caustic": scene(mt.Dielectric(), light_paths=1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_pictures_of_shared_programs_have_the_same_means(name):
    """Student's t of each of 16 blocks; the significance of all together is .001."""
    own, shared = (blocks(CASES[name], kind) for kind in ("own", "shared"))
    square = (own.var(0, ddof=1) + shared.var(0, ddof=1)) / len(own)
    rounding = 1e-6 * own.mean()
    t = np.abs(own.mean(0) - shared.mean(0)) / np.sqrt(square + rounding**2)
    assert stats.t.sf(t.max(), 2 * len(own) - 2) > 0.5e-3 / t.size
    assert own.mean() == pytest.approx(shared.mean(), rel=0.02)
