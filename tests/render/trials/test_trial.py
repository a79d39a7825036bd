"""A trial of ways to render a scene: who has one, what it decides, and a film without bias."""

from __future__ import annotations

import dataclasses
import pathlib as files
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.render.analysis import guides
from clpt.render.lowering.scene import Lowered, lower
from clpt.render.trials import cost, trial
from clpt.scene import Scene
from clpt.scene.integrators import Auto, Integrator, Path
from clpt.scene.media import Homogeneous
from tests.pictures.support import assert_agree, blocks, with_film
from tests.pictures.transport.test_guiding import slit
from tests.pictures.transport.test_hybrid import caustic, lamp, narrow

AUTO = Path(light_paths="auto", max_depth=5)
WAYS = [(0.5, False), (0, False), (0, True)]


def long(scene: Scene, integrator: Integrator = AUTO, **changes: Any) -> Scene:
    """A scene of which so many samples are wanted that a trial is worth it."""
    pixels = scene.film.width * scene.film.height
    changes = {"spp": -(-guides.WORTH // pixels), "integrator": integrator, **changes}
    return dataclasses.replace(scene, **changes)


def ways(scene: Scene) -> list[tuple[Any, bool]]:
    return [(one.light_paths, one.guiding) for one in lower(scene).candidates]


def test_ways_that_are_tried() -> None:
    """The chosen one first; with the depths that the scene says."""
    assert ways(long(caustic())) == WAYS
    assert ways(long(slit())) == WAYS[1:]
    assert {one.max_depth for one in lower(long(caustic())).candidates} == {5}
    shallow = Path(light_paths="auto", max_depth=2)
    assert ways(long(slit(), shallow)) == []


@pytest.mark.parametrize(
    "changes",
    [
        {"spp": 64},
        {"noise": 0.1},
        {"integrator": Auto()},  # photons suit it
        {"integrator": Path(light_paths=0)},
        {"integrator": Path(guiding=True)},
    ],
    ids=str,
)
def test_nothing_is_tried(changes: dict[str, Any]) -> None:
    assert ways(long(caustic(), **changes)) == []


def test_no_guide_is_tried_among_media() -> None:
    fog = Homogeneous(sigma_s=0.01, sigma_a=0.0)
    scene = caustic()
    camera = dataclasses.replace(scene.camera, medium=fog)
    foggy = long(dataclasses.replace(scene, camera=camera))
    assert not any(guiding for _, guiding in ways(foggy))


def test_an_edit_has_no_trial() -> None:
    scene = long(caustic())
    assert lower(scene, former=lower(scene)).candidates == ()


def test_a_guide_that_nobody_asked_for_learns_for_long() -> None:
    scene = long(caustic())
    *_, guided = lower(scene).candidates
    former = dataclasses.replace(lower(scene), integrator=guided)
    assert lower(scene, former=former).settings["guide_paths"] == guides.LONG_PATHS
    asked = dataclasses.replace(scene, integrator=guided)
    assert lower(asked).settings["guide_paths"] == guides.PATHS


def made_up(monkeypatch: pytest.MonkeyPatch, noise: dict[tuple[Any, bool], float]) -> list[Any]:
    """Let trials find these variances at equal rays; return what is tried, as it is."""
    asked: list[Any] = []

    def tried(_: trial.Ground, lowered: Lowered) -> cost.Trial:
        way = lowered.integrator.light_paths, lowered.integrator.guiding
        asked.append(way)
        drawn = np.random.default_rng(len(asked)).normal(1.0, noise[way] ** 0.5, (8, 32, 64, 3))
        return cost.Trial(drawn, 1000)

    monkeypatch.setattr(trial, "tried", tried)
    return asked


@pytest.mark.parametrize("best", WAYS, ids=["light paths", "path", "guiding"])
def test_the_cheapest_way_is_taken(monkeypatch: pytest.MonkeyPatch, best: tuple[Any, bool]) -> None:
    scene = long(caustic())
    asked = made_up(monkeypatch, {way: 0.5 if way == best else 1.0 for way in WAYS})
    ground: Any = None

    def lower_as(way: Integrator) -> Lowered:
        return lower(dataclasses.replace(scene, integrator=way))

    found = trial.decided(ground, lower(scene), lower_as)
    assert asked == WAYS
    assert (found.integrator.light_paths, found.integrator.guiding) == best
    assert found.features.transport.guided == best[1]
    assert "is sharp" in found.reason and "light paths 1.00" in found.reason
    assert found.candidates == ()


def test_no_guide_is_compiled_where_there_is_little_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = made_up(monkeypatch, dict.fromkeys(WAYS, 0.9 * trial.QUIET))
    ground: Any = None
    scene = long(caustic())
    lowered = lower(scene)
    trial.decided(ground, lowered, lambda way: lower(dataclasses.replace(scene, integrator=way)))
    assert asked == WAYS[:2]
    asked.clear()
    alone = lower(long(slit()))
    found = trial.decided(ground, alone, lambda way: alone)
    assert asked == WAYS[1:2] and found.reason == alone.reason


@pytest.fixture
def little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials of few samples, in which guides learn from few light paths."""
    monkeypatch.setattr(guides, "PATHS", 1 << 12)
    monkeypatch.setattr(guides, "LONG_PATHS", 1 << 12)
    monkeypatch.setattr(guides, "WORTH", 1)
    monkeypatch.setattr(trial, "ROUNDS", 2)
    monkeypatch.setattr(trial, "SAMPLES", 4)
    monkeypatch.setattr(trial, "QUIET", 0.0)
    monkeypatch.setattr(cost, "PIXELS", 256)


@pytest.mark.usefixtures("little")
@pytest.mark.parametrize("guiding", [False, True])
def test_a_film_is_that_of_the_way(monkeypatch: pytest.MonkeyPatch, guiding: bool) -> None:
    """It is that of a renderer that was told the way, to the bit, whoever takes which samples."""
    monkeypatch.setattr(trial, "GUIDED_RAY", 0.0 if guiding else 1e9)
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
    assert origin["chosen.guiding"] is guiding
    crop = clpt.Renderer(with_film(scene, crop=(3, 2, 7, 5)), narrow())
    assert crop._wavefront.features.transport.guided == guiding


@pytest.mark.usefixtures("little")
@pytest.mark.parametrize("several", [False, True], ids=["renderer", "several devices"])
def test_a_film_is_gone_on_with_in_its_way(
    monkeypatch: pytest.MonkeyPatch, tmp_path: files.Path, several: bool
) -> None:
    """More samples are wanted than at first, so that there is a trial; and the other way round."""
    monkeypatch.setattr(trial, "GUIDED_RAY", 0.0)
    scene, file = dataclasses.replace(slit(), integrator=Auto()), tmp_path / "a.film"

    def made(worth: int) -> clpt.Renderer | clpt.MultiRenderer:
        monkeypatch.setattr(guides, "WORTH", worth)
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
def test_pictures_that_people_steer_have_no_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial, "GUIDED_RAY", 0.0)
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
