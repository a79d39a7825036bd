"""Launches of the bounce loop: a host looks at its limits between them."""

from __future__ import annotations

import itertools
import os
import time

import numpy as np
import pytest

import clpt
from clpt.render.wavefront import bounce_loop, launches
from clpt.render.wavefront.launches import (
    AIM_SECONDS,
    LEAST_SECONDS,
    LONGER,
    Limits,
    Size,
    first_size,
    next_size,
)
from clpt.scene import Film, Scene, cameras, integrators, lights, materials, media, shapes
from clpt.transforms import look_at, scale, translate

SHARE, LANES, ITEMS = 512, 16, 4
EYE = cameras.Perspective(to_world=look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]), fov=40)


def sizes(limits: Limits, cost: float, count: int) -> list[Size]:
    """The sizes of launches; cost: of a bounce of all slots [s]."""
    size, begin, every = first_size(SHARE, LANES), 0, []
    for _ in range(count):
        every.append(size)
        begin = (begin + size.share) % SHARE if begin + size.share < SHARE else 0
        took = size.share / SHARE * size.bounces * cost
        size = next_size(size, took, limits, begin == 0)
    return every


@pytest.mark.parametrize("most", [1, 8, 4096])
@pytest.mark.parametrize("cancel_seconds", [None, 0.05, 3.0])
@pytest.mark.parametrize("cost", [1e-7, 1e-4, 1e-2, 1.0, 100.0])
def test_a_launch_is_short_or_of_a_bounce_of_a_block(
    cost: float, cancel_seconds: float | None, most: int
) -> None:
    every = sizes(Limits(SHARE, LANES, most, cancel_seconds), cost, 80)
    longer = min(int(LEAST_SECONDS / cost + 1e-9), LONGER * most)  # where all launches are short
    longest = max(most, longer) if cancel_seconds is None else most
    for size in every[1:]:
        short = size.share * size.bounces / SHARE * cost <= AIM_SECONDS
        assert short or size == Size(LANES, 1)
        assert size.share in (16, 32, 64, 128, 256, 512) and 1 <= size.bounces <= longest
    if cancel_seconds is None and cost <= AIM_SECONDS:  # as many bounces as suit the device
        assert every[-1] == Size(SHARE, max(1, min(longest, int(AIM_SECONDS / cost + 1e-9))))


def test_launches_take_all_slots_once_before_they_grow() -> None:
    shares = [size.share for size in sizes(Limits(SHARE, LANES, 64), 1e-4, 32)]
    expected = [[share] * (SHARE // share) for share in (32, 64, 128, 256)]
    assert shares == [*itertools.chain(*expected), SHARE, SHARE]


def test_a_scene_that_becomes_dear_has_shorter_launches_at_once() -> None:
    limits = Limits(SHARE, LANES, 4096)
    assert next_size(Size(SHARE, 4096), 4096 * 1e-5, limits, True) == Size(SHARE, 4096)
    assert next_size(Size(SHARE, 4096), 40.0, limits, True) == Size(SHARE, 25)
    assert next_size(Size(SHARE, 4096), 4.0, limits, True, was_cut=True) == Size(LANES * 2, 1)


def smoke(sigma_t: float, *, dense: bool) -> media.Grid:
    """Smoke of a few points; dense: in bricks that are empty elsewhere, all collisions null."""
    density = np.zeros((16, 16, 16), np.float32)
    density[::4, ::4, ::4] = 1e-6 if dense else 1.0
    density[0, 0, 0] = density[5::8, 5::8, 5::8] = 1.0
    place = translate([-1, -1, -1]) @ scale(2)
    return media.Grid(density=density, sigma_t=sigma_t, albedo=0.99, to_world=place)


def scene(medium: media.Grid, size: int, integrator: integrators.Integrator) -> Scene:
    box = shapes.Cube(material=materials.Null(), interior=medium)
    lamp = lights.Point(position=[1.0, 2.0, 2.0], intensity=5.0)
    floor = shapes.Rectangle(
        material=materials.Diffuse(reflectance=0.5), to_world=translate([0, 0, -2]) @ scale(4)
    )
    return Scene(
        camera=EYE, shapes=[box, floor], lights=[lights.Constant(), lamp], integrator=integrator,
        film=Film(width=size, height=size),
    )  # fmt: skip


@pytest.mark.parametrize("share", [16, 64, 512])
@pytest.mark.parametrize(
    "integrator",
    [
        integrators.Path(max_depth=12),
        pytest.param(integrators.Vcm(max_depth=8), marks=pytest.mark.slow),
    ],
    ids=lambda integrator: integrator.kind,
)
def test_films_do_not_depend_on_launches(
    integrator: integrators.Integrator, share: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Parts of the slots, and launches that are cut at any moment, leave each bit as it is."""
    described = scene(smoke(8.0, dense=False), 24, integrator)
    with clpt.Renderer(described) as renderer:
        renderer.run(4)
        expected = renderer.image()
    monkeypatch.setattr(launches, "LOOP_SECONDS", 0.0)  # each launch is cut
    monkeypatch.setattr(launches, "first_size", lambda *_: Size(share, 3))
    monkeypatch.setattr(launches, "next_size", lambda size, *_: size)
    with clpt.Renderer(described) as renderer:
        renderer.run(4)
        assert np.array_equal(renderer.image(), expected)


def test_a_run_that_is_told_to_stop_ends_though_its_paths_do_not() -> None:
    """Each flight has 262,144 null collisions; paths that are abandoned count as rejected."""
    described = scene(smoke(1e9, dense=True), 100, integrators.Path(max_depth=8))
    cores = os.cpu_count() or 1
    with clpt.Renderer(described) as renderer:
        renderer.prepare()
        before, begun = time.process_time(), time.monotonic()
        finished = renderer.run(64, lambda _: time.monotonic() < begun + 1)
        took = (time.process_time() - before) / cores
        counts, image = renderer.counts, renderer.image()
    assert not finished and 0 < counts.rejected <= counts.samples < 100 * 100 * 64
    assert np.isfinite(image).all()
    assert took < 1 + bounce_loop.FINISH_SECONDS + 3 * launches.LOOP_SECONDS
