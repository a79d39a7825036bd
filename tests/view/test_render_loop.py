"""The steps of previews: coarser under load, and finer again when the machine is free."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import pytest

from clpt import device
from clpt.view import render_loop
from clpt.view.pictures import Display
from clpt.view.render_loop import PREVIEW_SAMPLES, RenderLoop, finer_divider
from clpt.view.target import Change
from tests.view.test_session import Audience, small


def test_previews_become_finer_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock of the test: a second a look makes them coarser, none lets them be as before."""
    now, steps = 0.0, [0.0]

    def look() -> float:
        nonlocal now
        now += steps[-1]
        return now

    clock = SimpleNamespace(perf_counter=look)
    monkeypatch.setattr(render_loop, "time", clock)
    scene = small()
    outlet: Any = Audience()
    loop = RenderLoop(scene, device.choose(), outlet, Display())
    dividers = []
    try:
        for step in (1.0, 0.0):
            steps.append(step)
            for _ in range(6):
                moved = dataclasses.replace(loop.scene)
                loop.begin(moved, Change(whole=True))
                for _ in range(PREVIEW_SAMPLES):
                    if loop._previews_left:
                        loop.advance()
            dividers.append(outlet.frames[-1][0]["divider"])
    finally:
        loop.close()
    assert dividers[0] > 2
    assert outlet.frames[0][0]["divider"] <= dividers[1] < dividers[0]


def test_finer_dividers() -> None:
    assert [finer_divider(n, 2) for n in (2, 3, 4, 8, 256)] == [2, 2, 3, 6, 128]
