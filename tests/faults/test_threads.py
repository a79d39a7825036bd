"""Any method of a renderer may be called from any thread."""

from __future__ import annotations

from pathlib import Path

import pytest

import clpt
from tests.faults.interrupts import small
from tests.faults.threads import is_as_new, together


@pytest.mark.parametrize("each", [30, pytest.param(3000, marks=pytest.mark.slow)])
def test_threads_call_at_random(scenes: Path, tmp_path: Path, each: int) -> None:
    with clpt.Renderer(small(clpt.load(scenes / "cornell.xml")), slots=128) as renderer:
        count, faults = together(renderer, tmp_path, each=each)
        assert count == 6 * each and not faults
        assert is_as_new(renderer)


def test_events_of_the_film_stay_for_who_uses_them(scenes: Path) -> None:
    """A driver reads the list while other threads run: it must not change under it."""
    with clpt.Renderer(small(clpt.load(scenes / "cornell.xml")), slots=128) as renderer:
        events = renderer.film.events
        before = list(events)
        part = renderer.film[:, :, :3]
        event = renderer.step()
        assert list(events) == before and event not in before
        assert part.events == renderer.film.events == [event], "views share their events"
