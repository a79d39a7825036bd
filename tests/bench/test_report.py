"""The page of all that was measured."""

from __future__ import annotations

from bench import report


def test_every_record_can_be_shown() -> None:
    found = report.machines()
    text = report.page(found)
    assert len(found) > 3
    assert all(f"## {processor}\n" in text for processor in found)
