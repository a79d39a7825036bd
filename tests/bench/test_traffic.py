"""What stages move, counted in their text, against sums by hand."""

from __future__ import annotations

from clpt.bench.stages import Moved, traffic
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import Perspective


def moved(mode: str, queued: bool, *more: lights.Light) -> dict[str, Moved]:
    ground = shapes.Rectangle(material=materials.Diffuse())
    lamps = [lights.Point(), *more]
    film = Film(width=4, height=4, mode=mode)
    scene = Scene(camera=Perspective(), shapes=[ground], lights=lamps, film=film)
    return traffic(lower(scene).features, "wide8", queued=queued)


def test_a_ray_and_its_hit() -> None:
    """Read: o, d, pdf, state; written: t, u, v, n, plane, side, prim, shape, material."""
    for mode in ("rgb", "spectral"):
        assert moved(mode, False)["intersect"] == Moved(4 * 8, 4 * 11)


def test_a_path_that_ends_and_the_next() -> None:
    """A spectrum has three words in rgb mode, else four, and wavelengths; a sky takes o, side, d,
    pdf, beta."""
    sums = 3 + 3 + 3 + 1  # low, middle, high, samples
    rest = sums + 1 + 1 + 1 + 1 + 1  # weight, place, sample, state, prim
    assert moved("rgb", False)["generate"].read == 4 * (rest + 3)
    assert moved("spectral", False)["generate"].read == 4 * (rest + 2 * 4)
    with_sky = moved("spectral", False, lights.Constant())["generate"].read
    assert with_sky == 4 * (rest + 2 * 4 + 3 + 3 + 3 + 1 + 4)


def test_queues() -> None:
    plain, sorted_ = moved("rgb", False), moved("rgb", True)
    assert "append" not in plain
    assert sorted_["append"] == Moved(4 * 3, 4)  # state, prim and material; a slot
    for stage in ("shade_diffuse", "generate", "shadow"):
        assert sorted_[stage].read == plain[stage].read + 4
    assert sorted_["shade_diffuse"].written == plain["shade_diffuse"].written > 0
