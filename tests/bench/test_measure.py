"""Measuring, on the smallest of scenes: right rays and layouts that lie, stages, builds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from clpt import bench as benchmark
from clpt import device
from clpt.bench import building, figures, rays, shading, stages
from clpt.errors import SceneError, UnknownKindError
from clpt.rays import Accel
from clpt.records import PATH
from clpt.scene import Scene
from clpt.scene.materials import LEAVES

COUNT = 1024


@pytest.fixture(scope="module", autouse=True)
def small_copies() -> Iterator[None]:
    """What bandwidth is measured with at its largest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "LARGEST", 1 << 20)
        yield


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose(profiling=True)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return benchmark.opened("cornell", "rgb")


def test_scenes() -> None:
    with pytest.raises(UnknownKindError, match="atrium"):
        benchmark.scenes.build_scene("atrum")
    with pytest.raises(SceneError):
        benchmark.opened("none.json")
    assert benchmark.opened("cornell").film.mode == "spectral"


def test_rays_are_taken_from_the_scene(on: device.Device, scene: Scene) -> None:
    _, _, ray_sets = rays.sets(on, scene, COUNT)
    assert list(ray_sets) == ["primary", "diffuse", "shadow"]
    for one in ray_sets.values():
        assert 0.4 * COUNT < len(one) <= COUNT + 64
        np.testing.assert_allclose(np.linalg.norm(one.directions, axis=1), 1.0, atol=1e-5)
    primary, shadow = ray_sets["primary"], ray_sets["shadow"]
    assert np.abs(primary.origins - [0, 0, 3.9]).max() < 0.02  # on the near plane
    to = shadow.origins + shadow.t_max[:, None] * shadow.directions
    np.testing.assert_allclose(to[:, 1], 0.999, atol=2e-3)  # the lamp
    assert np.abs(to[:, [0, 2]]).max() < 0.26
    tile = primary.directions[:16] @ primary.directions[:16].T
    assert tile.min() > (primary.directions[:1] @ primary.directions.T).min() + 0.02


class Lying:
    """An accel that answers with `change` of the truth."""

    change: Callable[[str, Any], None]

    def __init__(self, *given: Any, **named: Any):
        self.accel = Accel(*given, **named)

    def update(self, vertices: np.ndarray) -> None:
        self.accel.update(vertices)

    def intersect(self, **named: Any) -> Any:
        hits = self.accel.intersect(**named)
        type(self).change("closest", hits)
        return hits

    def occluded(self, **named: Any) -> Any:
        met = self.accel.occluded(**named)
        type(self).change("any", met)
        return met


def _tell(array: Any, change: Callable[[np.ndarray], None]) -> None:
    host = array.get()
    change(host)
    array.set(host)


def _lies(query: str, found: Any) -> None:
    """Tell nothing about one ray."""
    if query == "closest":
        _tell(found.primitive, lambda host: host.__setitem__(5, rays.POISON))


def _misses(query: str, found: Any) -> None:
    """Lose triangle 3."""
    if query == "closest":
        which = found.primitive.get() == 3
        _tell(found.primitive, lambda host: host.__setitem__(which, -1))
        _tell(found.t, lambda host: host.__setitem__(which, np.inf))


def _always(query: str, found: Any) -> None:
    """Something is always in the way."""
    if query == "any":
        _tell(found, lambda host: host.fill(1))


@pytest.mark.parametrize(
    ("change", "query", "told"),
    [
        (None, "", ""),
        (_lies, "closest", "were not traced"),
        (_misses, "closest", "tried with every triangle"),
        (_always, "any", "agree with the closest"),
    ],
)
def test_layouts_that_lie_are_refused(
    on: device.Device, scene: Scene, change: Any, query: str, told: str
) -> None:
    Lying.change = staticmethod(change) if change else None
    accel = Lying if change else Accel
    figures = list(rays.measure(on, scene, 1, ("wide8",), COUNT, accel))
    assert [figure.name for figure in figures] == [
        f"wide8 {name} {kind}"
        for name in ("primary", "diffuse", "shadow")
        for kind in ("closest", "any")
    ]
    refused = [figure for figure in figures if figure.refused]
    assert bool(refused) == bool(change)
    assert any(told in f.refused and f.name.endswith(query) for f in figures)
    for figure in refused:  # a wrong closest hit shows beside the right answer of any
        assert told in figure.refused or "agree with" in figure.refused
    for figure in figures:
        assert figure.value > 0.0 and figure.more["count"] <= COUNT + 64


