"""The process that renders for Blender: pictures, errors, stops at any moment, a sudden end."""

from __future__ import annotations

import importlib.util
import sys
import time
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.scene import Film, Scene, cameras, lights, shapes

ROOT = Path(__file__).resolve().parents[2]


def _module() -> Any:
    """Return blender/process.py alone: its package needs Blender."""
    spec = importlib.util.spec_from_file_location("clpt_process", ROOT / "blender" / "process.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


process = _module()


@pytest.fixture
def order(tmp_path: Path) -> dict[str, Any]:
    """What Blender would ask for: a white room of 8 x 6 pixels."""
    camera = cameras.Perspective()
    scene = Scene(
        camera=camera,
        shapes=[shapes.Cube()],
        lights=[lights.Constant()],
        film=Film(width=8, height=6),
    )
    clpt.save(scene, tmp_path / "scene.json")
    return {
        "file": str(tmp_path / "scene.json"), "width": 8, "height": 6, "mode": "rgb", "samples": 4,
        "layers": ["albedo"],
    }  # fmt: skip


@pytest.fixture
def child() -> Any:
    running = process.Process(sys.executable)
    yield running
    running.stop()
    assert running.child.poll() is not None


def last(child: Any, limit: float = 120.0) -> tuple[dict[str, Any], list[bytes]]:
    """Return the last message of a render and its pictures."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        received = child.receive(0.2)
        if received is not None and received[0].get("done"):
            return received
    raise AssertionError("the render does not end")


def test_a_picture_and_its_layers_come(child: Any, order: dict[str, Any]) -> None:
    child.send(order)
    message, (picture, albedo) = last(child)
    assert message["samples"] == 4
    assert np.frombuffer(picture, np.float32).reshape(6, 8, 4)[..., 3].min() == 1.0
    assert np.frombuffer(albedo, np.float32).shape == (6 * 8 * 3,)


def test_an_error_is_told_and_the_next_order_is_done(child: Any, order: dict[str, Any]) -> None:
    child.send({**order, "file": "/no/such/scene.json"})
    with pytest.raises(process.ProcessError, match=r"scene\.json"):
        last(child)
    child.send(order)
    assert last(child)[0]["samples"] == 4


def test_it_stops_at_any_moment(child: Any, order: dict[str, Any]) -> None:
    for moment in np.random.default_rng(1).uniform(0.0, 0.5, 6):
        child.send({**order, "samples": 1 << 22})
        time.sleep(moment)
        child.send({"stop": True})
        assert last(child)[0]["samples"] < 1 << 22


def test_a_sudden_end_is_an_error(child: Any, order: dict[str, Any]) -> None:
    child.send({**order, "samples": 1 << 22})
    child.child.kill()
    with pytest.raises(process.ProcessError, match="has ended"):
        last(child)


def test_a_python_without_clpt(tmp_path: Path) -> None:
    with pytest.raises(process.ProcessError, match="does not start"):
        process.Process(str(tmp_path / "python"))
    with pytest.raises(process.ProcessError, match="does not start"):
        process.Process("/bin/false").send({})


def test_a_prepared_process_is_the_first_that_is_taken(
    order: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is one at most; where it has ended before it is taken, another one starts."""
    for ends in (False, True):
        monkeypatch.setattr(process, "_known", weakref.WeakSet())
        process.prepare(sys.executable)
        process.prepare(sys.executable)
        prepared = process._idle[0]
        if ends:
            prepared.child.kill()
            prepared.child.wait()
        taken = process.take(sys.executable)
        assert not process._idle and (taken is prepared) is not ends
        taken.send(order)
        assert last(taken)[0]["samples"] == 4
        taken.stop()
