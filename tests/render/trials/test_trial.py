"""A trial of ways to render a scene: who has one, what it decides, and a film without bias."""

from __future__ import annotations

import dataclasses
import pathlib as files
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render import trials
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.transport import hard_light, light_caches
from clpt.render.transport.hard_light import TRIAL_SAMPLES
from clpt.render.wavefront.strategy import UNTUNED
from clpt.scene import Scene
from clpt.scene.integrators import Auto, Integrator, Path
from clpt.scene.lights import Constant, Point
from clpt.scene.materials import Null
from clpt.scene.media import Homogeneous
from clpt.scene.shapes import Rectangle
from tests.pictures.support import assert_agree, blocks, with_film
from tests.pictures.transport.test_guiding import slit
from tests.pictures.transport.test_hybrid import caustic, lamp, narrow
from tests.pictures.transport.test_reuse import room

AUTO = Path(light_paths="auto", max_depth=5)
WAYS: list[tuple[Any, bool]] = [(0.25, False), (0, False), (0, True)]


def long(scene: Scene, integrator: Integrator = AUTO, **changes: Any) -> Scene:
    """A scene of which so many samples are wanted that a trial is worth it."""
    pixels = scene.film.width * scene.film.height
    changes = {"spp": -(-trials.PLAIN_RAYS // pixels), "integrator": integrator, **changes}
    return dataclasses.replace(scene, **changes)


def decided(scene: Scene) -> Lowered:
    """The choice of trials without a device."""
    on: Any = None
    return trials.decided(on, UNTUNED, scene, lower(scene), None)


def ways(scene: Scene) -> list[tuple[Any, bool]]:
    return [(one.light_paths, one.guiding) for one in lower(scene).candidates]


def test_ways_that_are_tried() -> None:
    """The chosen one first; with the depths that the scene says."""
    assert ways(long(caustic())) == WAYS
    assert ways(long(slit())) == [(0, False), (0, True)]
    assert {one.max_depth for one in lower(long(caustic())).candidates} == {5}
    photons = long(caustic(), Auto())
    assert ways(photons) == [(1, False), *WAYS[1:]] and lower(photons).integrator.kind == "vcm"
    shallow = Path(light_paths="auto", max_depth=2)
    assert ways(long(slit(), shallow)) == []
    assert ways(long(caustic(), spp=TRIAL_SAMPLES // (16 * 12))) == []


@pytest.mark.parametrize(
    "changes",
    [
        {"spp": 64},
        {"noise": 0.1},
        {"integrator": Path(light_paths=0)},
        {"integrator": Path(guiding=True)},
    ],
    ids=str,
)
def test_nothing_is_tried(changes: dict[str, Any]) -> None:
    assert ways(long(caustic(), **changes)) == []


def test_path_is_not_tried_beside_photons_where_it_never_finds_the_light() -> None:
    """A ray never meets a point, so what that lights is dark where it is seen through glass."""
    scene = caustic()
    point = Point(position=(0.0, 1.8, 0.0))
    dark = dataclasses.replace(scene, shapes=scene.shapes[:2], lights=[point])
    assert lower(long(dark, Auto())).integrator.kind == "vcm"
    assert ways(long(dark, Auto())) == [(1, False), (0, True)]


def test_a_guide_is_tried_among_media() -> None:
    """Where light paths know the medium in which they start: not beside an open boundary."""
    fog = Homogeneous(sigma_s=0.5, sigma_a=0.0)
    assert (0, True) in ways(long(slit(fog)))
    scene = slit(fog)
    scene.shapes = [*scene.shapes, Rectangle(material=Null(), interior=fog)]
    assert not any(guiding for _, guiding in ways(long(scene)))


def test_an_edit_has_no_trial() -> None:
    scene = long(caustic())
    assert lower(scene, former=lower(scene)).candidates == ()


def test_a_guide_learns_the_longer_the_more_samples_there_are() -> None:
    """Unless somebody says from how many light paths."""
    learned = {1 << 20: 20, TRIAL_SAMPLES: 20, trials.GUIDE_RAYS: 22}
    learned |= {1 << 28: 22, 1 << 29: 23, 1 << 30: 24, 1 << 40: 24}
    for samples, power in learned.items():
        assert light_caches.guide_paths_for(samples) == 1 << power
    assert light_caches.guide_paths_for(3 << 23) == 1 << 21
    scene = long(caustic())
    *_, guided = lower(scene).candidates
    former = dataclasses.replace(lower(scene), integrator=guided)
    assert lower(scene, former=former).settings["guide_paths"] == 1 << 24
    for said, taken, cells in ((0, light_caches.GUIDE_PATHS, 1 << 15), (1000, 1000, 1 << 15)):
        asked = Path(light_paths=0, guiding=True, guide_paths=said)
        found = lower(long(caustic(), asked)).settings
        assert (found["guide_paths"], found["photon_cells"]) == (taken, cells)


def test_a_guide_that_learns_much_has_smaller_cells() -> None:
    """Of which as many more are told apart; that of the trial is like that of the film."""
    made = [
        lower(guided_by(paths)).settings
        for paths in (1 << 20, light_caches.FINE_GUIDE_PATHS - 1, light_caches.FINE_GUIDE_PATHS)
    ]
    assert [int(each["photon_cells"]) for each in made] == [1 << 15, 1 << 15, 1 << 16]
    sides = [float(each["guide_side"] / each["scene_radius"]) for each in made]
    assert sides == pytest.approx([0.14, 0.14, 0.1])
    small = trials.small_settings(made[-1])
    assert small["guide_side"] == made[-1]["guide_side"]
    assert small["photon_cells"] == made[-1]["photon_cells"]


def guided_by(paths: int) -> Scene:
    """A scene whose guide learns from so many light paths."""
    return dataclasses.replace(
        caustic(), integrator=Path(light_paths=0, guiding=True, guide_paths=paths)
    )


@pytest.mark.parametrize("wrong", [-1, 1.5, True, 1 << 25])
def test_a_guide_learns_from_a_whole_number_of_light_paths(wrong: Any) -> None:
    with pytest.raises(SceneError, match="guide_paths: must be a whole number"):
        Path(guiding=True, guide_paths=wrong)


def test_a_trial_takes_a_share_of_the_film() -> None:
    """Where it is long enough for more pixels than the fewest that tell something."""
    trial_samples = trials.ROUNDS * trials.SAMPLES
    for samples in (TRIAL_SAMPLES, 1 << 24, 1 << 27):
        share = trials.pixels_for(samples) * trial_samples / samples
        assert share <= 1.0 / trials.SHARE
    assert trials.pixels_for(1) == trials.FEWEST
    assert trials.pixels_for(1 << 40) == trials.PIXELS


@pytest.mark.parametrize(
    ("power", "paths", "learned"),
    [(23, 20, 18), (25, 22, 19), (27, 22, 20), (29, 22, 22), (40, 22, 22), (40, 10, 10)],
)
def test_a_trials_guide_comes_near_that_of_a_long_film(
    power: int, paths: int, learned: int
) -> None:
    assert trials.lessons(1 << paths, 1 << power) == 1 << learned


def made_up(
    monkeypatch: pytest.MonkeyPatch, noise: dict[tuple[Any, bool], float], rays: int = 1 << 20
) -> list[Any]:
    """Let trials find these variances at equal rays; return what is tried, as it is."""
    asked: list[Any] = []

    def tried(_: object, __: object, lowered: Lowered, *___: Any) -> tuple[trials.Trial, None]:
        way = lowered.integrator.light_paths, lowered.integrator.guiding
        asked.append(way)
        drawn = np.random.default_rng(len(asked)).normal(1.0, noise[way] ** 0.5, (8, 32, 64, 3))
        return trials.Trial(drawn, rays), None

    monkeypatch.setattr(trials, "tried", tried)
    return asked


@pytest.mark.parametrize("best", WAYS, ids=["light paths", "path", "guiding"])
def test_the_cheapest_way_is_taken(monkeypatch: pytest.MonkeyPatch, best: tuple[Any, bool]) -> None:
    scene = long(caustic())
    asked = made_up(monkeypatch, {way: 0.5 if way == best else 1.0 for way in WAYS})
    found = decided(scene)
    assert asked == WAYS
    assert (found.integrator.light_paths, found.integrator.guiding) == best
    assert found.features.transport.guided == best[1]
    assert "is specular" in found.reason and "light paths 1.00" in found.reason
    assert found.candidates == ()


def test_no_guide_is_compiled_where_there_is_little_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = made_up(monkeypatch, dict.fromkeys(WAYS, 0.9 * trials.QUIET))
    scene = long(caustic())
    decided(scene)
    assert asked == WAYS[:2]
    asked.clear()
    asked = made_up(monkeypatch, dict.fromkeys([(0, False), (0, True)], 0.9 * trials.QUIET))
    alone = long(slit())
    assert decided(alone).reason == lower(alone).reason and asked == [(0, False)]


def test_no_guide_is_compiled_for_few_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = long(caustic(), spp=-(-TRIAL_SAMPLES // (16 * 12)))
    pictures = trials.ROUNDS * trials.SAMPLES * 32 * 64
    for each, guides_too in ((15, False), (17, True)):  # rays of a sample
        asked = made_up(monkeypatch, dict.fromkeys(WAYS, 1.0), each * pictures)
        decided(scene)
        assert asked == ([WAYS[0], WAYS[2]] if guides_too else WAYS[:1])


def test_path_without_light_paths_is_compiled_for_very_many_rays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for power, without in ((27, False), (29, True)):  # of four rays each
        scene = long(caustic(), spp=-(-(1 << power) // (16 * 12)))
        asked = made_up(monkeypatch, {way: 0.1 if way == (0, False) else 0.3 for way in WAYS})
        found = decided(scene)
        assert asked == (WAYS[:2] if without else WAYS[:1])
        assert (found.integrator.light_paths == 0) == without


@pytest.fixture
def little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials of few samples, in which guides learn from few light paths."""
    monkeypatch.setattr(light_caches, "GUIDE_PATHS", 1 << 12)
    monkeypatch.setattr(light_caches, "LONG_GUIDE_PATHS", 1 << 12)
    monkeypatch.setattr(hard_light, "TRIAL_SAMPLES", 1)
    monkeypatch.setattr(trials, "GUIDE_RAYS", 1)
    monkeypatch.setattr(trials, "ROUNDS", 2)
    monkeypatch.setattr(trials, "SAMPLES", 4)
    monkeypatch.setattr(trials, "QUIET", 0.0)
    monkeypatch.setattr(trials, "FEWEST", 256)


@pytest.mark.usefixtures("little")
@pytest.mark.parametrize("guiding", [False, True])
def test_a_film_is_that_of_the_way(monkeypatch: pytest.MonkeyPatch, guiding: bool) -> None:
    """It is that of a renderer that was told the way, to the bit, whoever takes which samples."""
    monkeypatch.setattr(trials, "GUIDED_RAY", 0.0 if guiding else 1e9)
    scene = dataclasses.replace(slit(), integrator=Auto())
    told = dataclasses.replace(scene, integrator=Path(light_paths=0, guiding=guiding))
    whole = clpt.Renderer(told, narrow())
    whole.run(7)
    parts = [clpt.Renderer(scene, narrow(), first_sample=first) for first in (0, 4)]
    for part, samples in zip(parts, (4, 3), strict=True):
        part.run(samples)
        assert part._wavefront.features.transport.guided == guiding
        assert "lowest" in part.stats.reason
    parts[0].merge(parts[1].film_state())
    assert np.array_equal(parts[0].image(), whole.image())
    origin = parts[0]._origin().settings
    assert origin["chosen.guide_paths"] == (light_caches.GUIDE_PATHS if guiding else 0)
    crop = clpt.Renderer(with_film(scene, crop=(3, 2, 7, 5)), narrow())
    assert crop._wavefront.features.transport.guided == guiding


@pytest.mark.usefixtures("little")
@pytest.mark.parametrize("several", [False, True], ids=["renderer", "several devices"])
def test_a_film_is_gone_on_with_in_its_way(
    monkeypatch: pytest.MonkeyPatch, tmp_path: files.Path, several: bool
) -> None:
    """More samples are wanted than at first, so that there is a trial; and the other way round."""
    monkeypatch.setattr(trials, "GUIDED_RAY", 0.0)
    scene, file = dataclasses.replace(slit(), integrator=Auto()), tmp_path / "a.film"

    def made(samples: int) -> clpt.Renderer | clpt.MultiRenderer:
        monkeypatch.setattr(hard_light, "TRIAL_SAMPLES", samples)
        return clpt.MultiRenderer(scene, [narrow()]) if several else clpt.Renderer(scene, narrow())

    for first, guiding in ((1 << 40, False), (1, True)):
        with made(first) as begun:
            begun.run(3)
            begun.save_state(file)
        told = dataclasses.replace(scene, integrator=Path(light_paths=0, guiding=guiding))
        with made((1 << 40) // first) as renderer, clpt.Renderer(told, narrow()) as whole:
            renderer.run(1)
            renderer.load_state(file)
            renderer.run(4)
            whole.run(7)
            assert np.array_equal(renderer.image(), whole.image())


@pytest.mark.usefixtures("little")
def test_a_guide_stays_as_it_is_if_more_samples_are_wanted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: files.Path
) -> None:
    """A longer film learns from more light paths, in smaller cells, but not one that has begun with
    fewer."""
    monkeypatch.setattr(trials, "GUIDED_RAY", 0.0)
    monkeypatch.setattr(light_caches, "FINE_GUIDE_PATHS", 1 << 13)
    monkeypatch.setattr(light_caches, "LONG_GUIDE_PATHS", 1 << 13)
    monkeypatch.setattr(light_caches, "LESSON", 1)
    file, made = tmp_path / "a.film", []
    for spp, learned in ((16, 1 << 12), (32, 1 << 13)):
        scene = dataclasses.replace(slit(), integrator=Auto(), spp=spp)
        made.append(clpt.Renderer(scene, narrow()))
        assert made[-1]._wavefront.paths.settings["guide_paths"] == learned
    begun, longer = made
    begun.run(3)
    begun.save_state(file)
    begun.run(4)
    longer.load_state(file)
    longer.run(4)
    assert longer._wavefront.paths.settings["guide_paths"] == 1 << 12
    assert np.array_equal(longer.image(), begun.image())


@pytest.mark.usefixtures("little")
def test_pictures_that_people_steer_have_no_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials, "GUIDED_RAY", 0.0)
    scene = dataclasses.replace(slit(), integrator=Auto())
    steered = clpt.Renderer(scene, narrow(), cancel_seconds=0.1)
    assert not steered._wavefront.features.transport.guided


def broad() -> Scene:
    """A caustic of a lamp so large that all ways find it."""
    scene = caustic()
    return dataclasses.replace(scene, shapes=[*scene.shapes[:2], lamp(0.3, 30.0)])


@pytest.mark.slow
@pytest.mark.usefixtures("little")
@pytest.mark.parametrize("scene", [slit(), broad()], ids=["slit", "caustic"])
def test_what_a_trial_decides_has_no_bias(scene: Scene) -> None:
    """Each exposure has its own seed and so its own trial; `path` with light paths is beside it.

    See tests/pictures/support.py for the significance.
    """
    assert len(ways(long(scene))) > 1
    reference = dataclasses.replace(scene, integrator=Path(light_paths=1, max_depth=6))
    auto = dataclasses.replace(scene, integrator=Path(light_paths="auto", max_depth=6))
    made = []
    for one, first in ((auto, 1), (reference, 101)):
        images = []
        for seed in range(first, first + 12):
            with clpt.Renderer(dataclasses.replace(one, seed=seed), narrow()) as renderer:
                renderer.run(256)
                images.append(renderer.image().astype(np.float64))
        made.append(blocks(images))
    assert_agree(*made, "by a trial")


def under_a_sky() -> Scene:
    """A room that is open toward the camera, without lamps."""
    scene = room()
    shapes = [shape for shape in scene.shapes if shape.emission is None]
    return dataclasses.replace(scene, shapes=shapes, lights=[Constant(radiance=1.0)])


def with_variances(monkeypatch: pytest.MonkeyPatch, **noise: float) -> None:
    """Let trials find these variances at equal rays, and 1 for all other ways."""

    def tried(_: object, __: object, lowered: Lowered, *___: Any) -> tuple[trials.Trial, None]:
        spread = noise.get(trials.name_of(lowered.integrator), 1.0) ** 0.5
        drawn = np.random.default_rng(1).normal(1.0, spread, (8, 32, 64, 3))
        return trials.Trial(drawn, 1 << 20, trials._ray(lowered)), None

    monkeypatch.setattr(trials, "tried", tried)


def test_path_reuse_is_tried_under_a_sky(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all lights are in the scene it is taken without a trial."""
    scene, inside = long(under_a_sky()), lower(long(room()))
    assert trials.name_of(lower(scene).integrator) == "path" and inside.integrator.reuse
    asked = lower(long(under_a_sky(), Path(reuse=True)))
    for taken in (inside, asked):
        assert [trials.name_of(way) for way in taken.candidates] == ["path reuse", "guiding"]
    for variance, pays in ((0.5, False), (0.2, True)):
        with_variances(monkeypatch, path=0.3, **{"path reuse": variance})
        chosen = decided(scene)
        assert "path reuse" in chosen.reason and chosen.features.film.reuse == pays


def test_a_guide_gains_more_beside_path_reuse_than_a_trial_sees(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with_variances(monkeypatch)
    assert decided(long(room())).integrator.guiding
    assert not decided(long(under_a_sky())).integrator.guiding
