"""Launches of the bounce loop: a host looks at its limits between them."""

from __future__ import annotations

import pytest

from clpt.render.wavefront.bounce_loop import LOOP_SECONDS, next_bounces


@pytest.mark.parametrize("most", [1, 8, 4096])
@pytest.mark.parametrize("cancel_seconds", [None, 0.05, 3.0])
@pytest.mark.parametrize("cost", [1e-7, 1e-4, 1e-2, 1.0, 100.0])
def test_a_launch_is_short_or_of_one_bounce(
    cost: float, cancel_seconds: float | None, most: int
) -> None:
    """cost: of a bounce of all slots [s]. Launches double from one bounce, and never exceed."""
    bounces, launches = 1, []
    for _ in range(20):
        launches.append(bounces)
        bounces = next_bounces(bounces, bounces * cost, most, cancel_seconds)
    assert all(n == 1 or n * cost <= LOOP_SECONDS for n in launches)
    assert all(1 <= n <= most for n in launches)
    if cancel_seconds is None:  # and as many bounces as suit the device where they are cheap
        assert launches[-1] == max(1, min(most, int(LOOP_SECONDS / cost + 1e-9)))


def test_a_scene_that_becomes_dear_has_shorter_launches_at_once() -> None:
    assert next_bounces(4096, 4096 * 1e-5, 4096, None) == 4096
    assert next_bounces(4096, 40.0, 4096, None) <= 51
