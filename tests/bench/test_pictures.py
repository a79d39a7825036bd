"""The picture benchmark: points, right and wrong films; most films are made up."""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clpt import bench as benchmark
from clpt import device
from clpt.bench import pictures
from clpt.bench.figures import Figure
from clpt.bench.scenes import PICTURES, SIZES, picture
from clpt.errors import UnknownKindError

GREY = np.full((128, 128, 3), 0.5, np.float32)
RIGHT = pictures.Reference(
    np.full((65, 3), 0.5), np.full((65, 3), 0.01), 32, 1 << 17, MappingProxyType({})
)


class Painted:
    """A renderer whose picture is made up; each run counts up what its film holds if it drifts."""

    image_of: np.ndarray = GREY
    drifts = False

    def __init__(self, scene: Any, on: Any):
        self.runs = 0

    def __enter__(self) -> Painted:
        return self

    def __exit__(self, *error: object) -> None: ...

    def update(self, camera: Any) -> None: ...

    def run(self, samples: int) -> None:
        self.runs += 1

    def image(self) -> np.ndarray:
        return type(self).image_of

    def film_state(self) -> Any:
        return SimpleNamespace(scale=1.0, words=np.full(4, self.runs * type(self).drifts))

    def _device_class(self) -> dict[str, str]:
        return {"device": "a device of paint", "layout": "wide8"}


@pytest.fixture
def painted(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Painted]]:
    """A renderer that paints, in the place of clpt's, and references that are grey."""

    class Own(Painted):
        pass

    monkeypatch.setattr(pictures, "Renderer", Own)
    monkeypatch.setattr(pictures, "references", lambda: dict.fromkeys(PICTURES, RIGHT))
    monkeypatch.setattr(pictures, "first_wrong_stage", lambda *given: "first in intersect: 7")
    monkeypatch.setattr(device.Device, "open", lambda info: None)
    yield Own


def measured(**named: Any) -> list[Figure]:
    on: Any = SimpleNamespace(info=None)
    return list(pictures.measure(on, 3, "quick", **named))


def test_points_of_each_and_of_all(painted: type[Painted]) -> None:
    *each, total = measured()
    assert [figure.scene for figure in each] == list(PICTURES)
    assert all(len(figure.rounds) == 3 and not figure.refused for figure in each)
    for figure in each:
        assert figure.more["points"] == pytest.approx(
            1000 * figure.value / PICTURES[figure.scene].reference
        )
    assert (total.name, total.unit, total.refused) == (pictures.ALL, "points", "")


def test_one_number_is_the_geometric_mean() -> None:
    speeds = dict(zip(PICTURES, (1.0, 2.0, 4.0, 8.0, 16.0), strict=True))
    each = [
        Figure("pictures", name, "Msamples/s", (v, 2 * v), name, {"points_each": 1000.0})
        for name, v in speeds.items()
    ]
    assert pictures.score(each, "quick").rounds == pytest.approx((4000.0, 8000.0))
    total = pictures.score([*each[:-1], each[-1].refuse("wrong")], "quick")
    assert not total.rounds and total.refused == "no score: mist did not pass"


def test_a_scene_alone_has_no_number_of_all(painted: type[Painted]) -> None:
    assert [figure.name for figure in measured(only=("glass",))] == ["glass"]


def test_a_wrong_picture_has_no_points(painted: type[Painted]) -> None:
    painted.image_of = GREY.copy()
    painted.image_of[:32, :64] = 0.7
    *each, total = measured()
    assert each[0].refused == "wrong: 12 % of tiles, first in intersect: 7"
    assert each[0].more["points"] == 0.0 and each[0].more["tiles_wrong"] == 0.125
    assert each[0].record()["value"] is None and each[0].record()["rounds"] == []
    assert total.refused.startswith("no score: cornell, atrium")


def test_rounds_that_differ_are_wrong(painted: type[Painted]) -> None:
    painted.drifts = True
    assert "different films of the same samples" in measured()[0].refused


def test_films_are_compared_to_the_bit_in_a_class_alone(
    painted: type[Painted], monkeypatch: pytest.MonkeyPatch
) -> None:
    renderer: Any = painted(None, None)
    own = pictures.film_class(renderer)
    for made_by, film, exact in (
        (own, pictures.film_digest(renderer), True),
        (own, "another", False),
        ("another", pictures.film_digest(renderer), None),
    ):
        films = {"quick": film, "class": made_by}
        kept = pictures.Reference(RIGHT.mean, RIGHT.deviation, 32, 1 << 17, films)
        monkeypatch.setattr(pictures, "references", lambda kept=kept: dict.fromkeys(PICTURES, kept))
        assert measured(only=("mist",))[0].more["exact"] is exact


def test_scenes_and_sizes() -> None:
    with pytest.raises(UnknownKindError, match="mist"):
        picture("mits", "quick")
    for size in SIZES.values():
        assert size.side % pictures.TILES == 0
    scene = picture("glass", "large", 5)
    assert (scene.film.size, scene.film.mode, scene.seed) == ((1024, 1024), "spectral", 5)
    assert PICTURES.keys() <= benchmark.scenes.SCENES.keys()


@pytest.mark.parametrize(
    "name",
    ["cornell", *(pytest.param(name, marks=pytest.mark.slow) for name in list(PICTURES)[1:])],
)
def test_pictures_of_clpt_pass(name: str) -> None:
    """Each is called wrong at a rate of 1e-4; its samples are always the same."""
    (figure,) = pictures.measure(device.choose(profiling=True), 1, "quick", (name,))
    assert not figure.refused and figure.value > 0.0


def test_wrong_rays_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    found: list[Figure] = []

    def measure(on: Any, scene: Any, rounds: int, layouts: Any, count: int) -> list[Figure]:
        asked.append(layouts)
        return found

    monkeypatch.setattr(pictures.rays, "measure", measure)
    monkeypatch.setattr(pictures.agreement, "first_wrong", lambda *given: "its rays are right")
    on: Any = None
    assert "its rays are right" in pictures.first_wrong_stage(on, on, "wide8")
    found.append(Figure("rays", "wide8 primary closest", "Mrays/s", (1.0,)).refuse("3 not traced"))
    told = pictures.first_wrong_stage(on, on, "brute")
    assert told == "first in intersect: 3 not traced"
    assert asked == [("wide8",), ("binary",)]
