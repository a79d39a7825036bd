"""A host program that counts clpt's calls of OpenCL; run by test_calls.py, calls.c in front.

Writes one JSON object: what was done -> the calls that it made.
"""

from __future__ import annotations

import ctypes
import dataclasses
import gc
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array

import clpt
from clpt.scene.materials import Diffuse
from tests.pictures.support import with_film

NAMES = (
    "clFinish", "clWaitForEvents", "clEnqueueReadBuffer", "clEnqueueMapBuffer",
    "clEnqueueNDRangeKernel", "clGetPlatformIDs", "clCreateContext", "clCreateCommandQueue",
    "clCreateCommandQueueWithProperties", "clBuildProgram", "clCreateBuffer", "clRetainMemObject",
    "clReleaseMemObject",
)  # fmt: skip
LIBRARY = ctypes.CDLL(None)
report: dict[str, dict[str, int]] = {}


def counts() -> dict[str, int]:
    return {name: ctypes.c_long.in_dll(LIBRARY, f"count_{name}").value for name in NAMES}


@contextmanager
def told_as(what: str) -> Iterator[None]:
    """Note what is called inside."""
    before = counts()
    yield
    after = counts()
    report[what] = {name: after[name] - before[name] for name in NAMES}


def buffers() -> int:
    """References to memory on devices that were taken and not given back."""
    now = counts()
    return now["clCreateBuffer"] + now["clRetainMemObject"] - now["clReleaseMemObject"]


def main(scene_file: str) -> None:
    gc.disable()
    queue = cl.CommandQueue(cl.Context([cl.get_platforms()[0].get_devices()[0]]))
    scene = with_film(clpt.load(scene_file), mode="rgb", width=24, height=20)
    render(queue, scene)
    report["left"] = {"buffers": buffers()}
    with told_as("another"):
        clpt.Renderer(scene, queue=queue, slots=1024)
    accel(queue)
    report["left by queries"] = {"buffers": buffers()}
    json.dump(report, sys.stdout)


def render(queue: cl.CommandQueue, scene: clpt.Scene) -> None:
    """Every command of a renderer, the first of them held up by an event."""
    with told_as("make"):
        renderer = clpt.Renderer(scene, queue=queue, slots=1024)
    late = cl.UserEvent(queue.context)
    place = cl_array.to_device(queue, np.float32(scene.shapes[-1].to_world))
    renderer.update(transforms={-1 + len(scene.shapes): place})
    renderer.step(1)
    renderer.update(camera=dataclasses.replace(scene.camera, fov=25.0))
    renderer.resolve()
    made, white = cl_array.empty(queue, (20, 24, 4), np.uint8), scene.shapes[0].material
    commands: dict[str, Callable[[], Any]] = {
        "step after a late event": lambda: renderer.step(2, wait_for=[late]),
        "step": lambda: renderer.step(3),
        "camera": lambda: renderer.update(camera=scene.camera),
        "material": lambda: renderer.update(materials={white: Diffuse(reflectance=0.3)}),
        "move": lambda: renderer.update(transforms={-1 + len(scene.shapes): place}),
        "reset": renderer.reset,
        "resolve": lambda: renderer.resolve(made),
        "film": lambda: renderer.film,
    }
    for what, command in commands.items():
        with told_as(what):
            command()
    late.set_status(cl.command_execution_status.COMPLETE)
    with told_as("picture"):
        renderer.image()
    renderer.close()


def accel(queue: cl.CommandQueue) -> None:
    """Ray queries on device arrays."""
    rng = np.random.default_rng(1)
    vertices = cl_array.to_device(queue, rng.random((300, 3), np.float32))
    faces = cl_array.to_device(queue, np.arange(300, dtype=np.uint32).reshape(100, 3))
    tree = clpt.Accel(queue, vertices, faces)
    rays = [cl_array.to_device(queue, rng.random((64, 3), np.float32)) for _ in range(2)]
    tree.intersect(*rays)
    tree.occluded(*rays)
    tree.update(vertices)
    with told_as("intersect"):
        hits = tree.intersect(*rays)
    with told_as("occluded"):
        shadows = tree.occluded(*rays)
    with told_as("refit"):
        tree.update(vertices)
    del hits, shadows


if __name__ == "__main__":
    main(sys.argv[1])
