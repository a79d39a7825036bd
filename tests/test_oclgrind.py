"""Kernels under Oclgrind, a simulator that checks every access: no invalid one, no race.

Its device is one lane wide; rendering eight lanes wide shows what idle lanes touch. Those may read
what another work-item writes (and drop it), so races are looked for at one lane.
"""

from __future__ import annotations

import dataclasses
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import spectra, transforms
from clpt.scene import Film, Scene, cameras, integrators, lights, materials, shapes, textures

ROOT = Path(__file__).resolve().parents[1]

pytestmark = pytest.mark.skipif(
    shutil.which("oclgrind") is None, reason="oclgrind (a Debian package) is not installed"
)

RENDER = """
import sys
import clpt
from clpt import device
from tests.test_oclgrind import small_scene
name, mode, lanes, layout, queued = sys.argv[1:]
device.Device.lanes = property(lambda self: int(lanes))
queued = queued == "1"
image = clpt.render(
    small_scene(name, mode), 2, slots=64, layout=layout, queued=queued, looped=False
)
assert image.shape[:2] == (5, 6) and image.sum() < 1e6 and image.max() > 0.0
assert mode == "spectral" or image.min() >= 0.0  # a few wavelengths make colours beyond Rec. 709
"""
OUT_OF_BOUNDS = """
import numpy as np, pyopencl as cl
context = cl.create_some_context(interactive=False)
queue = cl.CommandQueue(context)
text = "kernel void probe(global int *a) { a[get_global_id(0) + 1] = 1; }"
program = cl.Program(context, text).build(cache_dir=False)
program.probe(queue, (4,), None, cl.Buffer(context, cl.mem_flags.READ_WRITE, 16))
queue.finish()
"""
UNALIGNED = """
import numpy as np, pyopencl as cl
context = cl.create_some_context(interactive=False)
queue = cl.CommandQueue(context)
text = "kernel void probe(global int *a) { *(global long *)(a + 1) = 1; }"
program = cl.Program(context, text).build(cache_dir=False)
program.probe(queue, (1,), None, cl.Buffer(context, cl.mem_flags.READ_WRITE, 16))
queue.finish()
"""


def waves(film: Film, photons: bool) -> Scene:
    """All that wavelengths do, in a row of balls; `photons`: light tracing, as far as it can."""
    layers = (materials.Layer(thickness=500.0), materials.Layer(eta=2.0, k=0.1, thickness=60.0))
    dye = spectra.Fluorophore(spectra.LED(450.0, 60.0), spectra.LED(560.0, 60.0), 0.9)
    chart = clpt.SpectralImage(np.full((2, 2, 5), 0.4), np.linspace(400.0, 700.0, 5))
    row: list[materials.Material] = [
        materials.Dielectric(int_ior="sf11", absorption=0.3, layers=layers),
        materials.RoughDielectric(int_ior="sf11", absorption=0.3),
        materials.RoughConductor(layers=layers),
        materials.Grating(),
        materials.Diffuse(reflectance=textures.Bitmap(image=chart)),
    ]
    if not photons:
        row.append(materials.Fluorescent(reflectance=0.1, reradiation=dye))
    places = [transforms.translate([i - 2.5, i % 2 - 0.5, 0.0]) for i in range(len(row))]
    view = transforms.look_at([0, 0, 6], [0, 0, 0], [0, 1, 0])
    camera = cameras.Perspective(to_world=view)
    if not photons and film.mode == "spectral":
        camera = cameras.ThinLens(to_world=view, aperture_radius=0.1, focus_distance=6, glass="f2")
        film = dataclasses.replace(film, bands=7, lambda_min=300.0)
    return Scene(
        camera=camera,
        shapes=[
            shapes.Sphere(radius=0.6, material=material, to_world=place)
            for material, place in zip(row, places, strict=True)
        ],
        lights=[lights.Constant(radiance=spectra.illuminant("F11"))],
        integrator=integrators.ParticleTracer() if photons else integrators.Path(),
        film=film,
    )


