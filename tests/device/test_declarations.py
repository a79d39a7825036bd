"""clpt's own declarations of built-in functions: those that its texts call, with a second try."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt import device as dev
from clpt.device import building, native_programs
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.wavefront import light_caches
from clpt.scene import Film
from tests.front_end import CLANG, OURS, errors
from tests.test_other_compilers import builders, of_every_material, texts_of

needs_clang = pytest.mark.skipif(CLANG is None, reason="clang is not installed")


def check(given: Iterable[str]) -> None:
    found = errors([building.declarations() + text for text in given], functions=OURS)
    assert found
    for error in found:
        assert not error, error[:3000]


def as_cpus_get_them(lowered: Lowered) -> list[str]:
    """All programs of a scene, each once."""
    return list(dict.fromkeys(texts_of(lowered, (1, 8), ("stages", "loop", "film"))))


@needs_clang
def test_builders() -> None:
    check(builders())


@needs_clang
def test_programs_that_know_no_scene() -> None:
    """Developing pictures, denoising, the trial of a device; of photons and of the guide."""
    light = [light_caches.PHOTON_ROOT, light_caches.GUIDE_ROOT]
    alone = ["stage/resolve.cl", "stage/denoise.cl", "stage/trial.cl", *light]
    defines = {"LANES": 8, "TRIAL_NODES": 64}
    check(dev.assemble(root, {}, defines).text for root in alone)


@needs_clang
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_a_scene(scenes: Path, mode: str) -> None:
    scene = clpt.load(scenes / "cornell.xml")
    small = dataclasses.replace(scene, film=Film(width=4, height=4, mode=mode))
    check(as_cpus_get_them(lower(small)))


@needs_clang
@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_every_material(mode: str) -> None:
    check(as_cpus_get_them(of_every_material(mode)))


@pytest.mark.parametrize(("value", "tries"), [("sqrt(16.0f)", 1), ("fdim(9.0f, 5.0f)", 2)])
def test_what_is_not_declared_is_tried_with_the_header(value: str, tries: int) -> None:
    on = dev.Device.open(dev.choose().info)
    if not on.info.is_pocl:
        tries = 1
    made = []

    def build(text: str, flags: list[str]) -> cl.Program:
        made.append(flags)
        return native_programs.build(on.context, on.info.cl_device, text, flags)

    text = f"kernel void given(global float *out) {{ out[0] = {value}; }}"
    program = building.first_built(on, text, ["-cl-std=CL1.2"], build)
    assert len(made) == tries
    out, found = cl.Buffer(on.context, cl.mem_flags.READ_WRITE, 4), np.empty(1, np.float32)
    program.given(on.queue, (1,), (1,), out)
    cl.enqueue_copy(on.queue, found, out)
    assert found[0] == 4.0


def test_no_macro_is_left() -> None:
    text = building.declarations()
    left = {line.split()[1].partition("(")[0] for line in text.splitlines() if "#define" in line}
    assert left == {line.split()[1] for line in text.splitlines() if "#undef" in line}