def test_stages_have_work_and_queues_that_are_right(on: device.Device, scene: Scene) -> None:
    figures = {f.name: f for f in stages.measure(on, scene, 2, slots=COUNT)}
    assert list(figures) == [
        "generate", "intersect", "shade_diffuse", "shadow", "append", "accumulate",
    ]  # fmt: skip
    for figure in figures.values():
        assert figure.refused == "" and figure.value > 0.0
        assert figure.more["gbytes"] == pytest.approx(figure.value * figure.more["bytes"] * 1e-3)
    each = figures["intersect"].more["items"] / stages.BOUNCES
    assert 0.9 * COUNT < each <= figures["intersect"].more["slots"]
    assert 0 < figures["generate"].more["items"] < figures["shade_diffuse"].more["items"]
    only = [f.name for f in stages.measure(on, scene, 1, ("shade", "append"), slots=COUNT)]
    assert only == ["shade_diffuse", "append"]


def test_a_box_keeps_all_slots_at_its_kind(on: device.Device) -> None:
    figures = list(shading.measure(on, 1, ("diffuse",), ("rgb",), COUNT))
    assert [figure.name for figure in figures] == ["diffuse constant", "diffuse textured"]
    for figure in figures:
        assert figure.refused == "" and figure.value > 0.0 and figure.more["of_diffuse"] > 0.0
        assert figure.more["items"] > 0.95 * shading.BOUNCES * COUNT  # the film has fewer pixels
    with pytest.raises(UnknownKindError, match="rough_plastic"):
        next(shading.measure(on, 1, ("rough_plastik",)))


def test_every_kind_has_a_box() -> None:
    made = {cls.kind: shading.variants(cls) for cls in LEAVES}
    assert all("constant" in own for own in made.values())
    assert set(made["gltf_surface"]) == set(shading.VARIANTS)
    assert made["principled"]["full"].clearcoat > 0.0


def test_state_is_read_as_it_lies(on: device.Device, scene: Scene) -> None:
    flight = stages.Flight(on, scene, COUNT)
    assert flight.waiting.all() and not flight.alive.any()
    flight.stage(flight.wavefront.stages[0])
    alive = flight.alive
    assert alive.sum() == flight.scene.film.width * flight.scene.film.height
    d = flight.read(PATH, "d")
    assert d.shape == (flight.slots, 3)
    np.testing.assert_allclose(np.linalg.norm(d[alive], axis=1), 1.0, atol=1e-5)
    assert len(set(flight.read(PATH, "pixel_index")[alive].tolist())) == alive.sum()


def test_builds_and_copies(on: device.Device, scene: Scene) -> None:
    built = [f for f in building.measure(on, scene, 1, ("wide8",), COUNT) if not f.refused]
    assert [figure.name for figure in built] == ["build wide8", "build wide8 fast", "refit wide8"]
    assert built[0].more["triangles"] == 36
    Lying.change = staticmethod(_misses)
    refused = [f.refused for f in building.measure(on, scene, 1, ("wide8",), COUNT, Lying)]
    assert all("tried with every triangle" in told for told in refused)
    (copied,) = figures.measure(on, 2, (1 << 16,))
    assert copied.refused == "" and 0.01 < copied.value < 1e5
    copying = figures.Copying(on)
    assert copying.complaint(1e3, 1.0, 1 << 16) == ""
    assert "GB/s cannot be" in copying.complaint(1e15, 1e-3, 1 << 16)
