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


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock of the test: each look at it takes the last of these steps [s]."""
    now, steps = 0.0, [0.0]

    def look() -> float:
        nonlocal now
        now += steps[-1]
        return now

    monkeypatch.setattr(render_loop, "time", SimpleNamespace(perf_counter=look))
    return steps


def test_a_slow_drag_prepares_no_kernels(steps: list[float]) -> None:
    """Coarser previews have the kernels of finer ones: nobody is told that kernels are prepared."""
    outlet: Any = Audience()
    loop = RenderLoop(small(), device.choose(), outlet, Display())
    steps.append(1.0)
    try:
        for step in range(4):
            camera = dataclasses.replace(loop.scene.camera, fov=40.0 + step)
            loop.begin(dataclasses.replace(loop.scene, camera=camera), Change(camera=camera))
            while loop._previews_left:
                loop.advance()
    finally:
        loop.close()
    assert outlet.frames[-1][0]["divider"] > outlet.frames[0][0]["divider"]
    assert [m["phase"] for m in outlet.messages if "phase" in m].count("preparing") == 1


def test_a_picture_that_is_discarded_is_not_shown(steps: list[float]) -> None:
    """What moves while a pass is made empties its film: no viewer sees that black picture."""
    outlet: Any = Audience()
    loop = RenderLoop(small(), device.choose(), outlet, Display())
    steps.append(1.0)
    try:
        loop.renderer()
        while loop._previews_left:
            loop.advance()
        loop.cancel(discard=True)
        loop.advance()
        loop.advance()
    finally:
        loop.close()
    assert [(frame["samples"], frame["divider"]) for frame, _ in outlet.frames][-1] == (1, 1)
    assert all(frame["samples"] > 0 for frame, _ in outlet.frames)


def test_previews_become_finer_again(steps: list[float]) -> None:
    """A second a look makes them coarser, none lets them be as before."""
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