def caustic(film: Film) -> Scene:
    """A floor and a small lamp over a ball of glass, seen beside a mirror: photons everywhere."""
    glass = materials.Dielectric(int_ior="sf11" if film.mode == "spectral" else 1.5)
    lamp = transforms.translate([0, 0, 2.0]) @ transforms.rotate([1, 0, 0], 180)
    upright = transforms.translate([0, 0.8, 0.4]) @ transforms.rotate([1, 0, 0], 90)
    view = transforms.look_at([0.5, -2.0, 1.0], [0, 0, 0.2], [0, 0, 1])
    return Scene(
        camera=cameras.Perspective(to_world=view),
        shapes=[
            shapes.Rectangle(material=materials.Diffuse()),
            shapes.Rectangle(material=materials.Conductor(), to_world=upright),
            shapes.Sphere(material=glass, center=(0, 0, 0.6), radius=0.4),
            shapes.Disk(emission=lights.Area(radiance=50.0), to_world=lamp @ transforms.scale(0.2)),
        ],
        lights=[lights.Point(position=(0.5, 0.5, 1.5))],
        integrator=integrators.Vcm(light_paths=1, radius=0.3),
        film=film,
    )


def small_scene(name: str, mode: str) -> Scene:
    """A scene of the tests, or one without triangles, on a film of 6x5 pixels."""
    film = Film(width=6, height=5, mode=mode)
    if name in ("waves", "photons"):
        return waves(film, name == "photons")
    if name == "merging":
        return caustic(film)
    if name != "ball":
        scene = clpt.load(ROOT / "tests" / "scenes" / f"{name}.xml")
        return dataclasses.replace(scene, film=dataclasses.replace(film, filter=scene.film.filter))
    board = textures.Checkerboard(color0=0.8)
    matte = materials.Diffuse(reflectance=board)
    metal = materials.RoughConductor(alpha_u=board)
    glowing = lights.Area(radiance=board)
    view = transforms.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    return Scene(
        camera=cameras.Perspective(to_world=view),
        shapes=[
            shapes.Sphere(material=matte),
            shapes.Disk(material=metal),
            shapes.Cylinder(p0=(-1.6, -1, 0), p1=(-1.6, 1, 0), radius=0.3, emission=glowing),
        ],
        film=film,
    )


def checked(tmp_path: Path, script: str, *arguments: str, races: bool = False) -> str:
    """Run a script under Oclgrind; return what it found."""
    log = tmp_path / "oclgrind.log"
    command = ["oclgrind", "--log", str(log), *(["--data-races"] if races else [])]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("CLPT_DEVICE", None)
    done = subprocess.run(
        [*command, sys.executable, "-c", script, *arguments],
        capture_output=True, text=True, timeout=300, cwd=tmp_path, env=environment, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return log.read_text(encoding="utf-8").strip() if log.exists() else ""


def test_it_finds_what_is_wrong(tmp_path: Path) -> None:
    assert "Invalid write" in checked(tmp_path, OUT_OF_BOUNDS)
    assert "not aligned to the pointed type" in checked(tmp_path, UNALIGNED)


QUICK = [
    ("ball", "spectral", "8", "binary", "0"),
    ("plastic", "spectral", "1", "compact", "1"),
    ("textures", "rgb", "8", "wide8", "0"),
    ("delta_lights", "rgb", "8", "binary", "0"),
    ("cornell", "rgb", "1", "brute", "0"),
    ("waves", "spectral", "8", "binary", "1"),
    ("merging", "rgb", "1", "brute", "0"),
]
NAMES = (
    "ball", "glass_metal", "plastic", "textures", "thin_lens", "envmap", "waves", "photons",
    "merging",
)  # fmt: skip
WAYS = (
    ("rgb", "1", "wide8", "0"),
    ("spectral", "8", "binary", "1"),
    ("spectral", "16", "wide8", "0"),
    ("rgb", "1", "compact", "1"),
)
MORE = [(name, *way) for name in NAMES for way in WAYS]


@pytest.mark.parametrize("case", QUICK, ids="-".join)
def test_a_render(tmp_path: Path, case: tuple[str, ...]) -> None:
    assert checked(tmp_path, RENDER, *case, races=case[2] == "1") == ""


@pytest.mark.slow
@pytest.mark.parametrize("case", MORE, ids="-".join)
def test_more_renders(tmp_path: Path, case: tuple[str, ...]) -> None:
    assert checked(tmp_path, RENDER, *case, races=case[2] == "1") == ""
