"""What several renderers share: a lowered scene is data, and nobody writes to it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import device
from clpt.render.edit import plans
from clpt.render.edit.plans import Plan
from clpt.render.flow.scene_to_tables import lower
from clpt.render.wavefront.strategy import Tuning
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.materials import Diffuse


@pytest.fixture(scope="module")
def cornell(scenes: Path) -> Scene:
    scene = clpt.load(scenes / "cornell.xml")
    film = dataclasses.replace(scene.film, mode="rgb", width=24, height=20)
    return coloured(dataclasses.replace(scene, film=film), (0.5, 0.4, 0.3))


def picture(wavefront: Wavefront) -> np.ndarray:
    wavefront.clear()
    assert wavefront.render_samples(0, 2)
    return wavefront.film.picture.get()[..., :3]


def coloured(scene: Scene, colour: tuple[float, float, float]) -> Scene:
    """The scene with a material of its own on its first shape."""
    first = dataclasses.replace(scene.shapes[0], material=Diffuse(reflectance=colour))
    return dataclasses.replace(scene, shapes=[first, *scene.shapes[1:]])


def test_nobody_can_write_to_a_lowered_scene(cornell: Scene) -> None:
    lowered = lower(cornell)
    arrays = [lowered.vertices, lowered.faces, lowered.tags, lowered.boxes]
    for array in (*arrays, *lowered.tables.values(), lowered.instances.rows):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(ValueError, match="read-only"):
        lowered.settings["seed"] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        lowered.glass_rows = (1,)  # type: ignore[misc]


def test_two_wavefronts_share_a_lowered_scene(cornell: Scene) -> None:
    """With other slots, layouts and seeds, while one of them is edited and rebuilt."""
    on, lowered = device.choose(), lower(cornell)
    one = Wavefront.create(on, lowered, Tuning(layout="wide8", looped=False))
    other = Wavefront.create(on, lowered, Tuning(layout="binary", looped=False), slots=64)
    assert one.scene.lowered is other.scene.lowered is lowered
    assert one.paths.slots != other.paths.slots
    first, second = picture(one), picture(other)

    one.paths.set_seed(9)
    assert not np.array_equal(picture(one), first)
    one.paths.set_seed(cornell.seed)
    np.testing.assert_array_equal(picture(one), first)

    edited = coloured(cornell, (0.1, 0.2, 0.9))
    patch = plans.prepare_patch(one.scene, cornell, edited)
    assert not isinstance(patch, str)
    patch.write()
    patched = picture(one)
    assert not np.array_equal(patched, first)
    again = lower(coloured(cornell, (0.1, 0.2, 0.9)), former=one.scene.lowered)
    plans.prepare_rebuild(one, again).write()
    np.testing.assert_array_equal(picture(one), patched)

    assert other.scene.lowered is lowered
    np.testing.assert_array_equal(picture(other), second)
    # What one has edited the other edits by itself, if need be by lowering again.
    plan: Plan | str = plans.prepare_patch(other.scene, cornell, edited)
    if isinstance(plan, str):
        plan = plans.prepare_rebuild(other, lower(edited, former=other.scene.lowered))
    plan.write()
    new = Wavefront.create(on, lower(edited), Tuning(layout="binary", looped=False), slots=64)
    np.testing.assert_array_equal(picture(other), picture(new))
