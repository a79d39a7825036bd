"""The page of all that was measured."""

from __future__ import annotations

from typing import Any

from bench import report


def test_every_record_can_be_shown() -> None:
    found = report.machines()
    text = report.page(found)
    assert len(found) > 3
    assert all(f"## {processor}\n" in text for processor in found)


def test_the_best_way_of_the_newest_film_stands_for_a_scene() -> None:
    about = {"mode": "rgb", "as_file": False, "threads": 1, "scene": "s"}

    def row(day: int, ratio: float, **more: Any) -> dict[str, Any]:
        return {**about, "date": f"2026-01-0{day}", "efficiency_ratio": ratio, **more}

    old = row(1, 9.0, size=[8, 8])
    path = row(2, 1.0, size=[8, 8], way="path", sampler="best")
    guided = row(2, 2.0, size=[8, 8], way="guiding", sampler="best")
    again = row(3, 1.5, size=[8, 8], way="guiding", sampler="best")
    other = row(2, 3.0, size=[8, 8], way="path", sampler="file")
    intels = row(2, 4.0, size=[8, 8], way="path", sampler="best", runtime="Intel(R) OpenCL")
    found = report.best_ways([again, old, path, guided, other, intels])
    assert sorted(found, key=len) == [[intels], [other], [again, path]]
