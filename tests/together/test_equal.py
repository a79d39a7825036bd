"""A scene and its equivalents have the same picture: the table is in tests/together/equivalents.py.

What is equal in the mean alone is compared in blocks, as tests/together/agree.py says.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.render.flow.check import check
from clpt.scene import Scene
from clpt.scene.materials import Diffuse
from tests.together import equivalents
from tests.together.agree import SAMPLES, compare, drawn, judged
from tests.together.equivalents import BITS, EQUIVALENTS, MEAN, Values, off, rendered
from tests.together.fixed import SCENES, SPECTRAL, ball, floor, lamp, peak, world
from tests.together.strategies import shown

pytestmark = pytest.mark.usefixtures("one_context")

SPP = 3
FEW_PIXELS = 0.02  # of NEAR: where rounding chose another way
CLOSE = 1e-3  # relative, of every other pixel
QUICK = ("a mixture", "glass that absorbs, spectral")
CHEAP = (  # that need no program of their own
    "groups of one", "keys of one place", "keys of the same vertices", "two-sided twice", "a crop",
    "shapes in the other order", "saved and loaded", "an update", "in parts",
    "few paths in flight",
)  # fmt: skip
EXACT = [name for name, one in EQUIVALENTS.items() if one.tolerance != MEAN]
DRAWN = 6
TURNS = 2
GREY = Diffuse(reflectance=0.4)


def assert_equal(scene: Scene, name: str, whole: Values, samples: int = SPP) -> bool:
    """Fail where a picture is not that of the scene, `whole`; return whether there is one."""
    other = EQUIVALENTS[name]
    equivalent = other.scene(scene)
    if equivalent is None:
        return False
    found = (other.picture or rendered)(equivalent, samples)
    wanted = other.part(whole, scene)
    share, most = off(found, wanted)
    where = f"{name}: {share:.1%} of the pixels are off, by up to {most:.1e}"
    if other.tolerance == BITS:
        assert share == 0.0, where
        return True
    size = np.abs(wanted).max(axis=-1) + 1e-3 * np.abs(wanted).mean()
    away = np.abs(found - wanted).max(axis=-1) > CLOSE * size
    assert away.mean() <= FEW_PIXELS, where
    np.testing.assert_allclose(
        found[~away].mean(), wanted[~away].mean(), rtol=equivalents.ROUNDING, err_msg=where
    )
    return True


@pytest.mark.parametrize("scene", QUICK)
def test_the_same_programs(scene: str) -> None:
    """What needs no program beside the scene's, to the bit."""
    given = SCENES[scene]()
    whole = rendered(given, SPP)
    assert whole.any()
    applied = [name for name in CHEAP if assert_equal(given, name, whole)]
    assert len(applied) >= len(CHEAP) - 1


def test_many_changes_at_once() -> None:
    """Keys, groups, blends of weight 0 and textures of one colour, in one scene that moves."""
    given = SCENES["lamp and metal"]()
    whole = rendered(given, SPP)
    names = "blends with weight 0", "textures of one colour", "groups and copies afar"
    names = *names, "keys of one place", "beside motion"
    one = given
    for name in names:
        one = EQUIVALENTS[name].scene(one) or one
    found = rendered(one, SPP)
    share, most = off(found, whole)
    assert share > 0.0, "nothing was computed anew"
    assert most < CLOSE
    np.testing.assert_allclose(found.mean(), whole.mean(), rtol=equivalents.ROUNDING)


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_every_scene(scene: str) -> None:
    """What needs no other program, and two by turns of what does."""
    given, number = SCENES[scene](), list(SCENES).index(scene)
    whole = rendered(given, SPP)
    dear = [name for name in EXACT if name not in CHEAP]
    turns = [dear[(TURNS * number + k) % len(dear)] for k in range(TURNS)]
    applied = [name for name in (*CHEAP, *turns) if assert_equal(given, name, whole)]
    assert len(applied) > len(CHEAP) // 2


@pytest.mark.slow
def test_equal_in_the_mean() -> None:
    """What takes other random numbers."""
    found = []
    for number, (name, made) in enumerate(SCENES.items()):
        given = made()
        for way, one in EQUIVALENTS.items():
            other = one.scene(given) if one.tolerance == MEAN else None
            if other is not None:
                found.append(compare(name, way, (given, other), 1 + 100 * number, SAMPLES))
    assert len(found) > 8
    different = judged(found, 7000, SAMPLES)
    assert not different, [one.row() for one in different]


@pytest.mark.slow
def test_grey_is_grey() -> None:
    """What has no colour is the same in both modes."""
    things = floor(GREY), peak(GREY), ball(Diffuse(reflectance=0.7)), lamp((5.0, 5.0, 5.0))
    pair = world(*things), world(*things, film=SPECTRAL)
    found = [compare("grey", "spectral", pair, 1, 2 * SAMPLES)]
    assert not judged(found, 7000, 2 * SAMPLES), found[0].row()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(DRAWN))
def test_drawn_scenes(seed: int) -> None:
    """What needs no other program, of random scenes."""
    scene = drawn(seed)
    try:
        check(scene)
    except SceneError:
        pytest.skip("no such scene")
    whole = rendered(scene, SPP)
    ties = "shapes in the other order"  # which of two surfaces at one place is met
    for name in set(CHEAP) - {ties}:
        try:
            assert_equal(scene, name, whole)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{shown(scene)}") from error
