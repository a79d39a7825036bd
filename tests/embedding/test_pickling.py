"""Scenes go through pickle and copy: to another process, or into a cache of the host's."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.scene import KINDS, Scene, shapes
from clpt.scene.params import Kind
from tests.embedding.conftest import SLOTS

WAYS: dict[str, Callable[[Scene], Scene]] = {
    "pickle": lambda scene: pickle.loads(pickle.dumps(scene)),
    "deepcopy": copy.deepcopy,
}
NAMES = ("spectra", "textures", "instances", "envmap", "principled", "thin_lens", "plastic")
EVERY = [kind for kinds in KINDS.values() for kind in kinds]


def words(lowered: Lowered) -> dict[str, bytes]:
    """All that the device gets."""
    arrays = {name: getattr(lowered, name) for name in ("vertices", "faces", "tags", "boxes")}
    arrays |= {"settings": lowered.settings, **lowered.tables}
    return {name: np.asarray(array).tobytes() for name, array in arrays.items()}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", NAMES)
def test_the_device_gets_the_same_words(scenes: Path, name: str, way: str) -> None:
    scene = clpt.load(scenes / f"{name}.xml")
    own, other = lower(scene), lower(WAYS[way](scene))
    assert words(own) == words(other)
    assert own.features == other.features


@pytest.mark.parametrize("way", WAYS)
def test_the_picture_is_the_same(
    scene: Scene, queue: cl.CommandQueue, picture: np.ndarray, way: str
) -> None:
    with clpt.Renderer(WAYS[way](scene), queue=queue, slots=SLOTS) as renderer:
        renderer.step(4)
        assert np.array_equal(renderer.image(), picture)


@pytest.mark.parametrize("way", WAYS)
def test_instances_go_on_to_share_their_group(scenes: Path, way: str) -> None:
    scene = WAYS[way](clpt.load(scenes / "instances.xml"))
    groups = [s.group for s in scene.shapes if isinstance(s, shapes.Instance)]
    assert len({id(group) for group in groups}) < len(groups)


@pytest.mark.parametrize("kind", EVERY, ids=lambda kind: kind.__name__)
def test_every_kind(kind: type[Kind]) -> None:
    """With its defaults."""
    given = {"group": shapes.Group(shapes=[shapes.Sphere()])} if kind is shapes.Instance else {}
    one = kind(**given)
    for other in (pickle.loads(pickle.dumps(one)), copy.deepcopy(one)):
        assert type(other) is kind
        assert pickle.dumps(other) == pickle.dumps(one)
